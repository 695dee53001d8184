"""Kernels of the exhaustive gap search: the energies of all words for all sequences.

The energy of word w is sᵀ J_w s. Within a block the leading faces are fixed; the trailing ones
run through a Gray code, in which one face flips at a time, and a flip of face f changes the
energies by -4 s_f (J_w s)_f. The last component's four faces do not couple among themselves, so
the sixteen sequences that differ in them alone share one update of the fields J_w s.

Sequences are numbered with one bit a face, component 1's front-left highest, N = 0 and S = 1: the
order of the numbers is the alphabetical order of the sequences.
"""

from __future__ import annotations

import numpy as np

from magfold_env.engine.jit import allocating_kernel
from magfold_env.engine.state import Array, IntArray

LAST = 4  # faces of the last component


@allocating_kernel
def sweep_block(
    form: Array, block: int, free: int, slot: IntArray, tolerance: float, settled: bool,
    gap: Array, code: IntArray,
) -> None:  # fmt: skip
    """Visit the sequences whose leading faces are the bits of ``block``.

    Unless ``settled``, ``gap`` (targets,) is raised to the largest gap met [J]. Else it is final,
    and ``code`` (targets,) is lowered to the least number of a sequence whose gap is within the
    relative ``tolerance`` of it.

    ``form`` (faces, faces, words) holds J [J], ``free`` is the number of trailing faces, ``slot``
    (words,) each word's place among the targets, or -1.
    """
    faces, words = form.shape[0], form.shape[2]
    sign, fields, energy = np.empty(faces), np.empty((faces, words)), np.empty(words)
    number = block << free
    for f in range(faces):
        sign[f] = -1.0 if (number >> (faces - 1 - f)) & 1 else 1.0
    _evaluate(form, sign, fields, energy)
    for step in range(1 << (free - LAST)):
        if step > 0:
            bit = LAST + _lowest_bit(step)
            number ^= 1 << bit
            face = faces - 1 - bit
            _change_energies(energy, fields[face], sign, face)
            _change_fields(form[face], fields, 2.0 * float(sign[face]))
        for inner in range(1, (1 << LAST) + 1):
            word, found = _gap(energy, slot)
            if word >= 0:
                target = slot[word]
                if not settled:
                    gap[target] = max(gap[target], found)
                elif found >= gap[target] * (1.0 - tolerance):
                    code[target] = min(code[target], number)
            # The sixteenth flip closes the cycle: the fields, left alone, are right again.
            bit = min(_lowest_bit(inner), LAST - 1)
            number ^= 1 << bit
            _change_energies(energy, fields[faces - 1 - bit], sign, faces - 1 - bit)


@allocating_kernel
def _evaluate(form: Array, sign: Array, fields: Array, energy: Array) -> None:
    """Fill the fields J s (faces, words) and the energies (words,) from scratch."""
    energy[:] = 0.0
    fields[:] = 0.0
    for f in range(sign.size):
        for g in range(sign.size):
            for w in range(energy.size):
                fields[f, w] += sign[g] * form[f, g, w]
        for w in range(energy.size):
            energy[w] += sign[f] * fields[f, w]


@allocating_kernel
def _change_energies(energy: Array, field: Array, sign: Array, face: int) -> None:
    """Flip one face and bring the energies up to date."""
    change = -4.0 * sign[face]
    for w in range(energy.size):
        energy[w] += change * field[w]
    sign[face] = -sign[face]


@allocating_kernel
def _change_fields(row: Array, fields: Array, change: float) -> None:
    """Bring the fields up to date after a sign has changed by ``change``."""
    for f in range(fields.shape[0]):
        for w in range(fields.shape[1]):
            fields[f, w] += change * row[f, w]


@allocating_kernel
def _lowest_bit(number: int) -> int:
    """Return the place of the lowest 1: the bit that a Gray code flips at this step."""
    place = 0
    while not (number >> place) & 1:
        place += 1
    return place


@allocating_kernel
def _gap(energy: Array, slot: IntArray) -> tuple[int, float]:
    """Return the word of least energy and how far the next one lies above it [J].

    The word is -1 if it is no target.
    """
    least = _least(energy)
    best = 0
    while energy[best] != least:
        best += 1
    if slot[best] < 0:
        return -1, 0.0
    energy[best] = np.inf
    second = _least(energy)
    energy[best] = least
    return best, second - least


@allocating_kernel
def _least(energy: Array) -> float:
    """Return the least energy, in four lanes: each comparison waits for the one before it."""
    a, b, c, d = np.inf, np.inf, np.inf, np.inf
    whole = energy.size - energy.size % 4
    for w in range(0, whole, 4):
        a = min(a, energy[w])
        b = min(b, energy[w + 1])
        c = min(c, energy[w + 2])
        d = min(d, energy[w + 3])
    for w in range(whole, energy.size):
        a = min(a, energy[w])
    return min(a, b, c, d)
