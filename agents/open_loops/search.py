"""The search for the best open loop of a task: all candidates play the same draws.

Successive halving finds the best candidates within a budget of episodes: in every round, the better
half plays more episodes (Jamieson and Talwalkar, *Non-stochastic best arm identification*, 2016).
Every round gets about the same share of the budget.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from agents.open_loops.orders import Orders
from agents.open_loops.schedules import Schedules
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.camera_track import FeedTrackEnv
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.scoring.player import play

Trial = Callable[[Ints, int, int], Floats]
"""A function that plays candidates on a range of draws, given by its first draw and the draw after
its last. It returns the success and score of the episodes, (candidates, draws, 2)."""


class Ranked(NamedTuple):
    """A candidate and its results in a search."""

    place: int
    """Index of the candidate, from 0."""
    successes: int
    """Number of successful episodes; the best candidate's share of successes is optimistic."""
    draws: int
    """Number of episodes played."""


def rounds(candidates: int, budget: int) -> list[tuple[int, int]]:
    """Return, for each round, the number of candidates and the number of new draws for each.

    Raises
    ------
    ValueError
        If the budget is too small for one draw per candidate and round.
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
    """Rank candidates by share of successes, then by mean score; return them, the best first.

    Candidates that played in more rounds come before the others, and of equally good candidates,
    the first is preferred. `budget` is the largest number of episodes, as in `rounds`.
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
    """The effort of a search, as the numbers of open loops and of episodes."""

    candidates: int
    """Number of open loops."""
    budget: int
    """Number of episodes."""


def open_loops_of(env: Any) -> Any:
    """Return the open loops of a track's environment, `Schedules` or `Orders`."""
    return Schedules(env) if isinstance(env, FeedTrackEnv) else Orders(env)


@dataclass(frozen=True)
class RolloutPool:
    """Reusable episodes for plans that do not observe the chain."""

    episodes: Any
    """`CameraEpisodes`, as many as are played in parallel."""
    open_loops: Any
    """The open loops of the episodes' environment."""
    actions: Any = None
    """Kind of actions in which choices are expressed, so that they have the nearest available
    speed; None leaves choices unchanged."""

    def search(self, number: int, stream: str, effort: Search) -> list[Ranked]:
        """Return the candidates tried in the task with this number, the best first.

        Places are indices among `effort.candidates` candidates; `stream` names the draws' stream.
        """
        tried = self.open_loops.candidates(effort.candidates, number)
        return self.race(number, tried, stream, effort.budget)

    def race(
        self,
        number: int,
        tried: Sequence[Any],
        stream: str,
        budget: int,
        following: Callable[[Sequence[Any]], Plan] | None = None,
    ) -> list[Ranked]:
        """Try some open loops in a task and return their ranks, the best first; see `halving`.

        `tried` may contain other objects if `following` returns the plan that plays them.
        """
        plan = following or self.open_loops.following

        def trial(candidates: Ints, start: int, stop: int) -> Floats:
            draws = stop - start
            seeds = episode_seeds(stream, stop)[start:] * len(candidates)
            found = [tried[place] for place in np.repeat(candidates, draws).tolist()]
            numbers = np.full(len(seeds), number)
            ends = self.play(numbers, seeds, lambda part: plan(found[part]))
            return ends.reshape(len(candidates), draws, 2)

        return halving(len(tried), budget, trial)

    def follow(self, numbers: Ints, seeds: list[int], found: Sequence[Any]) -> Floats:
        """Return the success and score of episodes played by open loops, (m, 2).

        `numbers` contains the numbers of the tasks.
        """
        return self.play(numbers, seeds, lambda part: self.open_loops.following(found[part]))

    def play(self, numbers: Ints, seeds: list[int], plan: Callable[[slice], Plan]) -> Floats:
        """Return the success and score of episodes played by the plans that `plan` returns."""

        def written(part: slice) -> Plan:
            own, table = plan(part), self.actions
            if table is None:
                return own
            return lambda episodes, rows: table.read(table.write(own(episodes, rows)), len(rows))

        parts = play(self.episodes, numbers, seeds, written)
        ends = [np.column_stack([part["is_success"], part["score"]]) for part in parts]
        return np.concatenate([np.empty((0, 2)), *ends])
