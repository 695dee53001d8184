"""The kernel of simulated annealing over the signs of all faces."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.state import Array

Ints = NDArray[np.int64]


@allocating_kernel
def anneal(
    excess: Array, faces: Ints, first: Ints, proposals: Ints, chances: Array, temperatures: Array,
    tolerant: bool, signs: Array,
) -> float:  # fmt: skip
    """Leave the best signs that an annealing passes in ``signs`` (4n,) and return their score.

    The score is that of the worst rival, see `Rivals`: its energy above the target [J], or if
    ``tolerant`` its tolerance. ``excess`` (rivals, 4n, 4n) are the rivals' forms. Group g, faces
    ``faces[first[g]:first[g + 1]]``, flips as one. Step k flips group ``proposals[k]`` if that
    raises the score, or with Boltzmann's probability at ``temperatures[k]``, in the unit of the
    score, against ``chances[k]`` from 0 to 1.
    """
    rivals, size = excess.shape[0], signs.size
    fields, energies, trials = np.empty((rivals, size)), np.empty(rivals), np.empty(rivals)
    for w in range(rivals):
        energies[w] = 0.0
        for f in range(size):
            fields[w, f] = 0.0
            for g in range(size):
                fields[w, f] += excess[w, f, g] * signs[g]
            energies[w] += signs[f] * fields[w, f]
    none = faces[:0]
    score = score_of(excess, fields, energies, signs, none, tolerant)
    best, best_score = signs.copy(), score
    for k in range(proposals.size):
        group = faces[first[proposals[k]] : first[proposals[k] + 1]]
        for w in range(rivals):
            trials[w] = energies[w] + change_of(excess[w], fields[w], signs, group)
        trial = score_of(excess, fields, trials, signs, group, tolerant)
        if trial < score and chances[k] >= math.exp((trial - score) / temperatures[k]):
            continue
        score = trial
        for w in range(rivals):
            energies[w] = trials[w]
            for f in group:
                for g in range(size):
                    fields[w, g] -= 2.0 * excess[w, g, f] * signs[f]
        for f in group:
            signs[f] = -signs[f]
        if score > best_score:
            best_score = score
            best[:] = signs
    signs[:] = best
    return best_score


@allocating_kernel
def change_of(form: Array, field: Array, signs: Array, group: Ints) -> float:
    """Return by how much the energy sᵀ A s rises if a group of faces flips [J]."""
    change = 0.0
    for f in group:
        others = float(field[f])
        for g in group:
            others -= float(form[f, g]) * float(signs[g])
        change -= 4.0 * float(signs[f]) * others
    return change


@allocating_kernel
def score_of(
    excess: Array, fields: Array, energies: Array, signs: Array, group: Ints, tolerant: bool
) -> float:
    """Return the worst rival's score, ``energies`` being those after ``group`` has flipped."""
    worst = math.inf
    for w in range(energies.size):
        score = float(energies[w])
        if tolerant:
            total = 0.0
            for g in range(signs.size):
                field = fields[w, g]
                for f in group:
                    field -= 2.0 * excess[w, g, f] * signs[f]
                total += field * field
            score /= max(2.0 * math.sqrt(total), 1e-300)
        worst = min(worst, score)
    return worst
