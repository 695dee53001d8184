"""A player that draws wrong folds back in and releases them again, for imitation.

The player follows a task's best open loop until a joint outside the tube turns the wrong way. Then
it draws that joint in, but never the first component fed, and feeds it again with the same or
another open loop; a second attempt often succeeds. It does the same with misplaced joints while the
feed stands still at the end of a first fold, before it draws the chain in for a second fold.

The player's settings (the angle at which a joint counts as wrong, the length that is drawn in, and
the next open loop) are selected once per task from random candidates, and serve many runs.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from agents.open_loops.schedules import LONGEST_PAUSE, Schedule
from agents.open_loops.search import Search
from agents.settings import EnvSettings
from agents.training.envs import make_env
from agents.training.open_loops import best_open_loops, kept_search, pool_of
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.baselines.legs import Following, Leg
from magfold_env.envs.chains.arrays import Bools, Floats, Ints
from magfold_env.envs.reprogram import BACK, FIRST, SECOND, ReprogramEnv
from magfold_env.envs.spaces.actions import SLOWEST_LEVEL
from magfold_env.envs.tasks.goals import SUCCESS_TOLERANCE
from magfold_env.scene import Scene

STREAM = "drawing back"
"""Name of the random stream that draws the episodes for selecting settings."""

EFFORT = Search(192, 4000)
"""Number of settings compared per task, and total number of episodes that compare them."""

SAME = 0.3
"""Share of settings that use the same open loop again."""

STANDS = LONGEST_PAUSE + 1, 75
"""Range of the standstill after a first fold, in steps; it exceeds any pause between pulses."""

LEAST = 0.02
"""Smallest length of the chain that stays outside the tube while it is drawn in, or that stays
inside while it is let out again before it is drawn in further [diagonals]."""

SLIPS = 0.9
"""Share of the drive's largest pull above which the drive may slip."""

PATIENCE = 0.8
"""Share of the time limit after which no more joints are drawn in."""


class Redoing(NamedTuple):
    """The player's settings for one fold."""

    first: Schedule
    again: Schedule
    """The open loop that follows once joints have been drawn in."""
    wrong: float
    """Angle in the wrong direction above which a joint is drawn in [rad]."""
    at_last: float
    """The same limit while the last component comes out, which cannot be drawn in again [rad]."""
    depth: float
    """Advance of the feed after drawing in, relative to the point where the component before the
    joint begins to come out [diagonals]."""
    speed: float
    """Speed at which the joint is drawn in [m/s], negative."""
    stands: float = np.inf
    """Steps of standstill before a misplaced joint is drawn in."""


class Refolding(NamedTuple):
    """The player's settings for two folds."""

    first: Redoing
    second: Redoing
    back: float
    """Speed at which the chain is drawn in between the folds [m/s], negative."""
    slack: float
    """Length that is let out again if the drive slips [diagonals]."""


class DrawingBack:
    """A plan that repeats failed parts of a fold, with its own settings in each row of episodes."""

    def __init__(self, found: Sequence[Redoing]) -> None:
        self._first = Following([each.first.way for each in found])
        self._again = Following([each.again.way for each in found])
        settings = np.array([each[2:] for each in found], dtype=np.float64)
        self._wrong, self._at_last, self._depth, self._speed, self._stands = settings.T
        self._goal: Floats = np.full(len(found), np.nan)
        self._stood: Ints = np.zeros(len(found), dtype=np.int64)
        self.times: Ints = np.zeros(len(found), dtype=np.int64)
        """Number of times that each row has drawn joints in."""

    def __call__(self, episodes: Any, rows: Ints) -> tuple[Floats]:
        """Return the speeds of the given rows for the next step [m/s]."""
        diagonal = episodes.setup.scene.casing.diagonal
        gone = episodes.chains.advances()
        self._judge(episodes, rows, gone / diagonal)
        goal = self._goal[rows]
        back = gone[rows] > goal * diagonal
        over = rows[~back & np.isfinite(goal)]
        self._goal[over] = np.nan
        self._again.restart(over, gone[over])
        speeds = np.where(back, self._speed[rows], 0.0)
        is_first = self.times[rows] == 0
        for plan, own in (self._first, ~back & is_first), (self._again, ~back & ~is_first):
            if own.any():
                speeds[own] = plan(episodes, rows[own])[0]
        self._stood[rows] = np.where(speeds == 0.0, self._stood[rows] + 1, 0)
        return (speeds,)

    def _judge(self, episodes: Any, rows: Ints, gone: Floats) -> None:
        """Start drawing in the chain of each row with a joint that has turned the wrong way."""
        is_last = gone[rows] > episodes.setup.scene.n - 1
        wrong = np.where(is_last, self._at_last[rows], self._wrong[rows])
        is_wrong = _turned_wrong(episodes, rows, wrong, self._stood[rows] >= self._stands[rows])
        begins = is_wrong.any(axis=1) & np.isnan(self._goal[rows])
        begins &= episodes.times(rows) < PATIENCE * episodes.late
        begins &= ~episodes.arrays.released[rows].all(axis=1)
        at = np.maximum(is_wrong.argmax(axis=1) + self._depth[rows], LEAST)
        begins &= gone[rows] > at
        self._goal[rows[begins]] = at[begins]
        self.times[rows] += begins


