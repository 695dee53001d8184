"""Physics calls: episodes played in a search, counted, and never more than the budget allows.

Call d of every choice has the same draws, so that choices are compared under equal conditions; what
was asked before is not played again. The draws are neither those of the evaluation nor those of any
training. Within its budget a search makes one choice a target.
"""

from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple, Protocol
from zlib import crc32

import numpy as np

from agents.evaluation import episodes, intervals, policies
from magfold_env.designer import Choice
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.tasks.draws import episode_seeds

USUAL_SPEED = 0.2
"""Feed speed [m/s] to begin with: the one at which most designs do well."""


class SpentError(Exception):
    """The budget has no call left; ends a search wherever it is."""


class Tally(NamedTuple):
    """What is known of a choice."""

    choice: policies.OpenLoop
    scores: tuple[float, ...]
    """Of the calls made for it: 1 is a success, a miss is worth half at most."""

    @property
    def successes(self) -> int:
        """How many of its calls were."""
        return sum(score == 1.0 for score in self.scores)

    @property
    def expected(self) -> float:
        """Its mean score as if it had had one call more, worth one half.

        Few calls say little: one success of one must not beat nine of nine.
        """
        return (sum(self.scores) + 0.5) / (len(self.scores) + 1)


class Calls:
    """Plays choices for one target until the budget of calls is spent; `seed` is of their draws.

    Whatever makes a call raises `SpentError` when none is left.
    """

    def __init__(self, env: FoldEnv[Any], target: str, budget: int, seed: int) -> None:
        self.env, self.target, self.budget = env, target, budget
        self.count = 0
        self._stream = f"search {seed}"
        self._seeds: list[int] = []
        self._scores: dict[policies.OpenLoop, list[float]] = {}

    def scores(self, choices: Sequence[Choice | policies.OpenLoop], draws: int) -> intervals.Floats:
        """Return the scores of the first calls of choices, shape (choices, draws).

        The first call of every choice is made before the second of any, so that a small budget
        is spread over all.
        """
        played = [self._as_played(choice) for choice in choices]
        for draw in range(draws):
            for choice in played:
                scores = self._scores.setdefault(choice, [])
                if len(scores) == draw:
                    scores.append(self._play(choice, draw))
        return np.array([self._scores[choice][:draws] for choice in played])

    def tallies(self) -> list[Tally]:
        """Return what is known of every choice, the most promising first."""
        known = [Tally(choice, tuple(scores)) for choice, scores in self._scores.items()]
        return sorted((each for each in known if each.scores), key=lambda each: -each.expected)

    def _as_played(self, choice: Choice | policies.OpenLoop) -> policies.OpenLoop:
        if isinstance(choice, Choice):
            assert choice.speed is not None  # a tube feeds in every environment
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


class Search(Protocol):
    """A way to choose a sequence and speeds."""

    def run(self, calls: Calls, rng: np.random.Generator) -> None:
        """Try choices, until one is good enough or the budget is spent (`SpentError`)."""
        ...

    def first(self, env: FoldEnv[Any], target: str, rng: np.random.Generator) -> policies.OpenLoop:
        """Return what is chosen without a single physics call."""
        ...


def choose(
    search: Search, env: FoldEnv[Any], target: str, budget: int, seed: int
) -> policies.Chosen:
    """Return what a search chooses for a target within a budget of physics calls, at least one.

    Of the choices that were tried in `env`, under its randomisation, it is the one with the best
    record (`Tally.expected`). The seed is that of the search and of its physics calls.
    """
    calls = Calls(env, target, budget, seed)
    with suppress(SpentError):
        search.run(calls, _generator(target, seed))
    best = calls.tallies()[0]
    return policies.Chosen(*best.choice, calls.count, best.successes, len(best.scores))


def choose_unseen(search: Search, env: FoldEnv[Any], target: str, seed: int) -> policies.Chosen:
    """Return what a search chooses for a target without a physics call."""
    first = search.first(env, target, _generator(target, seed)).as_played(env)
    return policies.Chosen(*first, calls=0, successes=0, releases=0)


def _generator(target: str, seed: int) -> np.random.Generator:
    """Return the random numbers of a search for a target."""
    return np.random.default_rng([seed, crc32(target.encode())])


def speeds_to_try(env: FoldEnv[Any]) -> list[float]:
    """Return the feed speeds that actions offer [m/s], the usual ones first."""
    return sorted(env.actions.speeds.tolist(), key=lambda v: abs(np.log(v / USUAL_SPEED)))


def random_choice(env: FoldEnv[Any], rng: np.random.Generator) -> policies.OpenLoop:
    """Return a choice of which every one is equally likely."""
    n = env.scene.n
    poles = rng.choice(["N", "S"], (n, 4))
    speeds = rng.choice(env.actions.speeds, n)
    return policies.OpenLoop(tuple("".join(faces) for faces in poles), tuple(speeds.tolist()))
