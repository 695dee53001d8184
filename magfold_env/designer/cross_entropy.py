"""The cross-entropy method on releases of the chain: no energy, nothing but what happens.

Choices are drawn from a distribution, independent for each face, or group of faces that flip as
one, and for the logarithm of the speed, and the distribution is moved towards the best of them
(Rubinstein and Kroese, *The Cross-Entropy Method*, 2004).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from magfold_env.designer.annealing import sequence_of_signs
from magfold_env.designer.choice import Choice
from magfold_env.designer.race import Oracle, Standing, race

POPULATION = 60
ELITE = 10
RELEASES = 4
"""Of every choice."""

_STEP = 0.7  # from the old distribution to that of the elite
_SURE = 0.97  # no group of faces is more certain than that
_NEAR = 0.85  # how certain those of a first choice are
_NARROW = 0.05  # least standard deviation of the speed's logarithm

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


class _Distribution(NamedTuple):
    signs: Floats
    """Of all faces, shape (4n,)."""
    group: Ints
    """To which group each face belongs, shape (4n,); the faces of a group flip as one."""
    kept: Floats
    """Probability that a group has these signs, shape (groups,)."""
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
    groups: Sequence[Ints] | None = None,
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
    groups
        Faces whose signs stay as they are in ``first`` relative to each other, every face in one
        group; None makes each face one.

    Returns
    -------
    list of Standing
        The choices that came nearest, by `race`.
    """
    current = _around(first, faces, speeds, groups)
    best: list[Standing] = []
    while True:
        choices = _drawn(current, speeds, rng)
        scores = trials.scores(choices, RELEASES)
        order = np.argsort(-scores.mean(axis=1), kind="stable")
        elite: list[Choice] = [choices[k] for k in order[:ELITE].tolist()]
        current = _moved(current, elite)
        best = race([*(standing.choice for standing in best[:2]), *elite], trials, goal)
        if best[0].rate >= goal or trials.count + POPULATION * RELEASES > budget:
            return best


def _around(
    first: Choice | None, faces: int, speeds: Sequence[float], groups: Sequence[Ints] | None
) -> _Distribution:
    signs = np.ones(faces) if first is None else _signs(first)
    group = np.arange(faces)
    for k, members in enumerate(groups or []):
        group[members] = k
    kept = np.full(int(group.max()) + 1, 0.5 if first is None else _NEAR)
    if not speeds:
        return _Distribution(signs, group, kept, 0.0, 0.0)
    low, high = np.log(min(speeds)), np.log(max(speeds))
    speed = None if first is None else first.speed
    mean = 0.5 * (low + high) if speed is None else np.log(speed)
    deviation = float(max(high - low, _NARROW)) / 2.0
    return _Distribution(signs, group, kept, float(mean), deviation)


def _drawn(
    current: _Distribution, speeds: Sequence[float], rng: np.random.Generator
) -> list[Choice]:
    flips = np.where(rng.random((POPULATION, current.kept.size)) < current.kept, 1.0, -1.0)
    signs = current.signs * flips[:, current.group]
    logarithms = rng.normal(current.mean, current.deviation, POPULATION)
    chosen: list[float | None] = [None] * POPULATION
    if speeds:
        chosen = np.clip(np.exp(logarithms), min(speeds), max(speeds)).tolist()
    return [Choice(sequence_of_signs(row), speed) for row, speed in zip(signs, chosen, strict=True)]


def _moved(current: _Distribution, elite: Sequence[Choice]) -> _Distribution:
    leads = np.unique(current.group, return_index=True)[1]
    # To flip all poles changes nothing: `sequence_of_signs` makes the first face N, as it is here.
    alike = np.array([_signs(choice)[leads] == current.signs[leads] for choice in elite])
    kept = (1.0 - _STEP) * current.kept + _STEP * alike.mean(axis=0)
    moved = current._replace(kept=np.clip(kept, 1.0 - _SURE, _SURE))
    speeds = [choice.speed for choice in elite if choice.speed is not None]
    if not speeds:
        return moved
    logarithms = np.log(speeds)
    mean = (1.0 - _STEP) * current.mean + _STEP * float(logarithms.mean())
    deviation = (1.0 - _STEP) * current.deviation + _STEP * float(logarithms.std())
    return moved._replace(mean=mean, deviation=max(deviation, _NARROW))


def _signs(choice: Choice) -> Floats:
    """Return the signs of all faces, shape (4n,)."""
    return np.array([1.0 if pole == "N" else -1.0 for faces in choice.sequence for pole in faces])
