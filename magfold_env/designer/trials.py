"""Searches among choices by expensive releases of the chain, each with its own draws.

`successive_halving` tries many choices a few times and the best ones more often. `cross_entropy`
uses only results of releases, not energies. It draws choices from a distribution that is
independent for each face (or group of faces that flip together) and for the logarithm of the speed,
and moves the distribution towards the best choices (Rubinstein and Kroese, *The Cross-Entropy
Method*, 2004).
"""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np

from magfold_env.checkpoint import Checkpoint
from magfold_env.designer.annealing import sequence_of_signs
from magfold_env.designer.task import Choice
from magfold_env.engine.state import Array, IntArray
from magfold_env.ensembles.releases import generator
from magfold_env.fold import Fold, FoldStatus
from magfold_env.parallel import Workers, finished
from magfold_env.scene import Scene
from magfold_env.scene.scene import signs
from magfold_env.shapes import similarity, word_to_angles
from magfold_env.simulation.simulate import simulate

PACE = 200
"""Steps per component and simulated second, at a tolerance of 1e-3 rad, after which a search
abandons a release. Chains that fold take at most a third of these steps; others may rattle up to
the scene's limit, which takes 200 times as long as a fold."""

RUNGS: tuple[tuple[int, int | None], ...] = ((1, None), (4, 12), (12, 4))
"""Numbers of releases per choice, each with the number of choices that get it; None means all."""

FINAL = 40
"""Number of releases per finalist of the last rung; finalists are tried until one succeeds."""

POPULATION = 60
ELITE = 10
RELEASES = 4
"""Number of releases per choice in a generation."""

_STEP = 0.7  # share of the step from the old distribution to the elite's
_SURE = 0.97  # largest certainty of a group of faces
_NEAR = 0.85  # initial certainty of the first choice
_NARROW = 0.05  # smallest standard deviation of the speed's logarithm

Key = tuple[tuple[str, ...], float | None, int]


class Oracle(Protocol):
    """Source of the scores of choices: `Trials` of the dynamics, or a substitute."""

    @property
    def count(self) -> int:
        """Number of requested releases."""
        ...

    def scores(self, choices: Sequence[Choice], draws: int) -> Array:
        """Return scores, at most 1, of each choice's first ``draws`` releases, (choices, draws)."""
        ...


class Evaluation(NamedTuple):
    """Results of a choice's releases."""

    choice: Choice
    mean: float
    """Mean score of the releases."""
    successes: int
    releases: int

    @property
    def rate(self) -> float:
        """Share of successes."""
        return self.successes / self.releases


def successive_halving(
    choices: Sequence[Choice], trials: Oracle, enough: float = 1.0
) -> list[Evaluation]:
    """Try choices in more and more releases, keep only the best, and return them `ranked`.

    Of equally good choices, the first are preferred. ``enough`` is the share of successes that ends
    the search; finalists that can no longer reach it are dropped.
    """
    field = list(dict.fromkeys(choices))
    known: dict[Choice, Evaluation] = {}
    for releases, places in RUNGS:
        tried = ranked(_tried(field[:places], trials, releases))
        field = [evaluation.choice for evaluation in tried]
        known |= {evaluation.choice: evaluation for evaluation in tried}
    for choice in field:
        failures = known[choice].releases - known[choice].successes
        if (FINAL - failures) / FINAL >= enough:
            (known[choice],) = _tried([choice], trials, FINAL)
            if known[choice].rate >= enough:
                break
    return ranked(known.values())


def ranked(evaluations: Iterable[Evaluation]) -> list[Evaluation]:
    """Sort by number of releases, then by successes, then by mean, all in descending order."""
    return sorted(evaluations, key=lambda each: (-each.releases, -each.successes, -each.mean))


def _tried(choices: Sequence[Choice], trials: Oracle, releases: int) -> list[Evaluation]:
    scores = trials.scores(choices, releases)
    return [
        Evaluation(choice, float(row.mean()), int(np.sum(row == 1.0)), releases)
        for choice, row in zip(choices, scores, strict=True)
    ]


class _Distribution(NamedTuple):
    signs: Array
    """Signs of all faces, shape (4n,)."""
    group: IntArray
    """Group of each face, shape (4n,); the faces of a group flip together."""
    kept: Array
    """Probability that each group has these signs, shape (groups,)."""
    mean: float
    """Mean of the speed's logarithm."""
    deviation: float


def cross_entropy(
    trials: Oracle,
    faces: int,
    speeds: Sequence[float],
    rng: np.random.Generator,
    budget: int,
    goal: float = 1.0,
    first: Choice | None = None,
    groups: Sequence[IntArray] | None = None,
) -> list[Evaluation]:
    """Search for the choice with which the chain folds into the target most often.

    The search begins around ``first`` or, without it, with all choices equally likely. Speeds stay
    between the slowest and the fastest of ``speeds`` [m/s], which is empty without a tube. Relative
    signs within each of the ``groups`` of faces stay as in ``first``; None makes each face a group.
    Generations after the first must stay within the ``budget`` of releases, in which earlier
    releases count too. A share of successes of ``goal`` ends the search. Returns evaluations of
    the best choices, ranked by `successive_halving`.
    """
    current = _around(first, faces, speeds, groups)
    best: list[Evaluation] = []
    while True:
        choices = _drawn(current, speeds, rng)
        scores = trials.scores(choices, RELEASES)
        order = np.argsort(-scores.mean(axis=1), kind="stable")
        elite: list[Choice] = [choices[k] for k in order[:ELITE].tolist()]
        current = _moved(current, elite)
        best = successive_halving(
            [*(evaluation.choice for evaluation in best[:2]), *elite], trials, goal
        )
        if best[0].rate >= goal or trials.count + POPULATION * RELEASES > budget:
            return best


