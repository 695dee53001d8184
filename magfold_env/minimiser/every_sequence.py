"""The ground states of all sequences of poles of a short chain, and the order of sequences.

The energy of a word is sᵀ J s for the signs s of all faces. The faces are divided into leading and
trailing faces. For fixed leading signs, the energy is that among the leading faces, plus that among
the trailing faces, which a table stores, plus the fields on the trailing faces times their signs.
The sums for all trailing signs are built by doubling: each trailing face doubles their number, and
its sign is -1 in the new half. That takes one addition per sequence and limits rounding errors.

The number of a sequence has one bit per face, N = 0 and S = 1; component 1's front-left face is the
highest bit. The order of the numbers is the alphabetical order of the sequences.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.state import Array
from magfold_env.minimiser import energies
from magfold_env.minimiser.couplings import FACES
from magfold_env.minimiser.lattice import all_words
from magfold_env.scene import Scene, errors, unless_a_scene

LONGEST_OF_ALL = 6
"""Largest number of components for which every sequence is evaluated: half of 16^6 sequences,
because flipping all poles changes no energy."""

LONGEST_NUMBERED = 10_000
"""Largest number of components for which `sequence_of` returns sequences."""

WordIndices = NDArray[np.uint8]
"""Indices of words; 8 bits suffice for the 229 words of six components."""

_TRAILING = 10  # faces whose signs vary within a block, whose energies fit in the cache
_PARTS = 16  # number of parts of the work; Ctrl-C takes effect between two parts


@dataclass(frozen=True, eq=False)
class EverySequence:
    """The ground states of all sequences, by their number.

    Only sequences whose first face is N are listed, because flipping all poles changes no energy.
    """

    words: tuple[str, ...]
    """The words that were compared."""
    word: WordIndices
    """Index of the word of least energy, or of any word tied with it, shape (2^(4n-1),)."""
    energy: Array
    """Energy of that word [J], shape (2^(4n-1),)."""
    gap: Array
    """Energy gap to the next word [J], shape (2^(4n-1),); infinite if there is only one word."""
    tie: float
    """Largest gap that counts as a rounding error [J]."""

    def counts(self) -> dict[str, int]:
        """Return, for each word, the number of sequences whose only ground state is that word.

        A sequence and its flipped image count once.
        """
        counts = np.bincount(self.word[self.gap > self.tie], minlength=len(self.words))
        return dict(zip(self.words, counts.tolist(), strict=True))


def sequence_of(number: int, n: int) -> tuple[str, ...]:
    """Return the sequence of a number with one bit per face, first face highest, N = 0 and S = 1.

    The order of the numbers is the alphabetical order of the sequences.

    Raises
    ------
    ValueError
        If there is no such sequence of n components.
    """
    errors.refuse(errors.unless_whole("n", n, 1, LONGEST_NUMBERED))
    errors.refuse(errors.unless_whole("number", number, 0, (1 << (FACES * n)) - 1))
    letters = f"{number:0{FACES * n}b}".translate(str.maketrans("01", "NS"))
    return tuple(letters[k : k + FACES] for k in range(0, len(letters), FACES))


def every_ground_state(scene: Scene) -> EverySequence:
    """Return the ground state of every sequence of N and S; the scene's own sequence is ignored.

    Raises
    ------
    ValueError
        If the scene has an external field, or more than `LONGEST_OF_ALL` components.
    """
    errors.refuse(unless_a_scene(scene))
    if scene.n > LONGEST_OF_ALL:
        raise ValueError(
            f"sequence: {scene.n} components are not allowed; every sequence is evaluated for at "
            f"most {LONGEST_OF_ALL}"
        )
    lattice = all_words(scene.n)
    forms = energies.quadratic_forms(scene, lattice)
    return best_words(forms, lattice.words, energies.tie(scene))


def best_words(forms: Array, words: tuple[str, ...], tie: float) -> EverySequence:
    """Return the word of least energy for every sequence whose first face is N, by number.

    ``forms`` (words, 4n, 4n) contains the matrix of each word, see `quadratic_forms`. Gaps up to
    ``tie`` [J] count as rounding errors.
    """
    faces = forms.shape[1]
    size, trailing = 1 << (faces - 1), min(_TRAILING, faces - 1)
    word = np.empty(size, dtype=np.uint8)
    energy, gap = np.empty(size), np.empty(size)
    chunk = max(1 << trailing, size // _PARTS)
    for begin in range(0, size, chunk):
        part = slice(begin, begin + chunk)
        best_for_every_sequence(forms, trailing, begin, word[part], energy[part], gap[part])
    gap -= energy
    return EverySequence(words, word, energy, gap, tie)


@allocating_kernel
def best_for_every_sequence(
    forms: Array, trailing: int, first: int,
    word: WordIndices, least: Array, second: Array,
) -> None:  # fmt: skip
    """Fill in each sequence's lowest ``word``, its energy ``least``, and the ``second`` least [J].

    ``forms`` (words, faces, faces) contains J [J]. The sequences begin at the number ``first``, a
    multiple of 2^``trailing``. The three arrays have one entry per sequence.
    """
    words, size = forms.shape[0], 1 << trailing
    own = np.empty((words, size))
    for w in range(words):
        tabulate(forms[w], trailing, own[w])
    fields, energies = np.empty(trailing), np.empty(size)
    for begin in range(0, least.size, size):
        lowest, runner_up = least[begin : begin + size], second[begin : begin + size]
        which = word[begin : begin + size]
        lowest[:] = np.inf
        runner_up[:] = np.inf
        which[:] = 0
        for w in range(words):
            fill_block(forms[w], (first + begin) // size, trailing, own[w], fields, energies)
            keep_lowest(w, energies, which, lowest, runner_up)


@allocating_kernel
def keep_lowest(
    w: int, energies: Array, which: WordIndices, lowest: Array, runner_up: Array
) -> None:
    """Update the two lowest energies with those of word ``w``; the first of equal words stays."""
    for k in range(energies.size):
        energy, low = energies[k], lowest[k]
        higher = low if energy < low else energy
        runner_up[k] = higher if higher < runner_up[k] else runner_up[k]
        which[k] = w if energy < low else which[k]
        lowest[k] = energy if energy < low else low


@allocating_kernel
def fill_block(
    form: Array, block: int, trailing: int, own: Array, fields: Array, energies: Array
) -> None:
    """Fill in the energies (2^trailing,) [J] of sequences with ``block``'s bits as leading faces.

    ``own`` is the result of `tabulate`. The function overwrites ``fields`` (trailing,).
    """
    faces = form.shape[0]
    leading = faces - trailing
    fields[:] = 0.0
    energies[0] = 0.0
    for f in range(leading):
        sign = sign_of(block, leading - 1 - f)
        for g in range(leading):
            energies[0] += sign * sign_of(block, leading - 1 - g) * form[f, g]
        for g in range(trailing):
            # The factor is two because J is symmetric.
            fields[g] += 2.0 * sign * form[f, leading + g]
    for g in range(trailing):
        energies[0] += fields[g]
    for bit in range(trailing):
        change = 2.0 * fields[trailing - 1 - bit]
        half = 1 << bit
        for k in range(half):
            energies[half + k] = energies[k] - change
    for k in range(energies.size):
        energies[k] += own[k]


@allocating_kernel
def tabulate(form: Array, trailing: int, own: Array) -> None:
    """Fill in the energies among the trailing faces for all their signs, (2^trailing,) [J]."""
    leading = form.shape[0] - trailing
    for number in range(own.size):
        total = 0.0
        for f in range(trailing):
            sign = sign_of(number, trailing - 1 - f)
            for g in range(f):
                total += (
                    2.0 * sign * sign_of(number, trailing - 1 - g) * form[leading + f, leading + g]
                )
        own[number] = total


@allocating_kernel
def sign_of(number: int, bit: int) -> float:
    """Return the sign of a face from its bit: +1 for N (bit 0) and -1 for S (bit 1)."""
    return -1.0 if (number >> bit) & 1 else 1.0
