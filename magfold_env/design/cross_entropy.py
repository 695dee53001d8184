"""The cross-entropy method on releases of the chain: no energy, nothing but what happens.

Choices are drawn from a distribution, independent for each face and for the logarithm of the
speed, and the distribution is moved towards the best of them (Rubinstein and Kroese, *The
Cross-Entropy Method*, 2004).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from magfold_env.design.annealing import sequence_of_signs
from magfold_env.design.choice import Choice
from magfold_env.design.race import Oracle, Standing, race

POPULATION = 60
ELITE = 10
RELEASES = 4
"""Of every choice."""

_STEP = 0.7  # from the old distribution to that of the elite
_SURE = 0.97  # no face is more certain than that
_NEAR = 0.85  # how certain the faces of a first choice are
_NARROW = 0.05  # least standard deviation of the speed's logarithm

Floats = npt.NDArray[np.float64]


class _Distribution(NamedTuple):
    north: Floats
    """Probability that a face is N, shape (4n,)."""
    mean: float
    """Of the speed's logarithm."""
    deviation: float


def cross_entropy(
    trials: Oracle,
    faces: int,
    speeds: Sequence[float],
    rng: np.random.Generator,
    budget: int,
    goal: float = 1.0,
    first: Choice | None = None,
) -> list[Standing]:
    """Search for the choice that folds into the target most often.

    Parameters
    ----------
    trials
        Releases choices.
    faces
        How many faces the chain has.
    speeds
        The search stays between the slowest and the fastest [m/s]; none where no tube feeds.
    rng
        Draws the choices.
    budget
        Releases, those before the search included, that no generation but the first may exceed.
    goal
        Share of successes that ends the search.
    first
        Where to begin; None begins with every choice equally likely.

    Returns
    -------
    list of Standing
        The choices that came nearest, by `race`.
    """
    current = _around(first, faces, speeds)
    best: list[Standing] = []
    while True:
        choices = _drawn(current, speeds, rng)
        scores = trials.scores(choices, RELEASES)
        order = np.argsort(-scores.mean(axis=1), kind="stable")
        elite: list[Choice] = [choices[k] for k in order[:ELITE].tolist()]
        current = _moved(current, elite)
        best = race([*(standing.choice for standing in best[:2]), *elite], trials)
        if best[0].rate >= goal or trials.count + POPULATION * RELEASES > budget:
            return best


def _around(first: Choice | None, faces: int, speeds: Sequence[float]) -> _Distribution:
    north = np.full(faces, 0.5)
    if first is not None:
        north = np.where(_poles(first), _NEAR, 1.0 - _NEAR)
    if not speeds:
        return _Distribution(north, 0.0, 0.0)
    low, high = np.log(min(speeds)), np.log(max(speeds))
    speed = None if first is None else first.speed
    mean = 0.5 * (low + high) if speed is None else np.log(speed)
    return _Distribution(north, float(mean), float(max(high - low, _NARROW)) / 2.0)


def _drawn(
    current: _Distribution, speeds: Sequence[float], rng: np.random.Generator
) -> list[Choice]:
    signs = np.where(rng.random((POPULATION, current.north.size)) < current.north, 1.0, -1.0)
    logarithms = rng.normal(current.mean, current.deviation, POPULATION)
    chosen: list[float | None] = [None] * POPULATION
    if speeds:
        chosen = np.clip(np.exp(logarithms), min(speeds), max(speeds)).tolist()
    return [Choice(sequence_of_signs(row), speed) for row, speed in zip(signs, chosen, strict=True)]


def _moved(current: _Distribution, elite: Sequence[Choice]) -> _Distribution:
    poles = np.array(
        [[pole == "N" for each in choice.sequence for pole in each] for choice in elite]
    )
    # To flip all poles changes nothing: `sequence_of_signs` makes the first face N.
    north = (1.0 - _STEP) * current.north + _STEP * poles.mean(axis=0)
    speeds = [choice.speed for choice in elite if choice.speed is not None]
    if not speeds:
        return current._replace(north=np.clip(north, 1.0 - _SURE, _SURE))
    logarithms = np.log(speeds)
    mean = (1.0 - _STEP) * current.mean + _STEP * float(logarithms.mean())
    deviation = (1.0 - _STEP) * current.deviation + _STEP * float(logarithms.std())
    return _Distribution(np.clip(north, 1.0 - _SURE, _SURE), mean, max(deviation, _NARROW))


def _poles(choice: Choice) -> list[bool]:
    """Return whether each face is N."""
    return [pole == "N" for faces in choice.sequence for pole in faces]
