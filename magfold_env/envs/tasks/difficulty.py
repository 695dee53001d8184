"""How hard a fold is to make, and the easiest share of a list of targets.

The difficulty of a word is how rare it is: minus the logarithm of the share of random sequences
that fold into it, component by component, by energy alone. Words of long chains are far too rare
to be counted, so the share is taken as a product, joint by joint (multilevel splitting): of a
population of random chains that are right so far, given a random next component, the share that
takes the wanted letter; those make the next population.
"""

import math

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chains.lattice import TURNS, LatticeFeed
from magfold_env.envs.spaces.actions import SIGNS
from magfold_env.envs.tasks.checks import share_of
from magfold_env.scene import Scene

POPULATION = 4096
"""Chains at a time; makes the difficulty of six components exact to about 0.1."""


def difficulties(scene: Scene, words: tuple[str, ...]) -> dict[str, float]:
    """Return the difficulty of each word; infinite where no chain of a population gets there.

    Parameters
    ----------
    scene : Scene
        A tube scene; its sequence does not count. Every component gets its magnets as it leaves.
    words : tuple of str
        Fold words of the scene's chain.
    """
    lattice = LatticeFeed(scene)
    strength = lattice.packed.strengths
    order = slice(None) if lattice.turn == 1 else slice(None, None, -1)
    return {
        word: _difficulty(lattice, strength[order], [TURNS[x] for x in word[order]])
        for word in words
    }


def easiest(scene: Scene, words: tuple[str, ...], share: float) -> tuple[str, ...]:
    """Return the easiest `share` of `words`, at least one, in the order given.

    Raises
    ------
    ValueError
        If `share` is not above 0 and at most 1.
    """
    count = math.ceil(share_of("difficulty", share) * len(words) - 1e-9)
    if count == len(words):
        return words
    hardness = difficulties(scene, words)
    chosen = set(sorted(words, key=hardness.__getitem__)[:count])
    return tuple(word for word in words if word in chosen)


def _difficulty(lattice: LatticeFeed, strength: NDArray[np.float64], turns: list[int]) -> float:
    """Return minus the logarithm of the share of chains that make `turns`, in order of feed."""
    rng = np.random.default_rng(0)
    poles = np.zeros((POPULATION, lattice.n, 4))
    poles[:, 0] = SIGNS[rng.integers(len(SIGNS), size=POPULATION)] * strength[0]
    taken = np.zeros(POPULATION, dtype=np.int64)
    found = 0.0
    for row, turn in enumerate(turns, start=1):
        poles[:, row] = SIGNS[rng.integers(len(SIGNS), size=POPULATION)] * strength[row]
        before = np.array(turns[: row - 1], dtype=np.int64)
        lattice.lay_many(row, before, poles, taken)
        right = np.flatnonzero(taken == turn)
        if right.size == 0:
            return math.inf
        found -= math.log(right.size / POPULATION)
        poles = poles[rng.choice(right, size=POPULATION)]
    return found
