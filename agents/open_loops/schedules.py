"""Feed schedules, chosen before an episode begins.

A schedule is a list of speeds, each of which applies until the feed reaches a certain advance.

============== ===================================================================================
family         what is drawn
============== ===================================================================================
baseline       nothing: each constant speed from which the baseline is chosen is used once; with
               two folds, the baseline's push, pull and push is used
two speeds     two speeds, and the advance at which the speed changes, uniform over the whole feed
three speeds   three speeds, and two such advances
pulses         a speed, the advance of one push (a twentieth to half of the chain), and the pause
               after it (20 ms to half a second)
push-pull-push three speeds, the second one inward; the advance of the first push (a fifth to all
               of the feed), and the share of it that is drawn in again (a tenth to all)
refold         for two folds: one to three speeds, or pulses, until the tube holds only 0.1 to 0.9
               diagonals of the last component; a pause (0.1 to 1.2 s); a pull to an advance of
               0.05 to 1 diagonals; then any of the drawn families above over the whole feed
============== ===================================================================================

Speeds are from 0.03 to 0.6 m/s. Speeds, lengths of pulses and pauses are drawn log-uniformly.
Schedules that need more than four fifths of the time limit to feed the chain out are drawn again.
Because schedules change speed at advances rather than times, they compensate for errors of the
drive, as any player can that observes the advance of the feed.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from magfold_env.envs.baselines.constant_speed import SPEEDS
from magfold_env.envs.baselines.legs import Following, Leg
from magfold_env.envs.baselines.three_speeds import way_of
from magfold_env.envs.camera_track import INTERVAL, FeedTrackEnv
from magfold_env.envs.spaces.actions import FASTEST, SLOWEST_LEVEL
from magfold_env.envs.tasks.feed_tasks import FeedTask
from magfold_env.scene import Scene

Way = tuple[Leg, ...]

LONGEST_PAUSE = 25
"""Longest pause between two pulses, in steps."""

STANDS = 5, 60
"""Shortest and longest pause between two folds, in steps."""


class Schedule(NamedTuple):
    """The feed speeds that an open loop chooses."""

    family: str
    way: Way
    """Successive speeds, each up to an advance or, for a pause, for some steps."""

    def time(self, length: float) -> float:
        """Return the time [s] at which the feed of an exact drive reaches an advance [m]."""
        gone, passed = 0.0, 0.0
        for leg in self.way:
            place = min(leg.until, length)
            if leg.speed == 0.0:
                passed += INTERVAL * leg.steps
            else:
                passed += (place - gone) / leg.speed
                gone = place
        return passed

    def __str__(self) -> str:
        """Return the schedule as text."""
        parts = []
        for speed, until, steps, _ in self.way:
            stands = f"stand for {INTERVAL * steps:.2f} s"
            to = f" to {1e3 * until:.1f} mm" if np.isfinite(until) else ""
            parts.append(f"{speed:.3f} m/s{to}" if speed else stands)
        return f"{self.family}: {', '.join(parts)}"


def constant(speed: float) -> Schedule:
    """Return the schedule with one constant speed [m/s]."""
    return Schedule("baseline", (Leg(speed),))


class Schedules:
    """The open loops of an environment in which only the feed speed is free."""

    fastest = constant(FASTEST)
    """The schedule with the highest speed."""

    def __init__(self, env: FeedTrackEnv) -> None:
        self._env = env

    def candidates(self, count: int, number: int) -> list[Schedule]:
        """Return `count` schedules for the task with this number."""
        env: Any = self._env
        scene, refolds = env.setup.scene, len(env.tasks[number].words) > 1
        simple = [constant(speed) for speed in SPEEDS]
        if refolds:
            simple = [Schedule("baseline", way_of(scene, env.baseline_of(number)))]
        return schedules(count, scene, env.episodes.horizon, number, simple, refolds)

    def following(self, found: Sequence[Schedule]) -> Following:
        """Return a plan that plays schedules, one per row."""
        return Following([each.way for each in found])

    def drawn(self) -> tuple[Scene, FeedTask]:
        """Return the current episode's scene and task, including all randomly drawn values."""
        task: Any = self._env.task
        return self._env.to_scene(), task

    def raced(self, best: list[Schedule], number: int, task: FeedTask) -> list[Schedule]:
        """Return the schedules for the oracle to try, which are the best of the search."""
        return best


def schedules(
    count: int, scene: Scene, horizon: int, seed: int, simple: Iterable[Schedule], refolds: bool
) -> list[Schedule]:
    """Return schedules for a chain, beginning with the `simple` ones.

    A longer list begins with the schedules of a shorter list. If the chain must fold twice, all
    schedules that are not `simple` belong to the family ``refold``.
    """
    key = (crc32(b"schedules"),)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
    found = list(simple)
    latest = INTERVAL * (horizon * 4 // 5)
    length, diagonal = scene.n * scene.casing.diagonal, scene.casing.diagonal
    while len(found) < count:
        name, draw = _FAMILIES[len(found) % len(_FAMILIES)]
        way = _refold(rng, length, diagonal, draw) if refolds else draw(rng, 0.0, length)
        drawn = Schedule(f"refold, {name}" if refolds else name, way)
        if drawn.time(length) <= latest:
            found.append(drawn)
    return found[:count]


def _refold(rng: np.random.Generator, length: float, diagonal: float, second: "_Draw") -> Way:
    held = length - diagonal * rng.uniform(0.1, 0.9)
    *out, last = _FIRST[rng.integers(len(_FIRST))](rng, 0.0, held)
    stand = Leg(0.0, steps=round(_even_in_powers(rng, *STANDS)))
    inside = diagonal * rng.uniform(0.05, 1.0)
    back = Leg(-_speed(rng), inside)
    return *out, last._replace(until=held, brakes=True), stand, back, *second(rng, inside, length)


def _stretches(count: int, rng: np.random.Generator, start: float, length: float) -> Way:
    """Return `count` random speeds, each for its own part of the feed up to `length` [m]."""
    places = np.sort(rng.uniform(start, length, count - 1)).tolist()
    return tuple(Leg(_speed(rng), place) for place in (*places, np.inf))


def _pulses(rng: np.random.Generator, start: float, length: float) -> Way:
    speed, step = _speed(rng), length * _even_in_powers(rng, 0.05, 0.5)
    pause = Leg(0.0, steps=round(_even_in_powers(rng, 1.0, LONGEST_PAUSE)))
    way: list[Leg] = []
    for place in np.arange(start + step, length, step).tolist():
        way += [Leg(speed, place), pause]
    return *way, Leg(speed)


def _push_pull_push(rng: np.random.Generator, start: float, length: float) -> Way:
    pushed = (length - start) * rng.uniform(0.2, 1.0)
    back, again = pushed * rng.uniform(0.1, 1.0), _speed(rng)
    way = Leg(_speed(rng), start + pushed), Leg(-_speed(rng), start + pushed - back)
    return *way, Leg(again)


_Draw = Callable[[np.random.Generator, float, float], Way]

_FAMILIES: tuple[tuple[str, _Draw], ...] = (
    ("two speeds", partial(_stretches, 2)),
    ("three speeds", partial(_stretches, 3)),
    ("pulses", _pulses),
    ("push-pull-push", _push_pull_push),
)

_FIRST: tuple[_Draw, ...] = (*(partial(_stretches, count) for count in (1, 2, 3)), _pulses)


def _speed(rng: np.random.Generator) -> float:
    return _even_in_powers(rng, SLOWEST_LEVEL, FASTEST)


def _even_in_powers(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
