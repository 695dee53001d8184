"""Design by energy over all sequences of a short chain: proven optima, or proof of none."""

from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import cast

import numpy as np
from numpy.typing import NDArray

from magfold_env import scene as scenes
from magfold_env.designer.evidence import Rivals
from magfold_env.engine.state import Array
from magfold_env.minimiser import EverySequence, energies, every_sequence, sequence_of, states
from magfold_env.minimiser.lattice import Ints, Lattice, all_words, from_words
from magfold_env.shapes import folded_words, overlaps, parse_word

Flags = NDArray[np.bool_]

LONGEST = every_sequence.LONGEST_OF_ALL
"""Largest number of components for the exhaustive search."""

TOLERANCE = 1e-9
"""Relative difference below which two gaps count as equal, such as those of symmetric sequences."""

_BLOCK = 1 << 18  # number of sequences per batch


@dataclass(frozen=True)
class GapDesign:
    """A sequence designed for a target word."""

    sequence: tuple[str, ...]
    """The components, component 1 first; the alphabetically first sequence of equal gap."""
    gap: float
    """Energy of the best competitor above the target's [J]."""
    energy: float
    """Energy of the target [J]."""
    competitor: str
    """The word of second lowest energy; ties go to the first in the order S, L, R."""


def gap_designs(scene: scenes.Scene, targets: Iterable[str]) -> dict[str, GapDesign | None]:
    """Find the sequence of largest energy gap for each target, over all sequences.

    The gap of a sequence is the energy of the best other word without overlap minus the target's.

    Parameters
    ----------
    scene
        The scene sets the casing, the magnets and the number of components. Its sequence is
        ignored: every face of a design is N or S with the strength that the scene sets.
    targets
        Words of the scene's length without overlap.

    Returns
    -------
    dict
        A design for each target, in the order given; None where no sequence has the target as
        its only ground state.

    Raises
    ------
    ValueError
        If the scene has an external field, the chain has fewer than 2 or more than 6 components,
        or a target is not such a word.
    """
    energies.refuse_field(scene)
    wanted = list(dict.fromkeys(targets))
    if not 2 <= scene.n <= LONGEST:
        raise ValueError(
            f"sequence: {scene.n} component(s) are not allowed; the exhaustive gap search takes "
            f"2 to {LONGEST}"
        )
    for target in wanted:
        if overlaps(parse_word(target, scene.n)):
            raise ValueError(f"targets: {target!r} is not allowed; its components overlap")
    lattice, _, every = _compared(scene)
    found: dict[str, GapDesign | None] = {}
    for target in wanted:
        row = every.words.index(target)
        number = _first_of_largest(np.where(every.word == row, every.gap, 0.0), every.tie)
        if number is None:
            found[target] = None
            continue
        sequence = sequence_of(number, scene.n)
        energy = energies.word_energies(scene.replace(sequence=sequence), lattice)
        others = np.delete(np.arange(len(lattice)), row)
        lowest = energy[others].min()
        competitor = others[np.argmax(energy[others] <= lowest + energies.tie(scene))]
        gap, own = float(lowest - energy[row]), float(energy[row])
        found[target] = GapDesign(sequence, gap, own, lattice.word(int(competitor)))
    return found


def _first_of_largest(scores: Array, tie: float) -> int | None:
    """Return the number of the first sequence of largest score, None if no score exceeds a tie.

    Scores that differ by rounding count as equal, so that rounding does not decide the result.
    """
    largest = float(scores.max())
    if largest <= tie:
        return None
    return int(np.argmax(scores >= largest * (1.0 - TOLERANCE)))


