"""Search for the best settings of retracting wrong folds, once per task for many runs.

The settings of `agents.training.drawing_back` (the wrong angle of a joint, the length that is drawn
in, and the next open loop) are selected for each task from uniformly drawn candidates, on draws of
their own stream.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from agents.open_loops.schedules import LONGEST_PAUSE, Schedule
from agents.open_loops.search import Search
from agents.settings import EnvSettings
from agents.training.drawing_back import DrawingBack, DrawingBackTwice, Redoing, Refolding
from agents.training.envs import make_env
from agents.training.open_loops import best_open_loops, field_of, kept_search
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.baselines.legs import Leg
from magfold_env.envs.reprogram import ReprogramEnv
from magfold_env.envs.spaces.actions import SLOWEST_LEVEL
from magfold_env.scene import Scene

STREAM = "drawing back"
"""Stream of the draws that select settings."""

EFFORT = Search(192, 4000)
"""Number of compared settings of a task, and of their episodes."""

SAME = 0.3
"""Share of the settings that repeat the same open loop."""

STANDS = LONGEST_PAUSE + 1, 75
"""Steps of standstill at the end of a first fold, longer than any pause between pulses."""


def searched(
    settings: EnvSettings, effort: Search, folder: Path
) -> list[Redoing] | list[Refolding]:
    """Return the best settings for every task of an environment in which a given chain folds.

    `effort` is that of the search for open loops; `folder` stores searches, also for other runs.
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
    return field_of(env).race(number, found, STREAM, EFFORT.budget, playing)[0].place


def _tried(env: Any, number: int, best: Sequence[Schedule]) -> Sequence[Redoing | Refolding]:
    if isinstance(env, ReprogramEnv):
        return candidates_twice(best, number, EFFORT.candidates, env.world.scene)
    return candidates(best, number, EFFORT.candidates)


def playing(found: Sequence[Any]) -> Plan:
    """Return a plan that plays by some settings, one per row."""
    return (DrawingBackTwice if isinstance(found[0], Refolding) else DrawingBack)(found)


def candidates(best: Sequence[Schedule], number: int, count: int) -> list[Redoing]:
    """Return the candidates for a task, by its number, from its best open loops."""
    rng = _rng(number)
    found = [Redoing(best[0], each, 0.6, 0.3, 0.2, -0.3) for each in (best[0], *_onward(best))]
    while len(found) < count:
        found.append(_drawn(rng, best))
    return found[:count]


def candidates_twice(
    best: Sequence[Schedule], number: int, count: int, scene: Scene
) -> list[Refolding]:
    """Return the candidates for a task of two folds, by its number, from its best open loops."""
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
    """Return a first fold that pauses, and then lets the last component out a little more."""
    speed = float(np.exp(rng.uniform(np.log(SLOWEST_LEVEL), np.log(0.15))))
    until = (scene.n - rng.uniform(0.03, 0.3)) * scene.casing.diagonal
    stand = Leg(0.0, steps=int(rng.integers(5, LONGEST_PAUSE)))
    way = (*first.way, stand, Leg(speed, until, brakes=True), Leg(0.0))
    return first._replace(way=way)


def _early(rng: np.random.Generator, count: int) -> int:
    """Return a random index below a number, with a preference for small ones."""
    return int(count * rng.random() ** 2)


def _onward(best: Sequence[Schedule]) -> list[Schedule]:
    """Return the candidates that never draw in, or all if there are none."""
    return [each for each in best if all(leg.speed >= 0.0 for leg in each.way)] or list(best)


def _parted(found: Schedule) -> tuple[Schedule, float, Schedule]:
    """Return the first of two folds up to its pause, the speed back, and the second."""
    back = next(place for place, leg in enumerate(found.way) if leg.speed < 0.0)
    first = found.way[: back - 1]
    second = found.way[back + 1 :]
    return found._replace(way=first), found.way[back].speed, found._replace(way=second)
