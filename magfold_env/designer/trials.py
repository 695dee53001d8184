"""The dear test of a choice: releases of the chain, each with draws of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from magfold_env.checkpoint import Checkpoint
from magfold_env.designer.choice import Choice
from magfold_env.ensembles import generator
from magfold_env.fold import Fold, FoldStatus
from magfold_env.parallel import Workers, finished
from magfold_env.scene import Scene
from magfold_env.shapes import similarity, word_to_angles
from magfold_env.simulation.simulate import simulate

PACE = 200
"""Steps a component in one simulated second, at a tolerance of 1e-3 rad, before a search gives a
release up. Chains that fold take a third of them at most; others may rattle up to the scene's cap,
which takes 200 times as long as a fold."""

Key = tuple[tuple[str, ...], float | None, int]


class Trials:
    """Releases choices, and keeps how each release ended.

    Release k of every choice draws from the same generator, so that choices are compared under
    equal conditions; what was asked before is not simulated again.

    Parameters
    ----------
    scene
        What is released, but for sequence and speed.
    target
        The word that is wanted.
    seed
        Of all draws.
    team
        Who simulates.
    kept
        Where releases are kept, and taken from; None keeps them in memory only.
    report
        Is told the number of releases so far.
    """

    def __init__(
        self,
        scene: Scene,
        target: str,
        seed: int,
        team: Workers,
        kept: Checkpoint | None = None,
        report: Callable[[int], object] | None = None,
    ) -> None:
        self._release = partial(_score, scene, target, seed)
        self._team, self._kept, self._report = team, kept, report
        self._known: dict[Key, float] = {}
        self._asked: set[Key] = set()
        self._known.update(kept.read(_release_of) if kept else [])

    @property
    def count(self) -> int:
        """How many releases were asked for, those kept from before included."""
        return len(self._asked)

    def scores(self, choices: Sequence[Choice], draws: int) -> npt.NDArray[np.float64]:
        """Return the scores of the first releases of choices, shape (choices, draws).

        A score is 1 for a success, else half the similarity of the fold to the target.
        """
        keys = [(each.sequence, each.speed, draw) for each in choices for draw in range(draws)]
        missing = [key for key in dict.fromkeys(keys) if key not in self._known]
        try:
            for place, score in finished(self._release, missing, self._team):
                sequence, speed, draw = missing[place]
                self._known[missing[place]] = score
                if self._kept is not None:
                    self._kept.add([" ".join(sequence), speed, draw, score])
                if self._report is not None:
                    self._report(len(self._known))
        finally:
            if self._kept is not None:
                self._kept.save()
        self._asked.update(keys)
        return np.array([self._known[key] for key in keys]).reshape(len(choices), draws)


def hurried(scene: Scene) -> Scene:
    """Return a scene in which chains that rattle are given up."""
    # Steps of the fifth order grow with the tolerance's fifth root.
    steps = round(PACE * scene.n * (1e-3 / scene.solver.tolerance) ** 0.2)
    most = min(max(steps, 1), scene.solver.max_steps_per_second)
    return scene.replace(solver={"max_steps_per_second": most})


def _release_of(record: list[Any]) -> tuple[Key, float]:
    """Return a release and its score as they were kept."""
    sequence, speed, draw, score = record
    return (tuple(sequence.split()), speed, int(draw)), float(score)


def _score(scene: Scene, target: str, seed: int, key: Key) -> float:
    sequence, speed, draw = key
    fold = simulate(Choice(sequence, speed).applied(scene), generator(seed, draw))
    return score_of(fold, target)


def score_of(fold: Fold, target: str) -> float:
    """Return 1 if a chain settled as the target, else half its similarity, 0 if numbers broke."""
    if fold.status is FoldStatus.FAILED:
        return 0.0
    if fold.status is FoldStatus.FOLDED and fold.word == target:
        return 1.0
    return 0.5 * similarity(fold.joint_angles, word_to_angles(target))
