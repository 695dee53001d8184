"""Design by energy over every sequence of a short chain: proven optima, or the proof of none."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magfold_env.designer.gap import TOLERANCE
from magfold_env.designer.rivals import Rivals
from magfold_env.engine.state import Array
from magfold_env.minimiser.energies import TIE, energy_unit, quadratic_forms
from magfold_env.minimiser.every_sequence import (
    EverySequence,
    best_words,
    energies_of_every_sequence,
    sequence_of,
)
from magfold_env.minimiser.lattice import all_words, from_words
from magfold_env.minimiser.states import touching_faces
from magfold_env.scene import Casing, Magnets, Scene
from magfold_env.shapes import folded_words

Flags = NDArray[np.bool_]
Numbers = NDArray[np.int64]

_BLOCK = 1 << 18  # sequences at a time


class Exhaustive:
    """Every sequence of a scene's length, judged by the energies of one target and all rivals.

    Parameters
    ----------
    scene
        Its casing, its magnets and its number of components count; at most six components.
    target
        A word of its length without overlap.
    """

    def __init__(self, scene: Scene, target: str) -> None:
        self._scene, self._target = scene, target
        words, forms, every = _compared(_fields(scene.magnets), scene.casing.side, scene.n)
        row = words.index(target)
        self.calls = len(words) * every.gap.size
        """Energies that were compared."""
        self._tie = every.tie
        self._gap = _gaps(every, row, forms[row])

    def gaps(self) -> Array:
        """Return the energy of the best rival above the target [J], for every sequence."""
        return self._gap

    def only_stable(self) -> Flags:
        """Return of which sequences the target is the only stable word."""
        if "S" in self._target:
            return np.zeros(self._gap.size, dtype=np.bool_)
        contacts = {
            word: touching_faces(from_words([word])) for word in folded_words(self._scene.n)
        }
        own = contacts.pop(self._target)
        found = np.empty(self._gap.size, dtype=np.bool_)
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

        Where a rival is below the best found so far, which is enough to know that a sequence is
        not the best, it stands for the worst.
        """
        found = np.full(self._gap.size, -np.inf)
        numbers = np.flatnonzero(self._gap > self._tie)
        if not numbers.size:
            return found
        lattice = all_words(self._scene.n)
        rivals = Rivals(self._scene, self._target, (lattice.word(k) for k in range(len(lattice))))
        likely = numbers[np.argmax(self._gap[numbers])]
        chosen = _signs(np.array([likely]), 4 * self._scene.n)[0]
        best = float(rivals.tolerances(chosen).min())
        worst = np.full(numbers.size, np.inf)
        signs = _signs(numbers, 4 * self._scene.n)
        # Those that the likely one has most to fear come first: they rule out most.
        for form in rivals.excess[np.argsort(rivals.tolerances(chosen))]:
            kept = worst >= best
            fields = signs[kept] @ form
            energies = np.einsum("ka,ka->k", signs[kept], fields)
            tolerance = energies / np.maximum(2.0 * np.linalg.norm(fields, axis=1), 1e-300)
            worst[kept] = np.minimum(worst[kept], tolerance)
        found[numbers] = worst
        return found

    def best(self, scores: Array, where: Flags | None = None) -> int | None:
        """Return the number of the best sequence, the first of equal ones; None if none will do.

        Parameters
        ----------
        scores
            An entry a sequence; those that are not positive, up to rounding, will not do.
        where
            Which sequences to choose from.
        """
        scores = scores if where is None else np.where(where, scores, -np.inf)
        largest = float(scores.max())
        if largest <= self._tie:
            return None
        return int(np.argmax(scores >= largest * (1.0 - TOLERANCE)))

    def spread_out(self, scores: Array, count: int, apart: int) -> list[int]:
        """Return the numbers of good sequences, best first, any two so many faces apart."""
        chosen: list[int] = []
        wanted = np.flatnonzero(scores > self._tie)
        for number in wanted[np.argsort(-scores[wanted], kind="stable")].tolist():
            if all((number ^ other).bit_count() >= apart for other in chosen):
                chosen.append(number)
            if len(chosen) == count:
                break
        return chosen

    def sequence(self, number: int) -> tuple[str, ...]:
        """Return the sequence of a number."""
        return sequence_of(number, self._scene.n)


@lru_cache(maxsize=1)  # some hundred megabytes, and seconds, for all targets of one kind of chain
def _compared(
    fields: tuple[tuple[str, Any], ...] | None, side: float, n: int
) -> tuple[tuple[str, ...], Array, EverySequence]:
    magnets = None if fields is None else Magnets(**dict(fields))
    scene = Scene(sequence=("NNNN",) * n, casing=Casing(side=side), magnets=magnets)
    lattice = all_words(n)
    words = tuple(lattice.word(row) for row in range(len(lattice)))
    forms = quadratic_forms(scene, lattice)
    return words, forms, best_words(forms, words, TIE * energy_unit(scene))


def _fields(magnets: Magnets | None) -> tuple[tuple[str, Any], ...] | None:
    return None if magnets is None else tuple(dict(magnets).items())


def _gaps(every: EverySequence, row: int, form: Array) -> Array:
    """Return how far the best other word lies above one word for every sequence [J]."""
    own = energies_of_every_sequence(form)
    return np.where(every.word == row, every.gap, every.energy - own)


def _bits(numbers: Numbers, faces: int) -> NDArray[np.uint8]:
    shifts = np.arange(faces - 1, -1, -1)
    return ((numbers[None, :] >> shifts[:, None]) & 1).astype(np.uint8)


def _signs(numbers: Numbers, faces: int) -> Array:
    return 1.0 - 2.0 * _bits(numbers, faces).T.astype(np.float64)


def _all_opposite(faces: NDArray[np.uint8], pairs: tuple[tuple[int, int], ...]) -> Flags:
    found = np.ones(faces.shape[1], dtype=np.bool_)
    for a, b in pairs:
        found &= faces[a] != faces[b]
    return found
