"""Drawing in what folds wrong and letting it out anew: what demonstrates a fold that can fail.

A task's best open loop is followed until a joint outside the tube turns the wrong way. Then that
joint is drawn in, but for the chain's first component, and fed again, by another open loop or the
same: what failed once often comes right. How far a joint must have turned, how far it is drawn in
and what is followed then is chosen for each task, on draws of a stream of its own, among settings
that are drawn evenly.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from agents.open_loops.field import Search
from agents.open_loops.schedules import Schedule
from agents.settings import EnvSettings
from agents.training.envs import make_env
from agents.training.open_loops import best_open_loops, field_of, kept_search
from magfold_env.envs.baselines.legs import Following
from magfold_env.envs.chains.arrays import Bools, Floats, Ints

STREAM = "drawing back"
"""Of the draws that settings are chosen on."""

EFFORT = Search(192, 4000)
"""How many settings of a task are compared, and in how many episodes."""

LEAST = 0.02
"""Where the feed stands at least when it has drawn in [diagonals]."""

SAME = 0.3
"""Share of the settings with which the same open loop is followed anew."""

PATIENCE = 0.8
"""Share of the time after which nothing is drawn in any more."""


class Redoing(NamedTuple):
    """How a task is done."""

    first: Schedule
    again: Schedule
    """What is followed after drawing in."""
    wrong: float
    """Angle that a joint has turned the wrong way before it is drawn in [rad]."""
    at_last: float
    """The same while the last component comes out, after which it is too late [rad]."""
    depth: float
    """Where the feed then stands, beyond where the component before the joint begins to come out
    [diagonals]."""
    speed: float
    """At which it is [m/s], negative."""


class DrawingBack:
    """Plays tasks of which the first attempt may fail, in every row of episodes.

    Parameters
    ----------
    found : sequence of Redoing
        For each row how it is done.

    Attributes
    ----------
    times : array of int, shape (m,)
        How often every row has drawn in.
    """

    def __init__(self, found: Sequence[Redoing]) -> None:
        self._first = Following([each.first.way for each in found])
        self._again = Following([each.again.way for each in found])
        settings = np.array([each[2:] for each in found], dtype=np.float64)
        self._wrong, self._at_last, self._depth, self._speed = settings.T
        self._goal: Floats = np.full(len(found), np.nan)
        self.times: Ints = np.zeros(len(found), dtype=np.int64)

    def __call__(self, episodes: Any, rows: Ints) -> tuple[Floats]:
        """Return the speeds of some rows in the next step [m/s]."""
        diagonal = episodes.world.scene.casing.diagonal
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
        return (speeds,)

    def _judge(self, episodes: Any, rows: Ints, gone: Floats) -> None:
        """Let the rows in which a joint has turned the wrong way begin to draw in."""
        is_last = gone[rows] > episodes.world.scene.n - 1
        wrong = np.where(is_last, self._at_last[rows], self._wrong[rows])
        is_wrong = _turned_wrong(episodes, rows, wrong)
        begins = is_wrong.any(axis=1) & np.isnan(self._goal[rows])
        begins &= episodes.times(rows) < PATIENCE * episodes.late
        begins &= ~episodes.arrays.released[rows].all(axis=1)
        at = np.maximum(is_wrong.argmax(axis=1) + self._depth[rows], LEAST)
        begins &= gone[rows] > at
        self._goal[rows[begins]] = at[begins]
        self.times[rows] += begins


def _turned_wrong(episodes: Any, rows: Ints, wrong: Floats) -> Bools:
    """Return which joints of some rows have turned the wrong way, in the order of feed."""
    arrays, turns = episodes.arrays, episodes.goals.turns[rows]
    joints = np.diff(arrays.angles[rows], axis=1)
    too_far = np.where(turns == 0.0, np.abs(joints), -np.sign(turns) * joints) > wrong[:, None]
    return np.where(arrays.forward[rows, None], too_far, too_far[:, ::-1])


def redoings(settings: EnvSettings, effort: Search, folder: Path) -> list[Redoing]:
    """Return for every task of an environment how it is done.

    Parameters
    ----------
    settings : EnvSettings
        Those of the environment.
    effort : Search
        How many open loops are tried for every task, and in how many episodes.
    folder : Path
        Where what is searched is kept, for other runs too.
    """
    best = best_open_loops(settings, effort, folder)
    key = {"open loops": effort, "drawing back": EFFORT}
    jobs = [(settings, number, each) for number, each in enumerate(best)]
    places: list[int] = kept_search("drawing back", settings, key, folder, _search, jobs)
    return [
        candidates(each, number, EFFORT.candidates)[place]
        for number, (each, place) in enumerate(zip(best, places, strict=True))
    ]


def _search(settings: EnvSettings, number: int, best: Sequence[Schedule]) -> int:
    env: Any = make_env(settings).unwrapped
    found = candidates(best, number, EFFORT.candidates)
    return field_of(env).race(number, found, STREAM, EFFORT.budget, DrawingBack)[0].place


def candidates(best: Sequence[Schedule], number: int, count: int) -> list[Redoing]:
    """Return what is compared for a task, by its number, of its best open loops."""
    rng = np.random.default_rng(np.random.SeedSequence(number, spawn_key=(crc32(b"drawing back"),)))
    onward = [each for each in best if all(leg.speed >= 0.0 for leg in each.way)] or list(best)
    found = [Redoing(best[0], each, 0.6, 0.3, 0.2, -0.3) for each in (best[0], *onward)]
    while len(found) < count:
        first = best[int(len(best) * rng.random() ** 2)]
        again = first if rng.random() < SAME else onward[rng.integers(len(onward))]
        depth, speed = rng.uniform(-0.5, 0.6), -np.exp(rng.uniform(np.log(0.1), np.log(0.5)))
        wrong, at_last = rng.uniform(0.3, 1.2), rng.uniform(0.05, 0.6)
        found.append(Redoing(first, again, wrong, at_last, depth, float(speed)))
    return found[:count]
