"""Baselines that choose a sequence and its speeds for each target before the chain folds.

Two start from energies: the minimiser's design and robust open-loop design. The third uses only
physics calls. ``python -m agents.baselines SEARCH`` runs a search and writes its choices, which
`agents.evaluate` then scores on fresh draws.

A physics call is an episode that a search plays. The number of calls never exceeds the budget.
Call number d has the same draws for every choice, so choices are compared under equal conditions.
No call is played twice. Evaluation and training use other draws.
"""

import hashlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, NamedTuple
from zlib import crc32

import numpy as np
import typer

import magfold_env as mf
from agents.commands import (
    EnvChanges,
    EnvConfig,
    Processes,
    progress_bar,
    run_command,
)
from agents.evaluation import episodes, intervals, policies
from agents.settings import EnvSettings, env_settings
from magfold_env import designer
from magfold_env.designer import Choice, annealing, trials
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.files import physics_digest
from magfold_env.minimiser import LONGEST_OF_ALL
from magfold_env.shapes import folded_words

USUAL_SPEED = 0.2
"""Feed speed [m/s] to try first, because most designs do well at it."""


class SpentError(Exception):
    """Raised when the budget has no calls left, which may end a search at any point."""


class Tally(NamedTuple):
    """A choice and the scores of the physics calls that tried it."""

    choice: policies.OpenLoop
    scores: tuple[float, ...]
    """Scores of the calls: 1 for a success, at most one half for a failure."""

    @property
    def successes(self) -> int:
        """Number of successful calls."""
        return sum(score == 1.0 for score in self.scores)

    @property
    def expected(self) -> float:
        """Mean score, including one imaginary call that scores one half.

        Few calls are weak evidence: one success in one call must not beat nine in nine.
        """
        return (sum(self.scores) + 0.5) / (len(self.scores) + 1)


class Calls:
    """Physics calls for one target within a budget; `seed` determines their draws.

    A call beyond the budget raises `SpentError`.
    """

    def __init__(self, env: FoldEnv[Any], target: str, budget: int, seed: int) -> None:
        self.env, self.target, self.budget = env, target, budget
        self.count = 0
        self._stream = f"search {seed}"
        self._seeds: list[int] = []
        self._scores: dict[policies.OpenLoop, list[float]] = {}

    def scores(self, choices: Sequence[Choice | policies.OpenLoop], draws: int) -> intervals.Floats:
        """Return the scores of each choice's first calls, shape (choices, draws).

        All choices get their first call before any gets a second, so that a small budget is spread
        over all of them.
        """
        played = [self._as_played(choice) for choice in choices]
        for draw in range(draws):
            for choice in played:
                scores = self._scores.setdefault(choice, [])
                if len(scores) == draw:
                    scores.append(self._play(choice, draw))
        return np.array([self._scores[choice][:draws] for choice in played])

    def tallies(self) -> list[Tally]:
        """Return the tallies of all choices played, in order of decreasing expected score."""
        known = [Tally(choice, tuple(scores)) for choice, scores in self._scores.items()]
        return sorted((each for each in known if each.scores), key=lambda each: -each.expected)

    def _as_played(self, choice: Choice | policies.OpenLoop) -> policies.OpenLoop:
        if isinstance(choice, Choice):
            assert choice.speed is not None  # every environment has a tube
            choice = policies.OpenLoop.at_one_speed(choice.sequence, choice.speed)
        return choice.as_played(self.env)

    def _play(self, choice: policies.OpenLoop, draw: int) -> float:
        if self.count == self.budget:
            raise SpentError
        self.count += 1
        if draw >= len(self._seeds):
            self._seeds = episode_seeds(self._stream, 2 * draw + 1)
        policy = policies.chosen({self.target: choice})
        return episodes.play(policy, self.env, self.target, self._seeds[draw]).score


