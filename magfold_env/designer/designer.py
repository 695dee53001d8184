"""From a wanted shape to magnets and a feed speed: `design`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from magfold_env.checkpoint import Checkpoint
from magfold_env.designer.candidates import best_by_energy, candidates, held
from magfold_env.designer.choice import Choice
from magfold_env.designer.cross_entropy import cross_entropy
from magfold_env.designer.evidence import weigh
from magfold_env.designer.holding import holding_groups
from magfold_env.designer.race import Standing, race, ranked
from magfold_env.designer.result import Design, Objective, Search
from magfold_env.designer.task import Task, task_for
from magfold_env.designer.trials import Trials, hurried
from magfold_env.ensembles import ensemble
from magfold_env.files import physics_digest
from magfold_env.minimiser import Mode
from magfold_env.parallel import Backend, Workers, connected
from magfold_env.scene import Scene

Progress = Callable[[str, float], object]


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
        Releases by which the result is judged, none of which the search has seen; 0 for none.
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
        If a file in `state` is damaged, or was written for another search or another physics.
    """
    task = task_for(
        target, scene, mode, objective,
        search=search, seed=seed, speeds=speeds, budget=budget, goal=goal, runs=runs,
    )  # fmt: skip
    run = _Run(
        task,
        Workers(workers, backend, address),
        None if state is None else Path(state),
        progress or _ignore,
        Counter(),
    )
    if task.impossible:
        return run.refused(task.impossible)
    with connected(run.team):
        if objective == "probability":
            return run.judged(run.most_probable().choice, score=None, bound=1.0)
        found = best_by_energy(task, run.calls, lambda done: run.report("energies", done))
        if found.sequence is None:
            return run.refused(found.certificate)
        # Energies know no speed: the scene's is left as it is.
        return run.judged(Choice(found.sequence, None), found.score, found.bound)


@dataclass(frozen=True)
class _Run:
    """A task, who works on it, and what was asked so far."""

    task: Task
    team: Workers
    folder: Path | None
    report: Progress
    calls: Counter[str]

    def most_probable(self) -> Standing:
        """Search for the choice that most often settles as the target."""
        task = self.task
        scene = hurried(task.scene)
        kept = None if self.folder is None else Checkpoint(self.folder / "search", self._key(scene))
        trials = Trials(
            scene, task.target, task.searching_seed, self.team, kept,
            lambda made: self.report("releases", min(1.0, made / task.budget)),
        )  # fmt: skip
        standings: list[Standing] = []
        if task.search != "cross-entropy":
            found = candidates(task, self.calls, lambda done: self.report("energies", done))
            drawn = held(task) if task.search == "annealing" else []
            standings = _raced(task, trials, found, drawn)
        if not standings or standings[0].rate < task.enough:
            standings = _refined(task, trials, standings)
        self.calls["releases"] = trials.count
        return standings[0]

    def judged(self, choice: Choice, score: float | None, bound: float | None) -> Design:
        """Weigh a choice by energy, and release it on draws that the search has not seen."""
        task = self.task
        scene = choice.applied(task.scene)
        evidence = weigh(scene, task.target, self.calls)
        probability = None
        if task.runs:
            made = ensemble(
                scene, task.runs, task.releases_seed,
                workers=self.team.count, backend=self.team.backend, address=self.team.address,
                state=None if self.folder is None else self.folder / "judgement",
                progress=lambda done, total: self.report("judgement", done / total),
            )  # fmt: skip
            probability = made.probability(task.target, "folded")
        reached = evidence.only_stable if task.objective == "unique" else evidence.ground
        if task.objective == "probability":
            score = None if probability is None else probability.rate
            reached = score is not None and score >= task.goal
        return Design(
            task.target, task.mode, task.objective, task.search, scene, reached, score, bound,
            evidence, probability, task.releases_seed, dict(self.calls), certificate="",
        )  # fmt: skip

    def refused(self, certificate: str) -> Design:
        """Return that no sequence will do, and why."""
        task = self.task
        return Design(
            task.target, task.mode, task.objective, task.search, None, False, None, None,
            None, None, task.releases_seed, dict(self.calls), certificate,
        )  # fmt: skip

    def _key(self, scene: Scene) -> dict[str, object]:
        return {
            "kind": "design",
            "physics": physics_digest(),
            "scene": scene.model_dump(mode="json"),
            "target": self.task.target,
            "seed": self.task.searching_seed,
        }


def _raced(
    task: Task, trials: Trials, few: list[tuple[str, ...]], many: list[tuple[str, ...]]
) -> list[Standing]:
    """Try few sequences at the first speed, then more of them and more speeds, until one does."""
    speeds = task.speeds or (None,)
    stages = [(few, 1), *(([*few, *many], count) for count in range(1, len(speeds) + 1))]
    standings: list[Standing] = []
    for sequences, count in stages:
        choices = [Choice(each, speed) for speed in speeds[:count] for each in sequences]
        standings = race(choices, trials, task.enough)
        if not standings or standings[0].rate >= task.enough:
            break
    return standings


def _refined(task: Task, trials: Trials, standings: list[Standing]) -> list[Standing]:
    """Go on from the best choice so far, if there is one, and keep what was better."""
    rng = np.random.default_rng([task.searching_seed, 1])
    first = standings[0].choice if standings else None
    # What annealing proposes holds its target; so shall what is made of it.
    groups = holding_groups(task.target)[1] if task.search == "annealing" else None
    others = cross_entropy(
        trials, 4 * task.scene.n, task.speeds, rng, task.budget,
        goal=task.enough, first=first, groups=groups,
    )  # fmt: skip
    return ranked([*standings, *others])


def _ignore(what: str, done: float) -> None:
    pass
