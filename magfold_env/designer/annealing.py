"""Design by energy for chains of any length: annealing against the rivals that matter.

A chain has far too many words to compare a sequence with all of them, and few come near the
target. Annealing therefore compares with some, the words one letter off at first; the exact search
for ground states then names the words that the sequence it found has really to fear, and annealing
goes on with them, until it names none that is new.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from magfold_env.designer.anneal import anneal
from magfold_env.designer.holding import Ints, held_signs
from magfold_env.designer.rivals import Rivals, one_letter_off
from magfold_env.engine.state import Array
from magfold_env.minimiser.ground_states import ground_state
from magfold_env.scene import Scene

STEPS = 60_000
"""Flips that are tried between two exact searches."""

ROUNDS = 40
"""Most exact searches of one annealing."""

RIVALS = 8
"""Lowest states that an exact search adds to the rivals."""

_HOT, _COLD = 1.0, 0.01  # of the spread of the scores of random sequences
_SAMPLES = 64


class Annealed(NamedTuple):
    """A sequence that an annealing found."""

    sequence: tuple[str, ...]
    score: float
    """Of its worst rival: the energy above the target [J], exact, or the least tolerance known."""


def anneal_sequence(
    scene: Scene,
    target: str,
    rng: np.random.Generator,
    calls: Counter[str],
    *,
    tolerant: bool = False,
    holding: bool = False,
    good_enough: float = np.inf,
) -> Annealed:
    """Search for the sequence whose worst rival scores highest.

    Parameters
    ----------
    scene
        Its casing, its magnets and its number of components count.
    target
        A word of its length without overlap.
    rng
        Draws the start and the flips.
    calls
        Flips tried are added to its ``energies``, exact searches to its ``ground states``.
    tolerant
        Score rivals by their tolerance instead of their energy above the target [J].
    holding
        Search only among sequences under which the target holds, see `held_signs`: no other
        word is then stable.
    good_enough
        End with the first score above this.
    """
    signs, groups = _start(scene, target, rng, holding)
    faces, first = np.concatenate(groups), np.cumsum([0, *(len(group) for group in groups)])
    rivals = Rivals(scene, target, one_letter_off(target))
    score_all = rivals.tolerances if tolerant else rivals.energies
    spread = _typical_score(score_all, rng, 4 * scene.n)
    temperatures = np.geomspace(_HOT * spread, _COLD * spread, STEPS)
    best: Annealed | None = None
    for _ in range(ROUNDS):
        proposals, chances = rng.integers(len(groups), size=STEPS), rng.random(STEPS)
        anneal(rivals.excess, faces, first, proposals, chances, temperatures, tolerant, signs)
        calls["energies"] += STEPS
        sequence = sequence_of_signs(signs)
        new = rivals.add(_lowest(scene.replace(sequence=sequence), calls))
        score = float(score_all(signs).min())
        if best is None or score > best.score:
            best = Annealed(sequence, score)
        if not new or score > good_enough:
            break
    assert best is not None
    return best


def sequence_of_signs(signs: Array) -> tuple[str, ...]:
    """Return the sequence of the signs of its faces, shape (4n,): N positive.

    To flip all changes nothing; the first face is N.
    """
    letters = "".join("N" if sign == signs[0] else "S" for sign in signs)
    return tuple(letters[k : k + 4] for k in range(0, len(letters), 4))


def _start(
    scene: Scene, target: str, rng: np.random.Generator, holding: bool
) -> tuple[Array, list[Ints]]:
    if not holding:
        faces = 4 * scene.n
        return rng.choice([-1.0, 1.0], faces), [np.array([face]) for face in range(faces)]
    return held_signs(target, rng)


def _typical_score(
    score_all: Callable[[Array], Array], rng: np.random.Generator, faces: int
) -> float:
    signs = rng.choice([-1.0, 1.0], (_SAMPLES, faces))
    return float(np.std([score_all(each).min() for each in signs]))


def _lowest(designed: Scene, calls: Counter[str]) -> list[str]:
    """Return the words of the states that a sequence really has lowest."""
    calls["ground states"] += 1
    return [state.word for state in ground_state(designed, top=RIVALS).states]
