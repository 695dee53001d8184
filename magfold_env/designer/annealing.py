"""Design by energy for chains of any length: annealing against the relevant rivals.

A long chain has too many words to compare the target with all of them, and few are close in energy.
Annealing therefore compares it with only some words, at first those that differ in one letter. The
exact search for ground states then finds the real rivals for the resulting sequence, and annealing
continues with these until the search finds no new rivals.

Annealing can be restricted to sequences whose only stable word is the target. Where joint k of the
target is L, the faces that touch when it is L must have opposite poles, and the faces that touch
when it is R must have like poles; every other fully folded word then has a conflict. The faces at
the target's other contacts must have opposite poles as well. Each condition is an equation between
the signs of two faces. Together they divide the faces into groups in which one sign determines all
others.
"""

import math
from collections import Counter
from typing import NamedTuple

import numpy as np

from magfold_env.designer.evidence import Rivals, one_letter_off
from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.state import Array
from magfold_env.minimiser import ground_state, states
from magfold_env.minimiser.lattice import Ints, from_words
from magfold_env.scene import Scene

STEPS = 60_000
"""Number of flips tried between two exact searches."""

ROUNDS = 40
"""Largest number of exact searches in one annealing."""

RIVALS = 8
"""Number of lowest states that an exact search adds to the rivals."""

_HOT, _COLD = 1.0, 0.01  # relative to the spread of random sequences' scores
_SAMPLES = 64

_FRONT_LEFT, _BACK_LEFT, _BACK_RIGHT, _FRONT_RIGHT = range(4)
_EQUAL, _OPPOSITE = 1, -1


class Annealed(NamedTuple):
    """A sequence found by annealing."""

    sequence: tuple[str, ...]
    score: float
    """Score of the worst rival: its exact energy above the target [J], or its least known
    tolerance."""


def anneal_sequence(
    scene: Scene,
    target: str,
    rng: np.random.Generator,
    calls: Counter[str],
    *,
    tolerant: bool = False,
    stable: bool = False,
    good_enough: float = np.inf,
) -> Annealed:
    """Search for the sequence with the highest score, or any with more than ``good_enough``.

    The score is that of the worst rival of the target: its energy above the target [J], or its
    tolerance if ``tolerant``. The target has no overlap. The scene's sequence is ignored. If
    ``stable``, the search includes only sequences whose only stable word is the target; see
    `stable_groups`. ``calls`` counts flips as ``energies``, exact searches as ``ground states``.
    """
    if stable:
        signs, groups = stable_signs(target, rng)
    else:
        signs = rng.choice([-1.0, 1.0], 4 * scene.n)
        groups = [np.array([face]) for face in range(signs.size)]
    faces, first = np.concatenate(groups), np.cumsum([0, *(len(group) for group in groups)])
    rivals = Rivals(scene, target, one_letter_off(target))
    score_all = rivals.tolerances if tolerant else rivals.energies
    samples = rng.choice([-1.0, 1.0], (_SAMPLES, 4 * scene.n))
    spread = float(np.std([score_all(each).min() for each in samples]))
    temperatures = np.geomspace(_HOT * spread, _COLD * spread, STEPS)
    best: Annealed | None = None
    for _ in range(ROUNDS):
        proposals, chances = rng.integers(len(groups), size=STEPS), rng.random(STEPS)
        anneal(rivals.excess, faces, first, proposals, chances, temperatures, tolerant, signs)
        calls["energies"] += STEPS
        sequence = sequence_of_signs(signs)
        calls["ground states"] += 1
        lowest = ground_state(scene.replace(sequence=sequence), top=RIVALS).states
        new = rivals.add(state.word for state in lowest)
        score = float(score_all(signs).min())
        if best is None or score > best.score:
            best = Annealed(sequence, score)
        if not new or score > good_enough:
            break
    assert best is not None
    return best


def sequence_of_signs(signs: Array) -> tuple[str, ...]:
    """Return the sequence for the signs of its faces, shape (4n,); N is positive.

    Flipping all signs changes no energy; the result always begins with N.
    """
    letters = "".join("N" if sign == signs[0] else "S" for sign in signs)
    return tuple(letters[k : k + 4] for k in range(0, len(letters), 4))


def stable_groups(target: str) -> tuple[Array, list[Ints]]:
    """Return signs (4n,) that make a fully folded target the only stable word, and groups of faces.

    Each face is in one group; the property survives if any groups are flipped. A ValueError is
    raised if equations contradict each other, which happens for no word of up to 16 components.
    """
    equations = [(a, b, _OPPOSITE) for a, b in states.touching_faces(from_words([target]))]
    for k, letter in enumerate(target):
        # The faces that would touch with the joint's other letter repel each other.
        front, back = {"L": (_FRONT_RIGHT, _BACK_RIGHT), "R": (_FRONT_LEFT, _BACK_LEFT)}[letter]
        equations.append((4 * k + front, 4 * (k + 1) + back, _EQUAL))
    faces = 4 * (len(target) + 1)
    linked: list[list[tuple[int, int]]] = [[] for _ in range(faces)]
    for a, b, relation in equations:
        linked[a].append((b, relation))
        linked[b].append((a, relation))
    signs = np.zeros(faces)
    groups: list[Ints] = []
    for start in range(faces):
        if signs[start] == 0.0:
            signs[start] = 1.0
            groups.append(_spread(start, linked, signs))
    if any(signs[a] * signs[b] != relation for a, b, relation in equations):
        raise ValueError(f"target: {target!r} is not allowed; its contacts contradict each other")
    return signs, groups


def stable_signs(target: str, rng: np.random.Generator) -> tuple[Array, list[Ints]]:
    """Return signs drawn uniformly from all that `stable_groups` allows, and the groups."""
    signs, groups = stable_groups(target)
    for group in groups:
        signs[group] *= rng.choice([-1.0, 1.0])
    return signs, groups


def _spread(start: int, linked: list[list[tuple[int, int]]], signs: Array) -> Ints:
    """Fill in the signs that follow from the sign of face ``start``, and return their faces."""
    group = [start]
    for face in group:
        for other, relation in linked[face]:
            if signs[other] == 0.0:
                signs[other] = relation * signs[face]
                group.append(other)
    return np.array(sorted(group), dtype=np.int64)


@allocating_kernel
def anneal(
    excess: Array, faces: Ints, first: Ints, proposals: Ints, chances: Array, temperatures: Array,
    tolerant: bool, signs: Array,
) -> float:  # fmt: skip
    """Improve ``signs`` (4n,) by simulated annealing, and return the score of the best found.

    The score is the worst rival's energy above the target [J] or, if ``tolerant``, its tolerance;
    see `Rivals`. ``excess`` (rivals, 4n, 4n) are the rivals' forms. The faces of group g,
    ``faces[first[g]:first[g + 1]]``, flip together. Step k flips group ``proposals[k]`` if that
    raises the score, or if Boltzmann's probability at ``temperatures[k]`` (in units of the score)
    exceeds ``chances[k]``, which is from 0 to 1.
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
    """Return the increase [J] of the energy sᵀ A s if a group of faces flips; A is ``form``."""
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
    """Return the worst rival's score, given the ``energies`` after ``group`` has flipped."""
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
