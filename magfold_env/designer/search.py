"""From a wanted shape to magnets and a feed speed: `design`.

Sequences that speak for themselves by energy come first; under `probability` they are released.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from magfold_env.checkpoint import Checkpoint
from magfold_env.designer import annealing, evidence, exhaustive, trials
from magfold_env.designer.result import Design, Objective, Search
from magfold_env.designer.task import Choice, Task, task_for
from magfold_env.ensembles.releases import ensemble
from magfold_env.files import a_path, physics_digest
from magfold_env.minimiser import Mode, energies, sequence_of
from magfold_env.parallel import Backend, Workers, connected
from magfold_env.scene import Scene, errors
from magfold_env.shapes import is_fully_folded

Progress = Callable[[str, float], object]
Report = Callable[[float], object]
Sequences = list[tuple[str, ...]]

_APART = 4  # faces by which two candidates differ at least
_COUNT = 6  # of short chains
_STARTS = 3  # of annealing
_STABLE = 24  # drawn without annealing


def design(  # noqa: PLR0913 - what a search depends on, and who does it
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
    address: str | None = None,
    state: str | Path | None = None,
    progress: Progress | None = None,
) -> Design:
    """Search for magnets, and a feed speed, with which a chain folds into a wanted shape.

    Parameters
    ----------
    target
        A word; its letters say how many components there are.
    scene
        Casing, magnets, friction, spreads: everything but the sequence, the feed's direction and
        its speed. None takes a shipped one, `design` for up to six components, else `design-long`.
    mode
        How the chain is released: `free`, or out of a tube `forward` or `backward`.
    objective
        `probability`: that the chain settles as the target, under the scene's spreads. By energy
        alone: `ground`, any sequence whose only ground state it is; `unique`, one of which it is
        the only stable word, of lowest energy; `gap`, the one with the largest distance to the
        next word; `sensitivity`, the one that bears the largest error of single magnets.
    search
        `exhaustive` compares all sequences of up to six components and proves what it finds;
        `annealing` is for any length. Under `probability` both propose sequences, which are then
        released, at one speed after another, the more often the better they do; where annealing's
        will not do, further sequences of which the target is the only stable word join them. If
        none will do, `cross-entropy` goes on from the best. That search can also be had from the
        start: it needs no energies. None is exhaustive where that is possible, else annealing.
    seed
        Of everything that is drawn.
    speeds
        Feed speeds to choose from under `probability` [m/s], tried in this order until one does;
        None takes 0.2, 0.5, 0.08 and 0.03. Designs by energy keep the scene's.
    budget
        Releases that no generation of `cross-entropy`, but for its first, may exceed.
    goal
        Probability that is enough. The search wants half of what is then left to certainty as
        well: what was selected does a little worse on other releases.
    runs
        Releases by which the result is assessed, none of which the search has seen; 0 for none.
    workers, backend, address
        See `ensemble`.
    state
        Folder in which releases are kept as they are made. Called again with it, after a kill, the
        search goes the same way without repeating them.
    progress
        Is told what is being done, and which share of it.

    Raises
    ------
    SceneError
        If an argument is not allowed.
    ValueError
        If the target is no word, or the scene has an external field.
    CheckpointError
        If what is in `state` is damaged, or was written for another search or physics, or if
        another process uses it.
    """
    errors.refuse(errors.unless_function("progress", progress))
    task = task_for(
        target, scene, mode, objective,
        search=search, seed=seed, speeds=speeds, budget=budget, goal=goal, runs=runs,
    )  # fmt: skip
    run = _Run(
        task,
        Workers(workers, backend, address),
        None if state is None else a_path("state", state),
        progress or (lambda what, done: None),
        Counter(),
    )
    if task.impossible:
        return run.refused(task.impossible)
    with connected(run.workers):
        if objective == "probability":
            return run.assessed(run.most_probable().choice, score=None, bound=1.0)
        found = best_by_energy(task, run.calls, lambda done: run.report("energies", done))
        if found.sequence is None:
            return run.refused(found.certificate)
        # Energies know no speed: the scene's is left as it is.
        return run.assessed(Choice(found.sequence, None), found.score, found.bound)


@dataclass(frozen=True)
class _Run:
    """A task, who works on it, and what was asked so far."""

    task: Task
    workers: Workers
    folder: Path | None
    report: Progress
    calls: Counter[str]

    def most_probable(self) -> trials.Evaluation:
        """Search for the choice that most often settles as the target."""
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
                found = candidates(task, self.calls, lambda done: self.report("energies", done))
                drawn = stable_sequences(task) if task.search == "annealing" else []
                evaluations = _raced(task, releases, found, drawn)
            if not evaluations or evaluations[0].rate < task.enough:
                evaluations = _refined(task, releases, evaluations)
        self.calls["releases"] = releases.count
        return evaluations[0]

    def assessed(self, choice: Choice, score: float | None, bound: float | None) -> Design:
        """Weigh a choice by energy, and release it on draws that the search has not seen."""
        task = self.task
        scene = choice.applied(task.scene)
        weighed = evidence.weigh(scene, task.target, self.calls)
        probability = None
        if task.runs:
            made = ensemble(
                scene, task.runs, task.releases_seed,
                workers=self.workers.count, backend=self.workers.backend,
                address=self.workers.address,
                state=None if self.folder is None else self.folder / "judgement",
                progress=lambda done, total: self.report("judgement", done / total),
            )  # fmt: skip
            probability = made.probability(task.target, "folded")
        reached = weighed.only_stable if task.objective == "unique" else weighed.ground
        if task.objective == "probability":
            score = None if probability is None else probability.rate
            reached = score is not None and score >= task.goal
        return Design(
            task.target, task.mode, task.objective, task.search, scene, reached, score, bound,
            weighed, probability, task.releases_seed, dict(self.calls), certificate="",
        )  # fmt: skip

    def refused(self, certificate: str) -> Design:
        """Return that no sequence will do, and why."""
        task = self.task
        return Design(
            task.target, task.mode, task.objective, task.search, None, False, None, None,
            None, None, task.releases_seed, dict(self.calls), certificate,
        )  # fmt: skip


def _raced(
    task: Task, releases: trials.Trials, few: list[tuple[str, ...]], many: list[tuple[str, ...]]
) -> list[trials.Evaluation]:
    """Try few sequences at the first speed, then more of them and more speeds, until one does."""
    speeds = task.speeds or (None,)
    stages = [(few, 1), *(([*few, *many], count) for count in range(1, len(speeds) + 1))]
    evaluations: list[trials.Evaluation] = []
    for sequences, count in stages:
        choices = [Choice(each, speed) for speed in speeds[:count] for each in sequences]
        evaluations = trials.race(choices, releases, task.enough)
        if not evaluations or evaluations[0].rate >= task.enough:
            break
    return evaluations


def _refined(
    task: Task, releases: trials.Trials, evaluations: list[trials.Evaluation]
) -> list[trials.Evaluation]:
    """Go on from the best choice so far, if there is one, and keep what was better."""
    rng = np.random.default_rng([task.searching_seed, 1])
    first = evaluations[0].choice if evaluations else None
    # Of what annealing proposes the target is the only stable word; so it shall stay.
    groups = annealing.stable_groups(task.target)[1] if task.search == "annealing" else None
    others = trials.cross_entropy(
        releases, 4 * task.scene.n, task.speeds, rng, task.budget,
        goal=task.enough, first=first, groups=groups,
    )  # fmt: skip
    return trials.ranked([*evaluations, *others])


class Found(NamedTuple):
    """The best sequence of a search by energy."""

    sequence: tuple[str, ...] | None
    score: float | None
    """Its gap [J]; its tolerance if that was sought."""
    bound: float | None
    """What no sequence exceeds, proved; None if unknown."""
    certificate: str = ""


def best_by_energy(task: Task, calls: Counter[str], report: Report) -> Found:
    """Search for the best sequence under one of the objectives of energy."""
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
    return Found(best.sequence, best.score, bound=None)


def candidates(task: Task, calls: Counter[str], report: Report) -> Sequences:
    """Return sequences that differ and of which each is good by energy, for the dearer test.

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
    """Return sequences of which the target is the only stable word, drawn evenly."""
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
        # The only stable word need not be the ground state.
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
        return Found(None, None, None, certificate)
    score = float(scores[number] if task.objective == "sensitivity" else gaps[number])
    bound = score if task.objective in ("gap", "sensitivity") else None
    return Found(sequence_of(number, task.scene.n), score, bound)
