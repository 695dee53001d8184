"""Every sequence of poles of a short chain: its number, its ground state, its energies.

The energy of a word is sᵀ J s. The faces are divided into leading and trailing ones. For fixed
leading signs, the energy is that among the leading faces, plus that among the trailing ones, which
a table stores, plus a sum of fields on the trailing faces. Doubling builds all these sums: with one
more face, every sum so far appears twice, the second time with that face's sign changed. That costs
one addition per sequence and avoids the successive flips of a Gray code, in which errors add up.

Sequences are numbered with one bit per face, component 1's front-left highest, N = 0 and S = 1: the
order of the numbers is the alphabetical order of the sequences.
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
"""Largest number of components for which every sequence is evaluated: 16^6 sequences, halved by the
global sign flip."""

LONGEST_NUMBERED = 10_000
"""Largest number of components of a sequence requested by its number."""

WordIndices = NDArray[np.uint8]
"""Enough for the 229 words of six components."""

_TRAILING = 10  # faces whose signs vary within a block: its energies stay in the cache
_PARTS = 16  # between which Ctrl-C is noticed


@dataclass(frozen=True, eq=False)
class EverySequence:
    """The ground states of all sequences, by their number.

    Only sequences whose first face is N are listed, because flipping all poles changes no energy.
    """

    words: tuple[str, ...]
    """The words that were compared."""
    word: WordIndices
    """Index of the word of least energy, or of any of several equal ones, shape (2^(4n-1),)."""
    energy: Array
    """Its energy [J], shape (2^(4n-1),)."""
    gap: Array
    """Energy gap to the next word [J]; infinite if there is none, shape (2^(4n-1),)."""
    tie: float
    """Gaps up to this are rounding errors [J]."""

    def counts(self) -> dict[str, int]:
        """Count the sequences that have each word as their only ground state.

        A sequence and its flipped image count once.
        """
        counts = np.bincount(self.word[self.gap > self.tie], minlength=len(self.words))
        return dict(zip(self.words, counts.tolist(), strict=True))


def sequence_of(number: int, n: int) -> tuple[str, ...]:
    """Return the sequence of a number: one bit per face, the first face highest, N = 0 and S = 1.

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
    """Find the ground state of every sequence of N and S; the scene's own is ignored.

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
    """Return which of some words is lowest for every sequence whose first face is N, by number.

    ``forms`` (words, 4n, 4n) are those of the ``words``, see `quadratic_forms`. Gaps up to ``tie``
    are rounding [J].
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
    """Fill the word of least energy, its energy and the second least [J] for some sequences.

    ``forms`` (words, faces, faces) contains J [J]. The sequences begin at number ``first``, a
    multiple of 2^``trailing``; their number is the length of ``word``, ``least`` and ``second``.
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
    """Compare a word's energies with the lowest two so far; the first of equal words stays."""
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
    """Fill the energies (2^trailing,) of the sequences whose leading faces are bits of ``block``.

    ``own`` is what `tabulate` fills, ``fields`` (trailing,) is overwritten.
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
    """Fill the energies (2^trailing,) among the trailing faces for all their signs [J]."""
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
    """Return the sign of a face: +1 for N, a bit that is 0, and -1 for S."""
    return -1.0 if (number >> bit) & 1 else 1.0
