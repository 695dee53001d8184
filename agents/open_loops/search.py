"""The search for the best open loop of a task: episodes in which all play the same draws.

Which of many do best, within a budget of episodes, is found by successive halving: the better half
goes on and plays more (Jamieson and Talwalkar, *Non-stochastic best arm identification*, 2016).
Every round has about the same share of the budget.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from agents.open_loops.orders import Orders
from agents.open_loops.schedules import Schedules
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.feed_track import FeedTrackEnv
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.scoring.player import play

Trial = Callable[[Ints, int, int], Floats]
"""From some candidates, the first draw and the draw after the last to success and score of their
episodes, (candidates, draws, 2)."""


class Ranked(NamedTuple):
    """One of the candidates."""

    place: int
    """Among them, from 0."""
    successes: int
    """How many of its episodes succeeded: of the best a flattering share, for it was chosen."""
    draws: int
    """How many episodes it had."""


def rounds(candidates: int, budget: int) -> list[tuple[int, int]]:
    """Return how many candidates play in each round, and on how many more draws.

    Raises
    ------
    ValueError
        If the budget is too small for one more draw a round.
    """
    fields = [candidates]
    while fields[-1] > 2:
        fields.append((fields[-1] + 1) // 2)
    if sum(fields) > budget:
        raise ValueError(
            f"budget: {budget} is not allowed for {candidates} candidates; "
            f"must be {sum(fields)} or more"
        )
    found: list[tuple[int, int]] = []
    for number, field in enumerate(fields):
        draws = max(1, budget // (field * (len(fields) - number)))
        found.append((field, draws))
        budget -= field * draws
    return found


def halving(candidates: int, budget: int, trial: Trial) -> list[Ranked]:
    """Return some candidates, the best first, by share of successes, then by mean score.

    Those that went on come before the others; of equally good ones the first is preferred.
    `budget` is the most episodes, as in `rounds`.
    """
    field, ends = np.arange(candidates), np.zeros((candidates, 0, 2))
    out: list[Ranked] = []
    for places, draws in rounds(candidates, budget):
        out = _ranked(field[places:], ends[places:]) + out
        field, ends = field[:places], ends[:places]
        played = ends.shape[1]
        ends = np.concatenate([ends, trial(field, played, played + draws)], axis=1)
        success, score = -ends.mean(axis=1).T
        ranks = np.lexsort((field, score, success))
        field, ends = field[ranks], ends[ranks]
    return _ranked(field, ends) + out


def _ranked(field: Ints, ends: Floats) -> list[Ranked]:
    successes = ends[..., 0].sum(axis=1).astype(int).tolist()
    return [Ranked(*each, ends.shape[1]) for each in zip(field.tolist(), successes, strict=True)]


class Search(NamedTuple):
    """How much is tried."""

    candidates: int
    """Open loops."""
    budget: int
    """Episodes."""


def open_loops_of(env: Any) -> Any:
    """Return the open loops of a track's environment, `Schedules` or `Orders`."""
    return Schedules(env) if isinstance(env, FeedTrackEnv) else Orders(env)


class Field:
    """Room for episodes that are played by plans which see nothing of the chain.

    Parameters
    ----------
    episodes
        `CameraEpisodes`, as many as are played side by side.
    open_loops
        Those of their environment.
    actions
        How choices are written down, if that is to be told: of speeds the nearest on offer is fed.
    """

    def __init__(self, episodes: Any, open_loops: Any, actions: Any = None) -> None:
        self._episodes, self._open_loops, self._actions = episodes, open_loops, actions

    def search(self, number: int, stream: str, effort: Search) -> list[Ranked]:
        """Return what was tried in a task, by its number, the best first.

        Places are those among as many candidates. `stream` is that of the draws.
        """
        tried = self._open_loops.candidates(effort.candidates, number)
        return self.race(number, tried, stream, effort.budget)

    def race(
        self,
        number: int,
        tried: Sequence[Any],
        stream: str,
        budget: int,
        following: Callable[[Sequence[Any]], Plan] | None = None,
    ) -> list[Ranked]:
        """Return some open loops, tried in a task, the best first; see `halving`.

        They may be something else, if what is `following` them is given.
        """
        plan = following or self._open_loops.following

        def trial(candidates: Ints, start: int, stop: int) -> Floats:
            draws = stop - start
            seeds = episode_seeds(stream, stop)[start:] * len(candidates)
            found = [tried[place] for place in np.repeat(candidates, draws).tolist()]
            numbers = np.full(len(seeds), number)
            ends = self.play(numbers, seeds, lambda part: plan(found[part]))
            return ends.reshape(len(candidates), draws, 2)

        return halving(len(tried), budget, trial)

    def follow(self, numbers: Ints, seeds: list[int], found: Sequence[Any]) -> Floats:
        """Return success and score of episodes that are played by open loops, (m, 2).

        `numbers` are those of their tasks.
        """
        return self.play(numbers, seeds, lambda part: self._open_loops.following(found[part]))

    def play(self, numbers: Ints, seeds: list[int], plan: Callable[[slice], Plan]) -> Floats:
        """Return the same of episodes that are played by what `plan` returns for a part of them."""
        parts = play(self._episodes, numbers, seeds, lambda part: self._written(plan(part)))
        ends = [np.column_stack([part["is_success"], part["score"]]) for part in parts]
        return np.concatenate([np.empty((0, 2)), *ends])

    def _written(self, plan: Plan) -> Plan:
        """Return a plan whose choices are written down as actions, if that is to be."""
        actions = self._actions
        if actions is None:
            return plan
        return lambda episodes, rows: actions.read(actions.write(plan(episodes, rows)), len(rows))
