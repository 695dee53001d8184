"""Exact design by energy: the sequence whose target lies deepest below its best competitor."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from magfold_env.design.sweep import LAST, sweep_block
from magfold_env.energy.landscape import (
    TIE,
    energy_unit,
    quadratic_forms,
    refuse_field,
    word_energies,
)
from magfold_env.energy.lattice import Lattice, all_words
from magfold_env.scene import Scene
from magfold_env.shapes import overlaps, parse_word

LONGEST = 6
"""Most components of the exhaustive search: 16^6 sequences, halved by the global sign flip."""

TOLERANCE = 1e-9
"""Relative difference below which two gaps are equal, as symmetric sequences' are."""

_LEADING = 8  # most faces that a block fixes: enough blocks to report progress by


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
    scene: Scene, targets: Iterable[str], progress: Callable[[float], None] | None = None
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
    words = [lattice.word(row) for row in range(len(lattice))]
    gap, code = _sweep(scene, lattice, [words.index(target) for target in wanted], progress)
    floor = TIE * energy_unit(scene)
    return {
        target: _describe(scene, lattice, words.index(target), int(code[k]))
        if gap[k] > floor
        else None
        for k, target in enumerate(wanted)
    }


def _sweep(
    scene: Scene, lattice: Lattice, rows: list[int], progress: Callable[[float], None] | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest gap [J] and the first sequence's number for each target's row.

    Two passes, so that which gaps are equal does not depend on the order of the search.
    """
    faces = 4 * scene.n
    leading = min(_LEADING, faces - LAST)
    blocks = 1 << (leading - 1)  # the first face is N: flipping all signs changes no energy
    form = np.ascontiguousarray(quadratic_forms(scene, lattice).transpose(1, 2, 0))
    slot = np.full(len(lattice), -1, dtype=np.int64)
    slot[rows] = np.arange(len(rows))
    gap = np.zeros(len(rows))
    code = np.full(len(rows), np.iinfo(np.int64).max)
    for settled in (False, True):
        for block in range(blocks):
            sweep_block(form, block, faces - leading, slot, TOLERANCE, settled, gap, code)
            if progress is not None:
                progress((settled * blocks + block + 1) / (2 * blocks))
    return gap, code


def _describe(scene: Scene, lattice: Lattice, row: int, code: int) -> GapDesign:
    """Evaluate the sequence of a number afresh."""
    letters = f"{code:0{4 * scene.n}b}".translate(str.maketrans("01", "NS"))
    sequence = tuple(letters[k : k + 4] for k in range(0, len(letters), 4))
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