Search = Callable[[float, Calls, np.random.Generator], None]
"""A function that tries choices until one is good enough or the budget is spent (`SpentError`).

Its first argument is the sufficient share of successes in 40 calls.
"""


def choose_for(
    name: str, goal: float, env: FoldEnv[Any], target: str, budget: int, seed: int
) -> policies.Chosen:
    """Search for the best choice for a target, within a budget of physics calls, and return it.

    The best choice has the highest `Tally.expected` of all that were tried in `env`, under its
    randomisation. `budget` is at least one call. `seed` seeds the search and its physics calls.
    """
    calls = Calls(env, target, budget, seed)
    with suppress(SpentError):
        SEARCHES[name](goal, calls, np.random.default_rng([seed, crc32(target.encode())]))
    best = calls.tallies()[0]
    return policies.Chosen(*best.choice, calls.count, best.successes, len(best.scores))


def speeds_to_try(env: FoldEnv[Any]) -> list[float]:
    """Return the available feed speeds [m/s], those closest to `USUAL_SPEED` first."""
    return sorted(env.actions.speeds.tolist(), key=lambda v: abs(np.log(v / USUAL_SPEED)))


def minimiser_design(goal: float, calls: Calls, rng: np.random.Generator) -> None:
    """Compare all feed speeds for the target's sequence with the largest energy gap."""
    scene: Any = calls.env.scene
    every = _all_deepest(scene) if scene.n <= LONGEST_OF_ALL else {}
    sequence = every.get(calls.target) or _deepest(scene, calls.target)
    trials.successive_halving(
        [designer.Choice(sequence, speed) for speed in speeds_to_try(calls.env)], calls
    )


@lru_cache(maxsize=4)
def _all_deepest(scene: mf.Scene) -> dict[str, tuple[str, ...]]:
    """Return, by word, the sequence that is proven to have the largest energy gap."""
    found = designer.gap_designs(scene, folded_words(scene.n))
    return {word: sequence for word, sequence in found.items() if sequence is not None}


@lru_cache(maxsize=512)
def _deepest(scene: mf.Scene, target: str) -> tuple[str, ...]:
    """Return the sequence with the largest energy gap that annealing finds for the target."""
    mode = scene.feed.direction
    found = designer.design(target, scene, mode, "gap", search="annealing", runs=0, workers=1)
    return found.sequence


def robust_search(goal: float, calls: Calls, rng: np.random.Generator) -> None:
    """Let the designer's search (`magfold_env.designer`) try choices in randomised episodes.

    Sequences that are good by energy (for long chains, those whose only stable word is the target)
    are compared at one speed, then at two and so on, until one of them reaches the goal. If none
    does, the cross-entropy method continues from the best choice.
    """
    env = calls.env
    # The search by energy needs no budget because it makes no physics calls.
    task = designer.task_for(
        calls.target, env.scene, env.scene.feed.direction, "probability",
        search=None, seed=int(rng.integers(2**31)), speeds=None, budget=1, goal=1.0, runs=0,
    )  # fmt: skip
    sequences = designer.candidates(task, Counter(), lambda done: None)
    evaluations: list[trials.Evaluation] = []
    for count in range(1, len(designer.SPEEDS) + 1):
        choices = [
            designer.Choice(each, speed) for speed in designer.SPEEDS[:count] for each in sequences
        ]
        evaluations = trials.successive_halving(choices, calls)
        if evaluations[0].rate >= goal:
            return
    groups = annealing.stable_groups(calls.target)[1] if task.search == "annealing" else None
    trials.cross_entropy(
        calls, 4 * task.scene.n, designer.SPEEDS, rng, calls.budget,
        goal=goal, first=evaluations[0].choice, groups=groups,
    )  # fmt: skip


def cross_entropy_search(goal: float, calls: Calls, rng: np.random.Generator) -> None:
    """Run `magfold_env.designer.trials.cross_entropy` from a uniform distribution."""
    env = calls.env
    trials.cross_entropy(
        calls, 4 * env.scene.n, env.actions.speeds.tolist(), rng, calls.budget, goal=goal
    )


