"""One run of an ensemble: a draw of its own, a fold, and what is kept of it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene
from magfold_env.shapes import parse_word
from magfold_env.simulation.simulate import simulate


class Run(NamedTuple):
    """What is kept of a fold."""

    number: int
    """From 0, in the ensemble."""
    word: str
    """Nearest fold word."""
    status: str
    """How it ended, see `FoldStatus`."""
    energy: float
    """Magnetic energy at the end [J]."""
    time: float
    """Simulated time [s]."""
    angles: tuple[float, ...]
    """Absolute headings at the end [rad], component 1 first."""

    def to_record(self) -> list[Any]:
        """Return the run as values that JSON can hold; numbers that broke down are None."""
        finite = [x if math.isfinite(x) else None for x in (self.energy, self.time, *self.angles)]
        return [self.number, self.word, self.status, *finite]

    @classmethod
    def from_record(cls, record: list[Any], n: int) -> Run:
        """Return the run of a chain of ``n`` components that `to_record` was made of.

        Raises
        ------
        ValueError
            If it was made of none.
        """
        number, word, status, *values = record
        energy, time, *angles = (math.nan if x is None else float(x) for x in values)
        if not isinstance(number, int) or number < 0 or len(angles) != n:
            raise ValueError(f"a run of {n} components is not {record!r}")
        return cls(number, parse_word(word), FoldStatus(status).value, energy, time, tuple(angles))


def generator(seed: int, index: int) -> np.random.Generator:
    """Return the generator that run `index` of an ensemble draws from.

    It is the generator of ``SeedSequence(seed).spawn(runs)[index]``: it depends neither on the
    number of runs nor on the order in which they are made.
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(index,)))


def run_one(scene: Scene, seed: int, index: int) -> Run:
    """Simulate run `index` of an ensemble."""
    fold = simulate(scene, generator(seed, index))
    angles = tuple(fold.angles.tolist())
    return Run(index, fold.word, fold.status.value, fold.energy, fold.time, angles)
