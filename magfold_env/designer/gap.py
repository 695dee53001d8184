"""Exact design by energy: the sequence whose target lies deepest below its best competitor."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from magfold_env.minimiser.energies import (
    TIE,
    energy_unit,
    quadratic_forms,
    refuse_field,
    word_energies,
)
from magfold_env.minimiser.every_sequence import (
    LONGEST_OF_ALL,
    EverySequence,
    best_words,
    sequence_of,
)
from magfold_env.minimiser.lattice import Lattice, all_words
from magfold_env.scene import Scene
from magfold_env.shapes import overlaps, parse_word

LONGEST = LONGEST_OF_ALL
"""Most components of the exhaustive search."""

TOLERANCE = 1e-9
"""Relative difference below which two gaps are equal, as symmetric sequences' are."""


@dataclass(frozen=True)
class GapDesign:
    """A sequence designed for a target word.

    Attributes
    ----------
    sequence : tuple of str
        The components, component 1 first; of equal gaps the alphabetically first.
    gap : float
        Energy of the best competitor above the target's [J].
    energy : float
        Energy of the target [J].
    competitor : str
        The word of second lowest energy; ties go to the first in the order S, L, R.
    """

    sequence: tuple[str, ...]
    gap: float
    energy: float
    competitor: str


def gap_designs(
    scene: Scene, targets: Iterable[str], progress: Callable[[float], object] | None = None
) -> dict[str, GapDesign | None]:
    """Find the sequence of largest energy gap for each target, over all sequences.

    The gap of a sequence is the energy of the best other word without overlap, less the target's.

    Parameters
    ----------
    scene
        Its casing, its magnets and its number of components count, its sequence does not: every
        face of a design is N or S, as strong as the scene has it.
    targets
        Words of the scene's length without overlap.
    progress
        Called with the share of the work that is done, from 0 to 1.

    Returns
    -------
    dict
        A design for each target, in the order given; None where no sequence has the target as
        its only ground state.

    Raises
    ------
    ValueError
        If the scene has an external field, the chain has fewer than 2 or more than 6 components,
        or a target is no such word.
    """
    refuse_field(scene)
    wanted = list(dict.fromkeys(targets))
    if not 2 <= scene.n <= LONGEST:
        raise ValueError(
            f"sequence: {scene.n} component(s) are not allowed; the exhaustive gap search takes "
            f"2 to {LONGEST}"
        )
    for target in wanted:
        if overlaps(parse_word(target, scene.n)):
            raise ValueError(f"targets: {target!r} is not allowed; its components overlap")
    lattice = all_words(scene.n)
    words = tuple(lattice.word(row) for row in range(len(lattice)))
    forms = quadratic_forms(scene, lattice)
    every = best_words(forms, words, TIE * energy_unit(scene), progress)
    found: dict[str, GapDesign | None] = {}
    for target in wanted:
        row = words.index(target)
        number = _first_of_largest_gap(every, row)
        found[target] = None if number is None else _describe(scene, lattice, row, number)
    return found


def _first_of_largest_gap(every: EverySequence, row: int) -> int | None:
    """Return the first sequence's number, None if the word is no sequence's only ground state.

    Gaps that differ by rounding are equal, so that it does not decide which sequence is first.
    """
    gap = np.where(every.word == row, every.gap, 0.0)
    largest = float(gap.max())
    if largest <= every.tie:
        return None
    return int(np.argmax(gap >= largest * (1.0 - TOLERANCE)))


def _describe(scene: Scene, lattice: Lattice, row: int, number: int) -> GapDesign:
    """Evaluate the sequence of a number afresh."""
    sequence = sequence_of(number, scene.n)
    energies = word_energies(scene.replace(sequence=sequence), lattice)
    others = np.delete(np.arange(len(lattice)), row)
    tied = energies[others] <= energies[others].min() + TIE * energy_unit(scene)
    competitor = int(others[np.argmax(tied)])
    return GapDesign(
        sequence=sequence,
        gap=float(energies[others].min() - energies[row]),
        energy=float(energies[row]),
        competitor=lattice.word(competitor),
    )
