"""Physics calls: episodes played in a search, counted, and never more than the budget allows.

Call d of every choice has the same draws, so that choices are compared under equal conditions; what
was asked before is not played again. The draws are neither those of the evaluation nor those of any
training.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.evaluation.episodes import Outcome, play
from agents.evaluation.open_loop import FrozenPolicy, OpenLoop
from agents.evaluation.policies import Policy
from magfold_env.designer.task import Choice
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.tasks.draws import episode_seeds


class SpentError(Exception):
    """The budget has no call left; ends a search wherever it is."""


class Standing(NamedTuple):
    """What is known of a choice."""

    choice: OpenLoop
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
    """Plays choices for one target until the budget is spent.

    Parameters
    ----------
    env : FoldEnv
        Where.
    target : str
        The word that is wanted.
    budget : int
        Most calls.
    seed : int
        Of the draws.
    """

    def __init__(self, env: FoldEnv[Any], target: str, budget: int, seed: int) -> None:
        self.env, self.target, self.budget = env, target, budget
        self.count = 0
        self._stream = f"search {seed}"
        self._seeds: list[int] = []
        self._scores: dict[OpenLoop, list[float]] = {}

    def scores(self, choices: Sequence[Choice | OpenLoop], draws: int) -> NDArray[np.float64]:
        """Return the scores of the first calls of choices, shape (choices, draws).

        The first call of every choice is made before the second of any, so that a small budget
        is spread over all.

        Raises
        ------
        SpentError
            When the budget is spent before all calls are made.
        """
        played = [self._as_played(choice) for choice in choices]
        for draw in range(draws):
            for choice in played:
                if len(self._scores.get(choice, ())) == draw:
                    self.again(choice)
        return np.array([self._scores[choice][:draws] for choice in played])

    def again(self, choice: OpenLoop) -> None:
        """Make one call more for a choice.

        Raises
        ------
        SpentError
            If the budget is spent.
        """
        scores = self._scores.setdefault(choice, [])
        scores.append(self._play(FrozenPolicy({self.target: choice}), len(scores)).score)

    def watch(self, policy: Policy, rng: np.random.Generator) -> bool:
        """Let a policy play under the first draws, and note what it chose; return if it succeeded.

        Played again, the same choice would do the same, so this is the first call of that choice.

        Raises
        ------
        SpentError
            If the budget is spent.
        """
        outcome = self._play(policy, 0, rng)
        if outcome.choice is not None:
            self._scores.setdefault(outcome.choice, [outcome.score])
        return outcome.success

    def standings(self) -> list[Standing]:
        """Return what is known of every choice, the most promising first."""
        known = [Standing(choice, tuple(scores)) for choice, scores in self._scores.items()]
        return sorted((each for each in known if each.scores), key=lambda each: -each.expected)

    def _as_played(self, choice: Choice | OpenLoop) -> OpenLoop:
        if isinstance(choice, Choice):
            assert choice.speed is not None  # a tube feeds in every environment
            choice = OpenLoop.at_one_speed(choice.sequence, choice.speed)
        return choice.as_played(self.env)

    def _play(self, policy: Policy, draw: int, rng: np.random.Generator | None = None) -> Outcome:
        if self.count == self.budget:
            raise SpentError
        self.count += 1
        if draw >= len(self._seeds):
            self._seeds = episode_seeds(self._stream, 2 * draw + 1)
        return play(policy, self.env, self.target, self._seeds[draw], rng)
