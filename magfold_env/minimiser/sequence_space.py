"""Every sequence of poles of a short chain: its number, its ground state, its energies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.minimiser.every_sequence import (
    WordIndices,
    best_for_every_sequence,
    word_for_every_sequence,
)
from magfold_env.minimiser.face_pairs import FACES

LONGEST_OF_ALL = 6
"""Most components for which every sequence is evaluated: 16^6, halved by the global sign flip."""

_TRAILING = 10  # faces whose signs vary within a block: its energies stay in the cache
_REPORTS = 16  # of progress


@dataclass(frozen=True, eq=False)
class EverySequence:
    """The ground states of all sequences, by their number.

    Only sequences whose first face is N are listed: to flip all poles changes no energy.

    Attributes
    ----------
    words : tuple of str
        The words that were compared.
    word : (2^(4n-1),) int array
        Index of the word of least energy; of equal ones any.
    energy : (2^(4n-1),) array
        Its energy [J].
    gap : (2^(4n-1),) array
        How far the next word lies above it [J]; infinite if there is none.
    tie : float
        Gaps up to this are none, but for rounding [J].
    """

    words: tuple[str, ...]
    word: WordIndices
    energy: Array
    gap: Array
    tie: float

    def counts(self) -> dict[str, int]:
        """Count the sequences that have each word as their only ground state.

        A sequence and its flipped image count once.
        """
        counts = np.bincount(self.word[self.gap > self.tie], minlength=len(self.words))
        return dict(zip(self.words, counts.tolist(), strict=True))


def sequence_of(number: int, n: int) -> tuple[str, ...]:
    """Return the sequence of a number: one bit a face, the first face highest, N = 0 and S = 1.

    The order of the numbers is the alphabetical order of the sequences.

    Raises
    ------
    ValueError
        If there is no such sequence of n components.
    """
    if not 0 <= number < 1 << (FACES * n):
        most = (1 << (FACES * n)) - 1
        raise ValueError(f"number: {number!r} is not allowed; must be from 0 to {most}")
    letters = f"{number:0{FACES * n}b}".translate(str.maketrans("01", "NS"))
    return tuple(letters[k : k + FACES] for k in range(0, len(letters), FACES))


def energies_of_every_sequence(form: Array) -> Array:
    """Return a word's energy with every sequence whose first face is N [J], by number.

    Parameters
    ----------
    form : (4n, 4n) array
        See `quadratic_forms`.

    Raises
    ------
    ValueError
        If there are too many sequences.
    """
    out = np.empty(_checked_size(form.shape[0]))
    word_for_every_sequence(form, _trailing(form.shape[0]), out)
    return out


def best_words(
    forms: Array,
    words: tuple[str, ...],
    tie: float,
    progress: Callable[[float], object] | None = None,
) -> EverySequence:
    """Find the ground state of every sequence.

    Parameters
    ----------
    forms : (words, 4n, 4n) array
        See `quadratic_forms`.
    words
        Their names.
    tie
        Gaps up to this are rounding [J].
    progress
        Called with the share of the work that is done, from 0 to 1.

    Raises
    ------
    ValueError
        If there are too many sequences.
    """
    faces = forms.shape[1]
    size, trailing = _checked_size(faces), _trailing(faces)
    word = np.empty(size, dtype=np.uint8)
    energy, gap = np.empty(size), np.empty(size)
    chunk = max(1 << trailing, size // _REPORTS)
    for begin in range(0, size, chunk):
        part = slice(begin, begin + chunk)
        best_for_every_sequence(forms, trailing, begin, word[part], energy[part], gap[part])
        if progress is not None:
            progress((begin + chunk) / size)
    gap -= energy
    return EverySequence(words, word, energy, gap, tie)


def _trailing(faces: int) -> int:
    return min(_TRAILING, faces - 1)


def _checked_size(faces: int) -> int:
    if faces > FACES * LONGEST_OF_ALL:
        raise ValueError(
            f"sequence: {faces // FACES} components are not allowed; every sequence is evaluated "
            f"for at most {LONGEST_OF_ALL}"
        )
    return 1 << (faces - 1)
