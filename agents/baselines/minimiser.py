"""The energy minimiser's designs, each fed at the speed that suits it best."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np

from agents.baselines.calls import Calls
from agents.baselines.search import speeds_to_try
from agents.evaluation.open_loop import OpenLoop
from magfold_env.designer import design, gap_designs
from magfold_env.designer.exhaustive import LONGEST
from magfold_env.designer.task import Choice
from magfold_env.designer.trials import race
from magfold_env.envs.chains.lattice import Floats, Ints, LatticeFeed
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.spaces.actions import PATTERNS, SIGNS
from magfold_env.minimiser.energies import strengths
from magfold_env.scene import Scene
from magfold_env.shapes import folded_words, overlaps

Prediction = Literal["free", "forward", "backward"]
"""How energies predict a fold: all shapes compared, or joint by joint from one end."""

WIDTH = 64
"""Chains that are kept from one component to the next."""

_TURNS = {"S": 0, "L": 1, "R": -1}


class MinimiserDesign:
    """The sequence of which energies are surest; its speed alone is found by trying.

    Parameters
    ----------
    prediction : {"free", "forward", "backward"}
        ``free``: the sequence whose target lies deepest below the next word. ``forward``,
        ``backward``: the one that folds into the target joint by joint, fed from this end,
        with the largest least distance between the wanted letter and the next.
    """

    def __init__(self, prediction: Prediction) -> None:
        self._prediction: Prediction = prediction

    def first(self, env: FoldEnv[Any], target: str, rng: np.random.Generator) -> OpenLoop:
        """Return the design at a usual speed."""
        return OpenLoop.at_one_speed(self._sequence(env, target), speeds_to_try(env)[0])

    def run(self, calls: Calls, rng: np.random.Generator) -> None:
        """Race the speeds."""
        sequence = self._sequence(calls.env, calls.target)
        race([Choice(sequence, speed) for speed in speeds_to_try(calls.env)], calls)

    def _sequence(self, env: FoldEnv[Any], target: str) -> tuple[str, ...]:
        # Frozen models are hashable.
        return energy_design(env.scene, target, self._prediction)  # pyright: ignore[reportArgumentType]


@lru_cache(maxsize=512)
def energy_design(scene: Scene, target: str, prediction: Prediction) -> tuple[str, ...]:
    """Return the sequence of which energies are surest that it folds into the target."""
    if prediction == "free":
        return _deepest(scene, target)
    return _surest(scene.replace(feed={"direction": prediction}), target)


def _deepest(scene: Scene, target: str) -> tuple[str, ...]:
    """Return the sequence of largest gap, proved to be for chains that are short enough."""
    every = _all_deepest(scene) if scene.n <= LONGEST else {}  # pyright: ignore[reportArgumentType]
    found = every.get(target)
    if found is not None:
        return found
    # No sequence has this ground state, or there are too many: what comes nearest, by annealing.
    mode = scene.feed.direction
    return design(target, scene, mode, "gap", search="annealing", runs=0, workers=1).sequence


@lru_cache(maxsize=4)
def _all_deepest(scene: Scene) -> dict[str, tuple[str, ...]]:
    found = gap_designs(scene, folded_words(scene.n))
    return {word: each.sequence for word, each in found.items() if each is not None}


class _Partial(NamedTuple):
    """Components that have left the tube and folded as wanted."""

    margin: float
    """The least distance of a wanted letter to the next [J]."""
    patterns: tuple[int, ...]


def _surest(scene: Scene, target: str) -> tuple[str, ...]:
    """Return the sequence that a component-by-component feed decides most clearly.

    A component has its magnets when it leaves the tube. The chain is built in the order of
    feed; the `WIDTH` clearest are kept at each length.
    """
    lattice = LatticeFeed(scene)
    order = slice(None) if lattice.turn == 1 else slice(None, None, -1)
    letters, strength = target[order], strengths(scene)[order]
    kept = [_Partial(np.inf, (pattern,)) for pattern in range(len(PATTERNS) // 2)]
    for joint, letter in enumerate(letters):
        before = letters[:joint]
        wanted, *others = [
            np.array([_TURNS[each] for each in before + option])
            for option in (letter, *(set(_TURNS) - {letter}))
            if not overlaps(before + option)
        ]
        grown: list[_Partial] = []
        for partial in kept:
            for pattern in range(len(PATTERNS)):
                patterns = (*partial.patterns, pattern)
                poles = SIGNS[list(patterns)] * strength[: joint + 2]
                margin = _margin(lattice, poles, wanted, others)
                grown.append(_Partial(min(partial.margin, margin), patterns))
        kept = sorted(grown, key=lambda each: (-each.margin, each.patterns))[:WIDTH]
    return tuple(PATTERNS[pattern] for pattern in kept[0].patterns)[order]


def _margin(lattice: LatticeFeed, poles: Floats, wanted: Ints, others: Sequence[Ints]) -> float:
    """Return how far the next lowest of other shapes lies above the wanted one [J], less if below.

    Shapes are quarter turns of the joints so far, and `poles` those of the components so far.
    """
    energies = [lattice.energy_of(turns, poles) for turns in others]
    return min(energies, default=np.inf) - lattice.energy_of(wanted, poles)
