"""The function `design`, which finds magnets and a feed speed for a target shape.

The search first selects sequences by energy; for `probability`, it then releases chains with them.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from magfold_env.checkpoint import Checkpoint
from magfold_env.designer import annealing, evidence, exhaustive, trials
from magfold_env.designer.task import Choice, Design, Objective, Search, Task, task_for
from magfold_env.ensembles.releases import ensemble
from magfold_env.files import a_path, physics_digest
from magfold_env.minimiser import Mode, energies, sequence_of
from magfold_env.parallel import Backend, Workers, connected
from magfold_env.reporting.intervals import Share
from magfold_env.scene import Scene, errors
from magfold_env.shapes import is_fully_folded

Progress = Callable[[str, float], object]
Report = Callable[[float], object]
Sequences = list[tuple[str, ...]]

_APART = 4  # smallest number of faces in which two candidates differ
_COUNT = 6  # number of candidates for short chains
_STARTS = 3  # number of annealing runs
_STABLE = 24  # number of sequences drawn without annealing


def design(  # noqa: PLR0913 - all that a search depends on, and its workers
    target: str,
    scene: Scene | None = None,
    mode: Mode = "forward",
    objective: Objective = "probability",
    *,
    search: Search | None = None,
    seed: int = 0,
    speeds: Sequence[float] | None = None,
    budget: int = 2000,
    goal: float = 0.9,
    runs: int = 100,
    workers: int | None = None,
    backend: Backend | None = None,
    state: str | Path | None = None,
    progress: Progress | None = None,
) -> Design:
    """Search for magnets and a feed speed with which a chain folds into a target shape.

    Parameters
    ----------
    target
        A word; its length sets the number of components.
    scene
        Everything except the sequence and the feed's direction and speed, such as casing, magnets,
        friction and spreads. None selects a shipped scene: `design` for up to six components, else
        `design-long`.
    mode
        How the chain is released: `free`, or out of a tube `forward` or `backward`.
    objective
        `probability` maximises the probability that the chain settles as the target under the
        scene's spreads. The others use only energies: `ground` finds any sequence whose only ground
        state is the target; `unique` finds a sequence whose only stable word is the target, with
        the largest gap; `gap` finds the sequence with the largest energy gap to the next word;
        `sensitivity` finds the sequence that tolerates the largest error of individual magnets.
    search
        `exhaustive` compares all sequences of up to six components and proves its result;
        `annealing` works for any length. With the objective `probability`, both propose sequences,
        which are then released at one speed after another; better sequences get more releases. If
        the proposals of annealing fail, further sequences whose only stable word is the target are
        added. If all fail, `cross-entropy` continues from the best. It can also be selected
        directly and needs no energies. None selects `exhaustive` if possible, else `annealing`.
    seed
        Seed of all random draws.
    speeds
        Feed speeds [m/s] to choose from for `probability`, tried in this order until one succeeds;
        None means 0.2, 0.5, 0.08 and 0.03. Designs by energy keep the scene's speed.
    budget
        Largest number of releases. After its first generation, `cross-entropy` begins no other that
        would exceed it.
    goal
        A probability that suffices. The search itself requires a value halfway between this and 1,
        because selected choices do slightly worse in other releases.
    runs
        Number of releases, not used in the search, that assess the result. May be 0.
    workers, backend
        See `ensemble`.
    state
        Folder that stores releases as they are made. If an interrupted search is called again with
        the same folder, it takes the same course without repeating stored releases.
    progress
        Function that is called with a description of the current work and its completed share.

    Raises
    ------
    SceneError
        If an argument is not allowed.
    ValueError
        If the target is not a word, or the scene has an external field.
    CheckpointError
        If the contents of `state` are damaged or belong to another search or another version of the
        physics, or if another process uses the folder.
    """
    errors.refuse(errors.unless_function("progress", progress))
    task = task_for(
        target, scene, mode, objective,
        search=search, seed=seed, speeds=speeds, budget=budget, goal=goal, runs=runs,
    )  # fmt: skip
    run = _Run(
        task,
        Workers(workers, backend),
        None if state is None else a_path("state", state),
        progress or (lambda what, done: None),
        Counter(),
    )
    if task.impossible:
        return run.assessed(Found(certificate=task.impossible))
    with connected(run.workers):
        if objective == "probability":
            return run.assessed(Found(run.most_probable().choice, bound=1.0))
        report = partial(run.report, "energies")
        return run.assessed(best_by_energy(task, run.calls, report))


class Found(NamedTuple):
    """The best choice of a search."""

    choice: Choice | None = None
    score: float | None = None
    """The gap [J], or the tolerance if that is the objective; None if releases decide."""
    bound: float | None = None
    """Proven upper bound of the score; None if unknown."""
    certificate: str = ""
    """Reason why there is no choice; empty if there is one."""


@dataclass(frozen=True)
class _Run:
    """A task with its workers and the counts of calls so far."""

    task: Task
    workers: Workers
    folder: Path | None
    report: Progress
    calls: Counter[str]

    def most_probable(self) -> trials.Evaluation:
        """Return the evaluation of the choice whose chain most often settles as the target."""
        task = self.task
        scene = trials.hurried(task.scene)
        key = {
            "kind": "design",
            "physics": physics_digest(),
            "scene": scene.model_dump(mode="json"),
            "target": task.target,
            "seed": task.searching_seed,
        }
        evaluations: list[trials.Evaluation] = []
        folder = None if self.folder is None else self.folder / "search"
        with Checkpoint(folder, key) as kept:
            releases = trials.Trials(
                scene, task.target, task.searching_seed, self.workers, kept,
                lambda made: self.report("releases", min(1.0, made / task.budget)),
            )  # fmt: skip
            if task.search != "cross-entropy":
                found = candidates(task, self.calls, partial(self.report, "energies"))
                drawn = stable_sequences(task) if task.search == "annealing" else []
                evaluations = _raced(task, releases, found, drawn)
            if not evaluations or evaluations[0].rate < task.enough:
                evaluations = _refined(task, releases, evaluations)
        self.calls["releases"] = releases.count
        return evaluations[0]

    def assessed(self, found: Found) -> Design:
        """Return the design for a choice, assessed by energies and releases beyond the search."""
        task, score = self.task, found.score
        scene = weighed = probability = None
        reached = False
        if found.choice is not None:
            scene = found.choice.applied(task.scene)
            weighed = evidence.weigh(scene, task.target, self.calls)
            probability = self.released(scene) if task.runs else None
            reached = weighed.only_stable if task.objective == "unique" else weighed.ground
            if task.objective == "probability":
                score = None if probability is None else probability.rate
                reached = score is not None and score >= task.goal
        return Design(
            task.target, task.mode, task.objective, task.search, scene, reached, score,
            found.bound, weighed, probability, task.releases_seed, dict(self.calls),
            found.certificate,
        )  # fmt: skip

    def released(self, scene: Scene) -> Share:
        """Return the share of successful releases among those that the search has not used."""
        made = ensemble(
            scene, self.task.runs, self.task.releases_seed,
            workers=self.workers.count, backend=self.workers.backend,
            state=None if self.folder is None else self.folder / "judgement",
            progress=lambda done, total: self.report("judgement", done / total),
        )  # fmt: skip
        return made.probability(self.task.target, "folded")


def _raced(
    task: Task, releases: trials.Trials, few: list[tuple[str, ...]], many: list[tuple[str, ...]]
) -> list[trials.Evaluation]:
    """Evaluate ``few`` sequences at one speed, then all sequences at more, until one succeeds."""
    speeds = task.speeds or (None,)
    stages = [(few, 1), *(([*few, *many], count) for count in range(1, len(speeds) + 1))]
    evaluations: list[trials.Evaluation] = []
    for sequences, count in stages:
        choices = [Choice(each, speed) for speed in speeds[:count] for each in sequences]
        evaluations = trials.successive_halving(choices, releases, task.enough)
        if not evaluations or evaluations[0].rate >= task.enough:
            break
    return evaluations


def _refined(
    task: Task, releases: trials.Trials, evaluations: list[trials.Evaluation]
) -> list[trials.Evaluation]:
    """Run `cross_entropy` from the best choice so far, if any; return all evaluations, ranked."""
    rng = np.random.default_rng([task.searching_seed, 1])
    first = evaluations[0].choice if evaluations else None
    # The target is the only stable word of annealing's proposals, and must remain so.
    groups = annealing.stable_groups(task.target)[1] if task.search == "annealing" else None
    others = trials.cross_entropy(
        releases, 4 * task.scene.n, task.speeds, rng, task.budget,
        goal=task.enough, first=first, groups=groups,
    )  # fmt: skip
    return trials.ranked([*evaluations, *others])


def best_by_energy(task: Task, calls: Counter[str], report: Report) -> Found:
    """Search for the best sequence for one of the energy objectives."""
    if task.search == "exhaustive":
        return _best_of_all(task, calls)
    rng = np.random.default_rng(task.searching_seed)
    enough = energies.tie(task.scene) if task.objective == "ground" else np.inf
    kinds = [True, True, False, False] if is_fully_folded(task.target) else [False] * 4
    best: annealing.Annealed | None = None
    for done, stable in enumerate([True] if task.objective == "unique" else kinds):
        found = annealing.anneal_sequence(
            task.scene, task.target, rng, calls,
            tolerant=task.objective == "sensitivity", stable=stable, good_enough=enough,
        )  # fmt: skip
        best = found if best is None or found.score > best.score else best
        report((done + 1) / len(kinds))
        if best.score > enough:
            break
    assert best is not None
    # Energies do not depend on the speed, so the scene keeps its own.
    return Found(Choice(best.sequence, None), best.score)


def candidates(task: Task, calls: Counter[str], report: Report) -> Sequences:
    """Return distinct sequences that are good by energy, for the more expensive releases.

    The target must be fully folded.
    """
    if task.search == "exhaustive":
        every = exhaustive.Exhaustive(task.scene, task.target)
        calls["energies"] += every.calls
        report(0.5)
        gaps, only = every.gaps, every.only_stable()
        firsts = [every.best(gaps, only), every.best(every.tolerances()), every.best(gaps)]
        numbers = [number for number in firsts if number is not None]
        numbers += every.spread_out(gaps, _COUNT - len(numbers), _APART)
        return list(dict.fromkeys(sequence_of(number, task.scene.n) for number in numbers))
    rng = np.random.default_rng(task.searching_seed)
    found: Sequences = []
    for done in range(_STARTS):
        annealed = annealing.anneal_sequence(task.scene, task.target, rng, calls, stable=True)
        found.append(annealed.sequence)
        report((done + 1) / _STARTS)
    return list(dict.fromkeys(found))


def stable_sequences(task: Task) -> Sequences:
    """Return sequences whose only stable word is the target, drawn uniformly."""
    rng = np.random.default_rng([task.searching_seed, 2])
    drawn = [
        annealing.sequence_of_signs(annealing.stable_signs(task.target, rng)[0])
        for _ in range(_STABLE)
    ]
    return list(dict.fromkeys(drawn))


def _best_of_all(task: Task, calls: Counter[str]) -> Found:
    every = exhaustive.Exhaustive(task.scene, task.target)
    calls["energies"] += every.calls
    gaps = scores = every.gaps
    if task.objective == "sensitivity":
        scores = every.tolerances()
    elif task.objective == "unique":
        # The only stable word may differ from the ground state.
        scores = np.where(every.only_stable(), 1.0 + gaps - gaps.min(), 0.0)
    number = every.best(scores)
    if number is None:
        certificate = f"of none of all {gaps.size} sequences is it the only stable word"
        if task.objective != "unique":
            lower = f"at least {-gaps.max():.3g} J lower" if gaps.max() < 0.0 else "as low"
            certificate = (
                f"of none of all {gaps.size} sequences is it the only ground state; another word "
                f"lies {lower}"
            )
        return Found(certificate=certificate)
    score = float(scores[number] if task.objective == "sensitivity" else gaps[number])
    bound = score if task.objective in ("gap", "sensitivity") else None
    return Found(Choice(sequence_of(number, task.scene.n), None), score, bound)