def _turned_wrong(episodes: Any, rows: Ints, wrong: Floats, stood: Bools) -> Bools:
    """Return which joints of some rows have turned the wrong way, in the order of feed.

    If the feed has `stood` long enough, all misplaced joints count.
    """
    arrays, turns = episodes.arrays, episodes.goals.turns[rows]
    joints = np.diff(arrays.angles[rows], axis=1)
    too_far = np.where(turns == 0.0, np.abs(joints), -np.sign(turns) * joints) > wrong[:, None]
    too_far |= stood[:, None] & (np.abs(joints - turns) > SUCCESS_TOLERANCE)
    return np.where(arrays.forward[rows, None], too_far, too_far[:, ::-1])


class DrawingBackTwice:
    """A plan for two folds in every row of episodes; between them, it draws the chain in."""

    def __init__(self, found: Sequence[Refolding]) -> None:
        self._folds = {
            FIRST: DrawingBack([each.first for each in found]),
            SECOND: DrawingBack([each.second for each in found]),
        }
        self._back = np.array([each.back for each in found])
        self._slack = np.array([each.slack for each in found])
        self._goal: Floats = np.full(len(found), np.nan)

    def __call__(self, episodes: Any, rows: Ints) -> tuple[Floats]:
        """Return the speeds of the given rows for the next step [m/s]."""
        stage = episodes.stage[rows]
        speeds = np.where(stage == BACK, self._drawn_in(episodes, rows), 0.0)
        for number, fold in self._folds.items():
            own = stage == number
            if own.any():
                speeds[own] = fold(episodes, rows[own])[0]
        return (speeds,)

    def _drawn_in(self, episodes: Any, rows: Ints) -> Floats:
        """Return the speeds [m/s] of some rows that are drawing the chain in."""
        gone, scene = episodes.chains.advances()[rows], episodes.setup.scene
        slips = episodes.infos(rows)["force"] < -SLIPS * scene.feed.force_limit
        more = gone + self._slack[rows] * scene.casing.diagonal
        # The tube keeps the last component.
        goal = np.minimum(more, (scene.n - LEAST) * scene.casing.diagonal)
        goal = np.where(slips, goal, self._goal[rows])
        self._goal[rows] = np.where(gone >= goal, np.nan, goal)
        return np.where(np.isfinite(self._goal[rows]), -1.0, 1.0) * self._back[rows]


def searched(
    settings: EnvSettings, effort: Search, folder: Path
) -> list[Redoing] | list[Refolding]:
    """Return the best settings for every task of an environment in which given chains fold.

    `effort` is the effort of the search for open loops; all runs share the searches in `folder`.
    """
    best = best_open_loops(settings, effort, folder)
    key = {"open loops": effort, "drawing back": EFFORT}
    jobs = [(settings, number, each) for number, each in enumerate(best)]
    places: list[int] = kept_search("drawing back", settings, key, folder, _search, jobs)
    env: Any = make_env(settings).unwrapped
    found: list[Any] = [
        _tried(env, number, each)[place]
        for number, (each, place) in enumerate(zip(best, places, strict=True))
    ]
    return found


