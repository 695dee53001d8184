"""The contestants of the admission rule, and how each plays episodes of an `Arena`.

``docs/evaluation.md`` describes them. The draws of reported results have their own stream, which
neither searches nor training use. What sets a task's baseline is in `magfold_env.envs.baselines`,
and open loops are in `agents.open_loops`. The oracle knows an episode's hidden physics, not its
start nor its noise: it races the open loops that came farthest in the task's search, with trays
half of them and as many chosen for the strengths of the episode, on copies that differ from it in
start and noise, then plays the best.
"""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any
from zlib import crc32

import numpy as np
import torch

from agents.open_loops.search import Field, Ranked, Search, open_loops_of
from agents.training import policy_files
from agents.training.policy_files import SavedPolicy
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Ints
from magfold_env.scene import Scene
from magfold_env.scoring.player import Player, play
from magfold_env.scoring.track import WIDTH, Track

EVALUATION = "admission"
"""Stream of the draws of reported results."""

SEARCH = "admission search"
"""Stream of the draws that select open loops."""


def copies(episode: int) -> str:
    """Return the stream of the draws on which the oracle tries an episode's physics."""
    return f"admission copies {episode}"


@dataclass(frozen=True)
class Arena(Track):
    """A track on the draws of `EVALUATION`, and further data for contestants."""

    stream: str = field(default=EVALUATION, kw_only=True)

    @cached_property
    def open_loops(self) -> Any:
        """What can be chosen beforehand."""
        return open_loops_of(self.env)

    def ranked(self, count: int, number: int, best: list[Ranked]) -> list[Any]:
        """Return the best of a number of open loops of a task."""
        tried = self.open_loops.candidates(count, number)
        return [tried[each.place] for each in best]

    @cached_property
    def field(self) -> Field:
        """Reusable episodes of these tasks, made once."""
        return Field(self.episodes(WIDTH), self.open_loops)

    def drawn(self, episode: int) -> tuple[Scene, Any]:
        """Return scene and task of an episode, with all that is drawn of them."""
        numbers, seeds = self.draws(episode, episode + 1)
        self.env.reset(seed=seeds[0], options={"task": int(numbers[0])})
        return self.open_loops.drawn()


@cache
def own_arena(env_id: str, tasks: int, randomised: bool = True) -> Arena:
    """Return this process's own arena, made once."""
    return Arena(env_id, tasks, randomised)


def replaying(chosen: Sequence[Sequence[Any]]) -> Plan:
    """Return a plan that plays choices made earlier, one per step, and repeats the last one.

    `chosen` contains the choices of every row, in the form of `World.actions` for one row.
    """
    taken = np.zeros(len(chosen), dtype=np.int64)

    def plan(_: Any, rows: Ints) -> Any:
        now = [chosen[row][min(int(taken[row]), len(chosen[row]) - 1)] for row in rows.tolist()]
        taken[rows] += 1
        return tuple(np.array(part) for part in zip(*now, strict=True))

    return plan


RANDOM, FORWARD, BASELINE, OPEN_LOOP = "random", "always forward", "baseline", "open loop"
ORACLE, SAME_DRAW = "oracle", "oracle, same draw"
TRAINED, DRAWN = "trained", "trained, drawn"
FROZEN, BLIND = "frozen", "trained blind"

SIMPLE = (RANDOM, FORWARD, BASELINE, OPEN_LOOP)
"""Contestants that play an episode without preparation."""


def play_simple(
    arena: Arena, open_loops: dict[int, Any], start: int, stop: int
) -> list[list[list[float]]]:
    """Return success and score of every contestant of `SIMPLE` in some episodes."""
    numbers, seeds = arena.draws(start, stop)
    listed, field = numbers.tolist(), arena.field
    ends = {
        RANDOM: field.play(
            numbers, seeds, lambda part: _at_random(arena, listed[part], seeds[part])
        ),
        FORWARD: field.follow(numbers, seeds, [arena.open_loops.fastest] * len(seeds)),
        BASELINE: field.play(numbers, seeds, lambda part: arena.env.plan_of(listed[part])),
        OPEN_LOOP: field.follow(numbers, seeds, [open_loops[number] for number in listed]),
    }
    return np.stack([ends[name] for name in SIMPLE], axis=1).tolist()


