"""Schedules of feed: speeds step by step, chosen before an episode begins.

============== ===================================================================================
family         what is drawn
============== ===================================================================================
constant       nothing: one of the speeds that the best constant speed is chosen from, each once
two speeds     the speeds, and where the feed goes from one to the other, evenly along the chain
three speeds   likewise, with two places
pulses         a speed, how far the feed goes in one push, a twentieth to half of the chain, and
               the pause after it, 20 ms to half a second
push-pull-push three speeds, the second one back; how far the first push goes, a fifth to all of
               the chain, and the share of it that is drawn in again, a tenth to all
============== ===================================================================================

Speeds are from 0.03 to 0.6 m/s; they, the lengths of pulses and the pauses are even on a scale of
powers. Schedules that do not have the chain out after four fifths of the time that
there is are drawn again.
"""

from collections.abc import Callable
from typing import NamedTuple
from zlib import crc32

import numpy as np

from magfold_env.envs.baselines.constant_speed import SPEEDS
from magfold_env.envs.chains.arrays import Floats
from magfold_env.envs.feed_track import INTERVAL
from magfold_env.envs.spaces.actions import FASTEST, SLOWEST_LEVEL

LONGEST_PAUSE = 25
"""Between two pulses, in steps."""


class Schedule(NamedTuple):
    """What an open loop decides."""

    family: str
    pieces: tuple[tuple[float, int], ...]
    """A speed [m/s] and for how many steps, one after another."""
    repeats: bool = False
    """Whether the pieces begin again after the last; else its speed is kept."""

    def speeds(self, steps: int) -> Floats:
        """Return the speeds of so many steps [m/s]."""
        once = np.repeat(*map(np.array, zip(*self.pieces, strict=True)))
        if self.repeats:
            return np.resize(once, steps)
        return np.pad(once, (0, steps), mode="edge")[:steps]

    def __str__(self) -> str:
        """Return it in words."""
        parts = [f"{speed:.3f} m/s for {INTERVAL * steps:.2f} s" for speed, steps in self.pieces]
        if not self.repeats:
            parts[-1] = f"{self.pieces[-1][0]:.3f} m/s"
        return f"{self.family}: {', '.join(parts)}"


def constant(speed: float) -> Schedule:
    """Return the schedule of one speed [m/s]."""
    return Schedule("constant", ((speed, 1),))


def out_by(horizon: int) -> int:
    """Return after how many steps of an episode schedules have the chain out."""
    return horizon * 4 // 5


def schedules(count: int, length: float, horizon: int, seed: int) -> list[Schedule]:
    """Return schedules for a chain of some length [m]; the constant speeds come first.

    The first schedules of a long list are those of a short one.
    """
    key = (crc32(b"schedules"),)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
    found = [constant(speed) for speed in SPEEDS]
    while len(found) < count:
        family = _FAMILIES[len(found) % len(_FAMILIES)]
        drawn = family(rng, length)
        while not INTERVAL * drawn.speeds(out_by(horizon)).cumsum().max() >= length:
            drawn = family(rng, length)
        found.append(drawn)
    return found[:count]


def _two_speeds(rng: np.random.Generator, length: float) -> Schedule:
    return Schedule("two speeds", _stretches(rng, length, 2))


def _three_speeds(rng: np.random.Generator, length: float) -> Schedule:
    return Schedule("three speeds", _stretches(rng, length, 3))


def _pulses(rng: np.random.Generator, length: float) -> Schedule:
    push = _piece(_speed(rng), length * _even_in_powers(rng, 0.05, 0.5))
    pause = round(_even_in_powers(rng, 1.0, LONGEST_PAUSE))
    return Schedule("pulses", (push, (0.0, pause)), repeats=True)


def _push_pull_push(rng: np.random.Generator, length: float) -> Schedule:
    pushed = length * rng.uniform(0.2, 1.0)
    back, again = pushed * rng.uniform(0.1, 1.0), _speed(rng)
    pieces = _piece(_speed(rng), pushed), _piece(-_speed(rng), back), (again, 1)
    return Schedule("push-pull-push", pieces)


_FAMILIES: tuple[Callable[[np.random.Generator, float], Schedule], ...] = (
    _two_speeds,
    _three_speeds,
    _pulses,
    _push_pull_push,
)


def _stretches(
    rng: np.random.Generator, length: float, count: int
) -> tuple[tuple[float, int], ...]:
    """Return pieces of so many speeds that share the chain among them."""
    places = np.sort(rng.uniform(0.0, length, count - 1))
    shares = np.diff(places, prepend=0.0, append=length)
    return tuple(_piece(_speed(rng), share) for share in shares.tolist())


def _piece(speed: float, distance: float) -> tuple[float, int]:
    """Return a speed [m/s] and the steps in which the feed goes some way [m] with it."""
    return speed, max(1, round(distance / abs(speed) / INTERVAL))


def _speed(rng: np.random.Generator) -> float:
    return _even_in_powers(rng, SLOWEST_LEVEL, FASTEST)


def _even_in_powers(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