SEARCHES: Mapping[str, Search] = {
    "minimiser-free": minimiser_design,
    "robust": robust_search,
    "cross-entropy": cross_entropy_search,
}
"""The searches by name."""


def choose(
    name: str,
    settings: EnvSettings,
    path: Path,
    budget: int,
    goal: float = 1.0,
    seed: int = 0,
    processes: int = 1,
) -> Iterator[tuple[str, policies.Chosen]]:
    """Search for a choice for every target, store it in a file and yield it as soon as it is known.

    The file is created if needed; targets that it already contains are left out. `budget` is the
    largest number of physics calls per target, `goal` is the share of successes that ends a search
    early, and `seed` seeds the search and its calls. The targets are shared among `processes`.

    Raises
    ------
    ValueError
        If there is no such search, `goal` is not in (0, 1], or the file is damaged or belongs to
        another search.
    """
    if name not in SEARCHES:
        raise ValueError(f"search: {name!r} is not allowed; must be one of {', '.join(SEARCHES)}")
    if not 0.0 < goal <= 1.0:
        raise ValueError(f"goal: {goal} is not allowed; must be above 0 and at most 1")
    env = episodes.make_env(settings)
    scene = env.scene.model_dump_json(exclude={"sequence"})
    key = {
        "search": name,
        "budget": budget,
        "goal": goal,
        "seed": seed,
        "physics": physics_digest(),
        "components": env.scene.n,
        "scene": hashlib.sha256(scene.encode()).hexdigest()[:16],
        # A target's result does not depend on which other targets there are.
        "env": settings.model_dump(mode="json", exclude={"targets", "difficulty", "shaping"}),
    }
    file = policies.ChoiceFile(path, key)
    known = [target for target in env.targets if target in file.chosen]
    missing = [target for target in env.targets if target not in file.chosen]

    def each() -> Iterator[tuple[str, policies.Chosen]]:
        yield from ((target, file.chosen[target]) for target in known)
        jobs = [(name, goal, settings, target, budget, seed) for target in missing]
        found = episodes.spread_over(processes, _search, jobs)
        for target, chosen in zip(missing, found, strict=True):
            file.add(target, chosen)
            yield target, chosen

    return each()


def _search(name: str, goal: float, settings: EnvSettings, *job: Any) -> policies.Chosen:
    return choose_for(name, goal, episodes.own_env(settings), *job)


def main(
    search: Annotated[str, typer.Argument(help=f"One of {', '.join(SEARCHES)}.")],
    config: EnvConfig = "ppo-tube-feed",
    env: EnvChanges = None,
    budget: Annotated[
        int, typer.Option(min=1, help="Largest number of physics calls per target.")
    ] = 2000,
    goal: Annotated[
        float, typer.Option(help="Share of successes in 40 calls that ends a search early.")
    ] = 1.0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the search and of its calls.")] = 0,
    processes: Processes = 2,
    output: Annotated[
        Path | None, typer.Option(help="File of choices; runs/baselines/SEARCH.json by default.")
    ] = None,
) -> None:
    """Choose a sequence and speeds for every target; continue an interrupted search."""
    path = output or Path("runs/baselines") / f"{search}.json"
    calls = targets = 0
    settings = env_settings(config, env or [])
    total = len(episodes.make_env(settings).targets)
    found = choose(search, settings, path, budget, goal, seed, processes)
    with progress_bar() as bar:
        task = bar.add_task(search, total=total, note="")
        for _, chosen in found:
            calls, targets = calls + chosen.calls, targets + 1
            bar.update(task, advance=1, note=f"{calls / targets:.0f} calls per target")
    typer.echo(f"{calls} physics calls for {targets} targets; choices written to {path}")


if __name__ == "__main__":
    from agents import baselines  # noqa: PLW0406 (processes find its functions by this name)

    run_command(baselines.main)