def _around(
    first: Choice | None, faces: int, speeds: Sequence[float], groups: Sequence[IntArray] | None
) -> _Distribution:
    start = np.ones(faces) if first is None else signs(first.sequence).ravel()
    group = np.arange(faces)
    for k, members in enumerate(groups or []):
        group[members] = k
    kept = np.full(int(group.max()) + 1, 0.5 if first is None else _NEAR)
    if not speeds:
        return _Distribution(start, group, kept, 0.0, 0.0)
    low, high = np.log(min(speeds)), np.log(max(speeds))
    speed = None if first is None else first.speed
    mean = 0.5 * (low + high) if speed is None else np.log(speed)
    deviation = float(max(high - low, _NARROW)) / 2.0
    return _Distribution(start, group, kept, float(mean), deviation)


def _drawn(
    current: _Distribution, speeds: Sequence[float], rng: np.random.Generator
) -> list[Choice]:
    flips = np.where(rng.random((POPULATION, current.kept.size)) < current.kept, 1.0, -1.0)
    drawn = current.signs * flips[:, current.group]
    logarithms = rng.normal(current.mean, current.deviation, POPULATION)
    chosen: list[float | None] = [None] * POPULATION
    if speeds:
        chosen = np.clip(np.exp(logarithms), min(speeds), max(speeds)).tolist()
    return [Choice(sequence_of_signs(row), speed) for row, speed in zip(drawn, chosen, strict=True)]


def _moved(current: _Distribution, elite: Sequence[Choice]) -> _Distribution:
    leads = np.unique(current.group, return_index=True)[1]
    # Flipping all poles changes nothing: `sequence_of_signs` makes the first face N, as here.
    drawn = np.array([signs(choice.sequence).ravel() for choice in elite])
    alike = drawn[:, leads] == current.signs[leads]
    kept = (1.0 - _STEP) * current.kept + _STEP * alike.mean(axis=0)
    moved = current._replace(kept=np.clip(kept, 1.0 - _SURE, _SURE))
    speeds = [choice.speed for choice in elite if choice.speed is not None]
    if not speeds:
        return moved
    logarithms = np.log(speeds)
    mean = (1.0 - _STEP) * current.mean + _STEP * float(logarithms.mean())
    deviation = (1.0 - _STEP) * current.deviation + _STEP * float(logarithms.std())
    return moved._replace(mean=mean, deviation=max(deviation, _NARROW))


class Trials:
    """Releases chains for choices and stores the result of each release.

    Release k of every choice draws from the same generator, so that choices are compared under
    equal conditions. Each release is simulated only once. A checkpoint stores releases; ``report``
    is called with the number of releases so far.
    """

    def __init__(
        self,
        scene: Scene,
        target: str,
        seed: int,
        workers: Workers,
        kept: Checkpoint,
        report: Callable[[int], object] | None = None,
    ) -> None:
        self._release = partial(_score, scene, target, seed)
        self._workers, self._kept, self._report = workers, kept, report
        self._known: dict[Key, float] = dict(kept.load(_release_of))
        self._asked: set[Key] = set()

    @property
    def count(self) -> int:
        """Number of requested releases, including stored ones."""
        return len(self._asked)

    def scores(self, choices: Sequence[Choice], draws: int) -> Array:
        """Return the scores of each choice's first releases, shape (choices, draws).

        Scores are those of `score_of`.
        """
        keys = [(each.sequence, each.speed, draw) for each in choices for draw in range(draws)]
        missing = [key for key in dict.fromkeys(keys) if key not in self._known]
        for place, score in finished(self._release, missing, self._workers):
            sequence, speed, draw = missing[place]
            self._known[missing[place]] = score
            self._kept.add([" ".join(sequence), speed, draw, score])
            if self._report is not None:
                self._report(len(self._known))
        self._asked.update(keys)
        return np.array([self._known[key] for key in keys]).reshape(len(choices), draws)


def hurried(scene: Scene) -> Scene:
    """Return a scene with a step limit at which rattling chains are abandoned."""
    # Step sizes of a fifth-order method grow with the fifth root of the tolerance.
    steps = round(PACE * scene.n * (1e-3 / scene.solver.tolerance) ** 0.2)
    most = min(max(steps, 1), scene.solver.max_steps_per_second)
    return scene.replace(solver={"max_steps_per_second": most})


def _release_of(record: list[Any]) -> tuple[Key, float]:
    sequence, speed, draw, score = record
    return (tuple(sequence.split()), speed, int(draw)), float(score)


def _score(scene: Scene, target: str, seed: int, key: Key) -> float:
    sequence, speed, draw = key
    fold = simulate(Choice(sequence, speed).applied(scene), generator(seed, draw))
    return score_of(fold, target)


def score_of(fold: Fold, target: str) -> float:
    """Return 1 if a chain settled as the target, 0 if the run failed, else half its similarity."""
    if fold.status is FoldStatus.FAILED:
        return 0.0
    if fold.status is FoldStatus.FOLDED and fold.word == target:
        return 1.0
    return 0.5 * similarity(fold.joint_angles, word_to_angles(target))