def search(arena: Arena, effort: Search, start: int, stop: int) -> list[list[Ranked]]:
    """Return what has been tried in each of some tasks, the best first."""
    return [arena.field.search(number, SEARCH, effort) for number in arena.numbers[start:stop]]


def play_oracle(
    arena: Arena, best: dict[int, list[Any]], budget: int, start: int, stop: int
) -> list[list[list[float]]]:
    """Return success and score of `ORACLE` and `SAME_DRAW` in each of some episodes."""
    found: list[list[list[float]]] = []
    for episode in range(start, stop):
        numbers, seeds = arena.draws(episode, episode + 1)
        number = int(numbers[0])
        tried = arena.open_loops.raced(best[number], number, arena.drawn(episode)[1])
        field = Field(copied_episodes(arena, episode, WIDTH), arena.open_loops)
        winner = field.race(0, tried, copies(episode), budget)[0]
        ends = arena.field.follow(np.repeat(numbers, len(tried)), seeds * len(tried), tried)
        found.append([ends[winner.place].tolist(), max(ends.tolist())])
    return found


def copied_episodes(arena: Arena, episode: int, count: int) -> Any:
    """Return copies of an episode with its physics and new draws of start and noise."""
    scene, task = arena.drawn(episode)
    found = arena.episodes(count, arena.env.make_world(scene, tasks=[task]))
    found.chains.drive_as(scene)
    return found


def play_policy(
    arena: Arena, saved: SavedPolicy, kind: str, start: int, stop: int
) -> list[list[float]]:
    """Return success and score of a policy in some episodes.

    `kind` is `TRAINED`, `DRAWN`, `FROZEN` or `BLIND`.

    Raises
    ------
    ValueError
        If the policy belongs to another environment.
    """
    numbers, seeds = arena.draws(start, stop)
    if kind == FROZEN:
        chosen = {number: _rehearsed(arena, saved, number) for number in set(numbers.tolist())}
        of_each = [chosen[number] for number in numbers.tolist()]
        return arena.field.play(numbers, seeds, lambda part: replaying(of_each[part])).tolist()
    if kind == BLIND:
        saved = replace(saved, shown=saved.shown.model_copy(update={"blind": True}))
    torch.manual_seed(start)
    return _play(arena, saved, numbers, seeds, kind == DRAWN)[0]


@cache
def own_policy(path: str) -> SavedPolicy:
    """Return this process's own copy of a trained policy, loaded once."""
    torch.set_num_threads(1)
    return policy_files.load(path)


def _play(
    arena: Arena, saved: SavedPolicy, numbers: Ints, seeds: Sequence[int], sampled: bool = False
) -> tuple[list[list[float]], list[Any]]:
    """Return success and score of a policy in episodes, and its choices in the first one."""
    env, episodes = arena.env_of(saved.policy.action_space), arena.episodes(len(seeds))
    plan = Player(saved.policy, saved.shown, env, len(seeds), sampled).plan(env)
    first: list[Any] = []

    def noted(episodes: Any, rows: Ints) -> Any:
        choice = plan(episodes, rows)
        if rows[0] == 0:
            first.append([part[0] for part in choice])
        return choice

    (ends,) = play(episodes, numbers, seeds, lambda _: noted)
    return np.column_stack([ends["is_success"], ends["score"]]).tolist(), first


def _rehearsed(arena: Arena, saved: SavedPolicy, number: int) -> list[Any]:
    """Return the choices of a policy in an episode of a task without random draws."""
    still = Arena(arena.env_id, arena.tasks, randomised=False)
    return _play(still, saved, np.array([number]), [0])[1]


def _at_random(arena: Arena, numbers: Sequence[int], seeds: Sequence[int]) -> Plan:
    """Return a plan that draws actions uniformly, separately for each row."""
    own: list[Any] = []
    for number, seed in zip(numbers, seeds, strict=True):
        key = (1, crc32(arena.world.words[number].encode()))
        sequence = np.random.SeedSequence(seed, spawn_key=key)
        own.append(deepcopy(arena.env.action_space))
        own[-1].seed(int(sequence.generate_state(1)[0]))

    def plan(_: Any, rows: Ints) -> Any:
        actions = np.array([own[row].sample() for row in rows.tolist()])
        return arena.world.actions.read(actions, len(rows))

    return plan
