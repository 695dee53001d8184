"""The possible target words of episodes and their difficulty.

The difficulty of a word is minus the logarithm of the share of random sequences that energy
minimisation, component by component, folds into it. For long chains this share is too small to
count, so it is a product over joints (multilevel splitting). At each joint, every chain in a
population of random chains gets a random next component. The factor is the share of chains that
take the right letter, and the next population is drawn from these chains.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chains.lattice import TURNS, LatticeFeed, lay_many
from magfold_env.envs.spaces.actions import SIGNS
from magfold_env.envs.tasks.checks import require
from magfold_env.scene import Scene
from magfold_env.scene.errors import Problem, nearest, refuse, unless_one_of, unless_positive
from magfold_env.shapes import folded_words, overlaps

LONGEST_LISTED = 16
"""Largest number of components for which all words are listed. These are 8,894 words; with two more
components there are three times as many."""


def resolve_targets(targets: Sequence[str] | None, n: int) -> tuple[str, ...]:
    """Return the target words of a chain of `n` components, by default all fully folded words."""
    if targets is None:
        if n > LONGEST_LISTED:
            raise ValueError(
                f"targets: None is not allowed with {n} components, which have too many words; "
                f"must be a list (up to {LONGEST_LISTED} components all words are taken)"
            )
        return tuple(folded_words(n))
    given: Any = targets
    right = isinstance(given, Sequence) and not isinstance(given, str) and bool(targets)
    require(right, "targets", targets, "must be a list of fold words")
    for word in targets:
        if not is_target(word, n):
            listed = folded_words(n) if n <= LONGEST_LISTED else [("LR" * n)[: n - 1]]
            allowed = (
                f"must be a fully folded word of {n} components without overlap, such as "
                f"{_listed(listed)}"
            )
            refuse([Problem("targets", word, allowed + nearest(str(word), listed))])
    return tuple(targets)


def is_target(word: object, n: int) -> bool:
    """Return whether `word` is a fully folded word of `n` components without overlap."""
    return (
        isinstance(word, str)
        and len(word) == n - 1
        and not set(word) - set("LR")
        and not overlaps(word)
    )


def pick_target(word: object, targets: Sequence[str]) -> str:
    """Return `word` if it is one of `targets`; otherwise raise an error."""
    if unless_one_of("", word, targets):
        allowed = f"must be one of {_listed(targets)}{nearest(str(word), targets)}"
        refuse([Problem("options['target']", word, allowed)])
    return str(word)


def _listed(words: Sequence[str], most: int = 8) -> str:
    """Return `words` as text; a long list is cut short."""
    more = "" if len(words) <= most else f", … ({len(words)} in all)"
    return ", ".join(words[:most]) + more


POPULATION = 4096
"""Number of chains in a population; difficulties for six components are accurate to about 0.1."""


def difficulties(scene: Scene, words: tuple[str, ...]) -> dict[str, float]:
    """Return the difficulty of each word; infinite if no chain takes the right letter at a joint.

    Components get magnets as they leave the tube; the scene's sequence has no effect.
    """
    lattice = LatticeFeed(scene)
    strength = lattice.packed.strengths
    order = slice(None) if lattice.turn == 1 else slice(None, None, -1)
    return {
        word: _difficulty(lattice, strength[order], [TURNS[x] for x in word[order]])
        for word in words
    }


def easiest(scene: Scene, words: tuple[str, ...], share: float) -> tuple[str, ...]:
    """Return the easiest `share` of `words`, at least one, in the order given."""
    refuse(unless_positive("difficulty", share, 1.0))
    count = math.ceil(share * len(words) - 1e-9)
    if count == len(words):
        return words
    hardness = difficulties(scene, words)
    chosen = set(sorted(words, key=hardness.__getitem__)[:count])
    return tuple(word for word in words if word in chosen)


def _difficulty(lattice: LatticeFeed, strength: NDArray[np.float64], turns: list[int]) -> float:
    """Return the difficulty of a word, given by its joints' quarter turns in the order of feed."""
    rng, rules = np.random.default_rng(0), lattice.packed
    poles = np.zeros((POPULATION, lattice.n, 4))
    poles[:, 0] = SIGNS[rng.integers(len(SIGNS), size=POPULATION)] * strength[0]
    taken = np.zeros(POPULATION, dtype=np.int64)
    found = 0.0
    for row, turn in enumerate(turns, start=1):
        poles[:, row] = SIGNS[rng.integers(len(SIGNS), size=POPULATION)] * strength[row]
        before = np.array(turns[: row - 1], dtype=np.int64)
        lay_many(row, before, rules.turn, rules.tie, rules.table, poles, taken)
        right = np.flatnonzero(taken == turn)
        if right.size == 0:
            return math.inf
        found -= math.log(right.size / POPULATION)
        poles = poles[rng.choice(right, size=POPULATION)]
    return found