class Exhaustive:
    """Every sequence of a scene's length, compared by the energies of one target and all rivals.

    The scene has at most six components; its sequence is ignored. The target does not overlap.
    """

    def __init__(self, scene: scenes.Scene, target: str) -> None:
        self._scene, self._target = scene, target
        magnets = cast("Hashable", scene.magnets)  # as all frozen models are
        lattice, forms, every = _compared_by_magnets(magnets, scene.casing.side, scene.n)
        row = every.words.index(target)
        self.calls = len(lattice) * every.gap.size
        """Number of energies compared."""
        self._lattice, self.tie = lattice, every.tie
        own = every_sequence.every_energy(forms[row])
        self.gaps: Array = np.where(every.word == row, every.gap, every.energy - own)
        """Energy of the best rival above the target [J], for every sequence."""

    def only_stable(self) -> Flags:
        """Return which sequences have the target as their only stable word."""
        if "S" in self._target:
            return np.zeros(self.gaps.size, dtype=np.bool_)
        contacts = {
            word: states.touching_faces(from_words([word])) for word in folded_words(self._scene.n)
        }
        own = contacts.pop(self._target)
        found = np.empty(self.gaps.size, dtype=np.bool_)
        for begin in range(0, found.size, _BLOCK):
            numbers = np.arange(begin, min(begin + _BLOCK, found.size))
            faces = _bits(numbers, 4 * self._scene.n)
            block = _all_opposite(faces, own)
            for pairs in contacts.values():
                block &= ~_all_opposite(faces, pairs)
            found[begin : begin + numbers.size] = block
        return found

    def tolerances(self) -> Array:
        """Return the tolerance of the worst rival, −inf where the target is no ground state.

        If a rival scores below the best sequence so far, its value replaces that of the worst
        rival, because the sequence cannot be the best.
        """
        found = np.full(self.gaps.size, -np.inf)
        numbers = np.flatnonzero(self.gaps > self.tie)
        if not numbers.size:
            return found
        rivals = Rivals(self._scene, self._target, self._lattice.words)
        likely = numbers[np.argmax(self.gaps[numbers])]
        chosen = _signs(np.array([likely]), 4 * self._scene.n)[0]
        best = float(rivals.tolerances(chosen).min())
        worst = np.full(numbers.size, np.inf)
        signs = _signs(numbers, 4 * self._scene.n)
        # The closest rivals of the likely best sequence come first, because they rule out most
        # sequences.
        for form in rivals.excess[np.argsort(rivals.tolerances(chosen))]:
            kept = worst >= best
            fields = signs[kept] @ form
            energies = np.einsum("ka,ka->k", signs[kept], fields)
            tolerance = energies / np.maximum(2.0 * np.linalg.norm(fields, axis=1), 1e-300)
            worst[kept] = np.minimum(worst[kept], tolerance)
        found[numbers] = worst
        return found

    def best(self, scores: Array, where: Flags | None = None) -> int | None:
        """Return the number of the best sequence, the first of equal ones; None if there is none.

        Sequences whose scores are not positive, up to rounding, do not qualify. ``where`` selects
        the sequences to choose from.
        """
        scores = scores if where is None else np.where(where, scores, -np.inf)
        return _first_of_largest(scores, self.tie)

    def spread_out(self, scores: Array, count: int, apart: int) -> list[int]:
        """Return the numbers of good sequences, best first, that differ in enough faces."""
        chosen: list[int] = []
        wanted = np.flatnonzero(scores > self.tie)
        for number in wanted[np.argsort(-scores[wanted], kind="stable")].tolist():
            if all((number ^ other).bit_count() >= apart for other in chosen):
                chosen.append(number)
            if len(chosen) == count:
                break
        return chosen


def _compared(scene: scenes.Scene) -> tuple[Lattice, Array, EverySequence]:
    """Return all words of a scene's length, their forms, and which is lowest for each sequence."""
    lattice = all_words(scene.n)
    forms = energies.quadratic_forms(scene, lattice)
    tie = energies.tie(scene)
    return lattice, forms, every_sequence.best_words(forms, lattice.words, tie)


@lru_cache(maxsize=1)  # some hundred megabytes and seconds for all targets of one kind of chain
def _compared_by_magnets(
    magnets: scenes.Magnets | None, side: float, n: int
) -> tuple[Lattice, Array, EverySequence]:
    casing = scenes.Casing(side=side)
    return _compared(scenes.Scene(sequence=("NNNN",) * n, casing=casing, magnets=magnets))


def _bits(numbers: Ints, faces: int) -> NDArray[np.uint8]:
    shifts = np.arange(faces - 1, -1, -1)
    return ((numbers[None, :] >> shifts[:, None]) & 1).astype(np.uint8)


def _signs(numbers: Ints, faces: int) -> Array:
    return 1.0 - 2.0 * _bits(numbers, faces).T.astype(np.float64)


def _all_opposite(faces: NDArray[np.uint8], pairs: tuple[tuple[int, int], ...]) -> Flags:
    found = np.ones(faces.shape[1], dtype=np.bool_)
    for a, b in pairs:
        found &= faces[a] != faces[b]
    return found