def _search(settings: EnvSettings, number: int, best: Sequence[Schedule]) -> int:
    env: Any = make_env(settings).unwrapped
    found = _tried(env, number, best)
    return pool_of(env).race(number, found, STREAM, EFFORT.budget, playing)[0].place


def _tried(env: Any, number: int, best: Sequence[Schedule]) -> Sequence[Redoing | Refolding]:
    if isinstance(env, ReprogramEnv):
        return candidates_twice(best, number, EFFORT.candidates, env.setup.scene)
    return candidates(best, number, EFFORT.candidates)


def playing(found: Sequence[Any]) -> Plan:
    """Return a plan that plays with the found settings, one per row."""
    return (DrawingBackTwice if isinstance(found[0], Refolding) else DrawingBack)(found)


def candidates(best: Sequence[Schedule], number: int, count: int) -> list[Redoing]:
    """Return `count` random settings that use the best open loops of the task with this number."""
    rng = _rng(number)
    found = [Redoing(best[0], each, 0.6, 0.3, 0.2, -0.3) for each in (best[0], *_onward(best))]
    while len(found) < count:
        found.append(_drawn(rng, best))
    return found[:count]


def candidates_twice(
    best: Sequence[Schedule], number: int, count: int, scene: Scene
) -> list[Refolding]:
    """Return `count` random settings for a task of two folds; see `candidates`."""
    rng = _rng(number)
    firsts, backs, seconds = zip(*map(_parted, best), strict=True)
    found: list[Refolding] = []
    while len(found) < count:
        first = _drawn(rng, [_creeping(rng, each, scene) for each in firsts])
        first = first._replace(stands=float(rng.integers(*STANDS)))
        back = backs[_early(rng, len(best))]
        found.append(Refolding(first, _drawn(rng, seconds), back, rng.uniform(0.1, 1.0)))
    return found


def _rng(number: int) -> np.random.Generator:
    key = (crc32(b"drawing back"),)
    return np.random.default_rng(np.random.SeedSequence(number, spawn_key=key))


def _drawn(rng: np.random.Generator, best: Sequence[Schedule]) -> Redoing:
    onward = _onward(best)
    first = best[_early(rng, len(best))]
    again = first if rng.random() < SAME else onward[rng.integers(len(onward))]
    depth, speed = rng.uniform(-0.5, 0.6), -np.exp(rng.uniform(np.log(0.1), np.log(0.5)))
    wrong, at_last = rng.uniform(0.3, 1.2), rng.uniform(0.05, 0.6)
    return Redoing(first, again, wrong, at_last, depth, float(speed))


def _creeping(rng: np.random.Generator, first: Schedule, scene: Scene) -> Schedule:
    """Return a first fold's schedule that pauses, then lets the last component out a bit more."""
    speed = float(np.exp(rng.uniform(np.log(SLOWEST_LEVEL), np.log(0.15))))
    until = (scene.n - rng.uniform(0.03, 0.3)) * scene.casing.diagonal
    stand = Leg(0.0, steps=int(rng.integers(5, LONGEST_PAUSE)))
    way = (*first.way, stand, Leg(speed, until, brakes=True), Leg(0.0))
    return first._replace(way=way)


def _early(rng: np.random.Generator, count: int) -> int:
    """Return a random index below `count`, with a preference for small ones."""
    return int(count * rng.random() ** 2)


def _onward(best: Sequence[Schedule]) -> list[Schedule]:
    """Return the schedules that never draw the chain in, or all if there are none."""
    return [each for each in best if all(leg.speed >= 0.0 for leg in each.way)] or list(best)


def _parted(found: Schedule) -> tuple[Schedule, float, Schedule]:
    """Split a schedule into a first fold up to its pause, the speed back, and a second fold."""
    back = next(place for place, leg in enumerate(found.way) if leg.speed < 0.0)
    first = found.way[: back - 1]
    second = found.way[back + 1 :]
    return found._replace(way=first), found.way[back].speed, found._replace(way=second)
