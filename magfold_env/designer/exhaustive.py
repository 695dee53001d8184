"""Design by energy over all sequences of a short chain, with proven results."""

from collections.abc import Hashable, Iterable
from functools import lru_cache
from typing import cast

import numpy as np
from numpy.typing import NDArray

from magfold_env import scene as scenes
from magfold_env.designer.evidence import Rivals
from magfold_env.engine.state import Array
from magfold_env.minimiser import (
    LONGEST_OF_ALL,
    EverySequence,
    energies,
    every_ground_state,
    sequence_of,
    states,
)
from magfold_env.minimiser.every_sequence import best_words
from magfold_env.minimiser.lattice import Ints, from_words
from magfold_env.shapes import folded_words, overlaps, parse_word

Flags = NDArray[np.bool_]

TOLERANCE = 1e-9
"""Relative difference below which gaps, such as those of symmetric sequences, count as equal."""

_BLOCK = 1 << 18  # number of sequences per batch


def gap_designs(scene: scenes.Scene, targets: Iterable[str]) -> dict[str, tuple[str, ...] | None]:
    """Return the sequence with the largest energy gap for each target, among all sequences.

    A sequence's gap is the lowest energy of any other word without overlap, minus the target's.

    Parameters
    ----------
    scene
        The scene sets the casing, the magnets and the number of components. Its sequence is
        ignored: every face of a design is N or S with the scene's strength.
    targets
        Words of the scene's length without overlap.

    Returns
    -------
    dict
        A sequence for each target, in the order given: the alphabetically first one of those with
        equal gaps, or None if no sequence has the target as its only ground state.

    Raises
    ------
    ValueError
        If the scene has an external field, the chain has fewer than 2 or more than 6 components,
        or a target is not a word as described above.
    """
    energies.refuse_field(scene)
    wanted = list(dict.fromkeys(targets))
    if not 2 <= scene.n <= LONGEST_OF_ALL:
        raise ValueError(
            f"sequence: {scene.n} component(s) are not allowed; the exhaustive gap search takes "
            f"2 to {LONGEST_OF_ALL}"
        )
    for target in wanted:
        if overlaps(parse_word(target, scene.n)):
            raise ValueError(f"targets: {target!r} is not allowed; its components overlap")
    every = every_ground_state(scene)
    found: dict[str, tuple[str, ...] | None] = {}
    for target in wanted:
        gaps = np.where(every.word == every.words.index(target), every.gap, 0.0)
        number = _first_of_largest(gaps, every.tie)
        found[target] = None if number is None else sequence_of(number, scene.n)
    return found


def _first_of_largest(scores: Array, tie: float) -> int | None:
    """Return the number of the first sequence of largest score; None if none exceeds ``tie``.

    Scores that differ by rounding count as equal, so that rounding does not decide the result.
    """
    largest = float(scores.max())
    if largest <= tie:
        return None
    return int(np.argmax(scores >= largest * (1.0 - TOLERANCE)))


class Exhaustive:
    """Every sequence of a scene's length, compared by the energies of a target and all its rivals.

    The scene has at most six components; its sequence is ignored. The target has no overlap.
    """

    def __init__(self, scene: scenes.Scene, target: str) -> None:
        self._scene, self._target = scene, target
        magnets = cast("Hashable", scene.magnets)  # as all frozen models are
        every = _every_ground_state(magnets, scene.casing.side, scene.n)
        row = every.words.index(target)
        self.calls = len(every.words) * every.gap.size
        """Number of energies that are compared."""
        self._words, self.tie = every.words, every.tie
        form = energies.quadratic_forms(scene, from_words([target]))
        own = best_words(form, (target,), every.tie).energy
        self.gaps: Array = np.where(every.word == row, every.gap, every.energy - own)
        """Energy of the lowest rival above the target [J], for every sequence."""

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
        """Return each sequence's least tolerance; −inf unless the target is its ground state.

        If some rival's tolerance is below that of the best sequence so far, it may be returned
        instead of the least one, because the sequence cannot be the best.
        """
        found = np.full(self.gaps.size, -np.inf)
        numbers = np.flatnonzero(self.gaps > self.tie)
        if not numbers.size:
            return found
        rivals = Rivals(self._scene, self._target, self._words)
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
        """Return the number of the best sequence, the first of equally good ones, or None.

        Sequences whose scores are not positive, up to rounding, do not qualify. ``where`` selects
        the sequences from which to choose.
        """
        scores = scores if where is None else np.where(where, scores, -np.inf)
        return _first_of_largest(scores, self.tie)

    def spread_out(self, scores: Array, count: int, apart: int) -> list[int]:
        """Return numbers of good sequences, best first, that differ in ``apart`` faces or more."""
        chosen: list[int] = []
        wanted = np.flatnonzero(scores > self.tie)
        for number in wanted[np.argsort(-scores[wanted], kind="stable")].tolist():
            if all((number ^ other).bit_count() >= apart for other in chosen):
                chosen.append(number)
            if len(chosen) == count:
                break
        return chosen


@lru_cache(maxsize=1)  # hundreds of MB and several seconds for all targets of a kind of chain
def _every_ground_state(magnets: scenes.Magnets | None, side: float, n: int) -> EverySequence:
    casing = scenes.Casing(side=side)
    return every_ground_state(scenes.Scene(sequence=("NNNN",) * n, casing=casing, magnets=magnets))


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
