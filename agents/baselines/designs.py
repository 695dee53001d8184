"""Searches that begin with energies: the minimiser's designs, and robust open-loop design."""

from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np

from agents.baselines.calls import USUAL_SPEED, Calls, speeds_to_try
from agents.evaluation.policies import OpenLoop
from magfold_env.designer import SPEEDS, Choice, annealing, design, gap_designs, trials
from magfold_env.designer.exhaustive import LONGEST
from magfold_env.designer.search import candidates
from magfold_env.designer.task import Task, task_for
from magfold_env.envs.chains.lattice import Floats, Ints, LatticeFeed
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.spaces.actions import PATTERNS, SIGNS
from magfold_env.minimiser import strengths
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
        trials.race([Choice(sequence, speed) for speed in speeds_to_try(calls.env)], calls)

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


class RobustSearch:
    """The design room's search (`magfold_env.designer`) on perturbed runs of the environment.

    Sequences that are good by energy, those of which the target is the only stable word where
    chains are long, are raced on releases at one speed after another until one does; if none will,
    the cross-entropy method goes on from the best.

    Parameters
    ----------
    goal : float
        Share of successes of 40 calls that is enough.
    """

    def __init__(self, goal: float) -> None:
        self._goal = goal

    def first(self, env: FoldEnv[Any], target: str, rng: np.random.Generator) -> OpenLoop:
        """Return the best sequence by energy at a usual speed."""
        return OpenLoop.at_one_speed(_proposed(_task(env, target, rng))[0], USUAL_SPEED)

    def run(self, calls: Calls, rng: np.random.Generator) -> None:
        """Race proposals at more and more speeds, then refine the best."""
        task = _task(calls.env, calls.target, rng)
        sequences = _proposed(task)
        standings: list[trials.Standing] = []
        for count in range(1, len(SPEEDS) + 1):
            choices = [Choice(each, speed) for speed in SPEEDS[:count] for each in sequences]
            standings = trials.race(choices, calls)
            if standings[0].rate >= self._goal:
                return
        groups = annealing.stable_groups(calls.target)[1] if task.search == "annealing" else None
        trials.cross_entropy(
            calls, 4 * task.scene.n, SPEEDS, rng, calls.budget,
            goal=self._goal, first=standings[0].choice, groups=groups,
        )  # fmt: skip


def _task(env: FoldEnv[Any], target: str, rng: np.random.Generator) -> Task:
    """Return the search by energy; it knows no budget, since it calls no physics."""
    return task_for(
        target, env.scene, env.scene.feed.direction, "probability",
        search=None, seed=int(rng.integers(2**31)), speeds=None, budget=1, goal=1.0, runs=0,
    )  # fmt: skip


@lru_cache(maxsize=64)
def _proposed(task: Task) -> list[tuple[str, ...]]:
    """Return sequences that are good by energy; kept, since one budget after another asks."""
    return candidates(task, Counter(), lambda done: None)
