"""The players of the admission rule, and how each of them plays the episodes of a track.

``docs/evaluation.md`` describes them. No search and no training uses the random stream that draws
the episodes of reported results. Baselines of tasks are in `magfold_env.envs.baselines`, and open
loops are in `agents.open_loops`. The oracle knows an episode's hidden physics but neither its start
nor its noise. It tries open loops on copies of the episode with another start and other noise, then
plays the best one. It tries those that the task's search found best; in tasks with trays, half of
them are instead chosen for the strengths of the episode's magnets.
"""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any
from zlib import crc32

import numpy as np
import torch

from agents.open_loops.search import Ranked, RolloutPool, Search, open_loops_of
from agents.training import policy_files
from agents.training.policy_files import SavedPolicy
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Ints
from magfold_env.scene import Scene
from magfold_env.scoring.player import Player, play
from magfold_env.scoring.track import WIDTH, Track

EVALUATION = "admission"
"""Name of the random stream that draws the episodes of reported results."""

SEARCH = "admission search"
"""Name of the random stream that draws the episodes of the search for open loops."""


def copies(episode: int) -> str:
    """Return the name of the random stream for the oracle's copies of an episode."""
    return f"admission copies {episode}"


@dataclass(frozen=True)
class AdmissionTrack(Track):
    """A track with the draws of `EVALUATION` and further data that players need."""

    stream: str = field(default=EVALUATION, kw_only=True)

    @cached_property
    def open_loops(self) -> Any:
        """The open loops of the environment, `Schedules` or `Orders`."""
        return open_loops_of(self.env)

    def ranked(self, count: int, number: int, best: list[Ranked]) -> list[Any]:
        """Return the open loops that `best` ranks among a task's first `count` candidates."""
        tried = self.open_loops.candidates(count, number)
        return [tried[each.place] for each in best]

    @cached_property
    def pool(self) -> RolloutPool:
        """Episodes of the track's tasks, which are created once and reused."""
        return RolloutPool(self.episodes(WIDTH), self.open_loops)

    def drawn(self, episode: int) -> tuple[Scene, Any]:
        """Return an episode's scene and task, including all randomly drawn values."""
        numbers, seeds = self.draws(episode, episode + 1)
        self.env.reset(seed=seeds[0], options={"task": int(numbers[0])})
        return self.open_loops.drawn()


@cache
def own_track(env_id: str, tasks: int, randomised: bool = True) -> AdmissionTrack:
    """Return a track that the current process creates once and reuses."""
    return AdmissionTrack(env_id, tasks, randomised)


def replaying(chosen: Sequence[Sequence[Any]]) -> Plan:
    """Return a plan that plays choices made earlier, one per step, and repeats the last one.

    `chosen` contains every row's choices, each in the form that `Setup.actions` reads for a row.
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
"""Players that need no preparation for an episode."""


def play_simple(
    track: AdmissionTrack, open_loops: dict[int, Any], start: int, stop: int
) -> list[list[list[float]]]:
    """Return the success and score of every player in `SIMPLE`, for a range of episodes."""
    numbers, seeds = track.draws(start, stop)
    listed, pool = numbers.tolist(), track.pool
    ends = {
        RANDOM: pool.play(
            numbers, seeds, lambda part: _at_random(track, listed[part], seeds[part])
        ),
        FORWARD: pool.follow(numbers, seeds, [track.open_loops.fastest] * len(seeds)),
        BASELINE: pool.play(numbers, seeds, lambda part: track.env.plan_of(listed[part])),
        OPEN_LOOP: pool.follow(numbers, seeds, [open_loops[number] for number in listed]),
    }
    return np.stack([ends[name] for name in SIMPLE], axis=1).tolist()


def search(track: AdmissionTrack, effort: Search, start: int, stop: int) -> list[list[Ranked]]:
    """Return the open loops tried for each task of a range, the best first."""
    return [track.pool.search(number, SEARCH, effort) for number in track.numbers[start:stop]]


def play_oracle(
    track: AdmissionTrack, best: dict[int, list[Any]], budget: int, start: int, stop: int
) -> list[list[list[float]]]:
    """Return the success and score of `ORACLE` and `SAME_DRAW`, for a range of episodes."""
    found: list[list[list[float]]] = []
    for episode in range(start, stop):
        numbers, seeds = track.draws(episode, episode + 1)
        number = int(numbers[0])
        tried = track.open_loops.raced(best[number], number, track.drawn(episode)[1])
        pool = RolloutPool(copied_episodes(track, episode, WIDTH), track.open_loops)
        winner = pool.race(0, tried, copies(episode), budget)[0]
        ends = track.pool.follow(np.repeat(numbers, len(tried)), seeds * len(tried), tried)
        found.append([ends[winner.place].tolist(), max(ends.tolist())])
    return found


def copied_episodes(track: AdmissionTrack, episode: int, count: int) -> Any:
    """Return copies of an episode with the same physics, but new draws of start and noise."""
    scene, task = track.drawn(episode)
    found = track.episodes(count, track.env.make_setup(scene, tasks=[task]))
    found.chains.drive_as(scene)
    return found


def play_policy(
    track: AdmissionTrack, saved: SavedPolicy, kind: str, start: int, stop: int
) -> list[list[float]]:
    """Return the success and score of a policy in a range of episodes.

    `kind` is `TRAINED`, `DRAWN`, `FROZEN` or `BLIND`.

    Raises
    ------
    ValueError
        If the policy belongs to another environment.
    """
    numbers, seeds = track.draws(start, stop)
    if kind == FROZEN:
        chosen = {number: _rehearsed(track, saved, number) for number in set(numbers.tolist())}
        of_each = [chosen[number] for number in numbers.tolist()]
        return track.pool.play(numbers, seeds, lambda part: replaying(of_each[part])).tolist()
    if kind == BLIND:
        saved = replace(saved, shown=saved.shown.model_copy(update={"blind": True}))
    torch.manual_seed(start)
    return _play(track, saved, numbers, seeds, kind == DRAWN)[0]


@cache
def own_policy(path: str) -> SavedPolicy:
    """Return a trained policy that the current process loads once and reuses."""
    torch.set_num_threads(1)
    return policy_files.load(path)


def _play(
    track: AdmissionTrack,
    saved: SavedPolicy,
    numbers: Ints,
    seeds: Sequence[int],
    sampled: bool = False,
) -> tuple[list[list[float]], list[Any]]:
    """Return a policy's success and score in episodes, and its choices in the first one."""
    env, episodes = track.env_of(saved.policy.action_space), track.episodes(len(seeds))
    plan = Player(saved.policy, saved.shown, env, len(seeds), sampled).plan(env)
    first: list[Any] = []

    def noted(episodes: Any, rows: Ints) -> Any:
        choice = plan(episodes, rows)
        if rows[0] == 0:
            first.append([part[0] for part in choice])
        return choice

    (ends,) = play(episodes, numbers, seeds, lambda _: noted)
    return np.column_stack([ends["is_success"], ends["score"]]).tolist(), first


def _rehearsed(track: AdmissionTrack, saved: SavedPolicy, number: int) -> list[Any]:
    """Return a policy's choices in an episode of a task in which nothing is randomised."""
    still = AdmissionTrack(track.env_id, track.tasks, randomised=False)
    return _play(still, saved, np.array([number]), [0])[1]


def _at_random(track: AdmissionTrack, numbers: Sequence[int], seeds: Sequence[int]) -> Plan:
    """Return a plan that draws actions uniformly, separately for each row."""
    own: list[Any] = []
    for number, seed in zip(numbers, seeds, strict=True):
        key = (1, crc32(track.setup.words[number].encode()))
        sequence = np.random.SeedSequence(seed, spawn_key=key)
        own.append(deepcopy(track.env.action_space))
        own[-1].seed(int(sequence.generate_state(1)[0]))

    def plan(_: Any, rows: Ints) -> Any:
        actions = np.array([own[row].sample() for row in rows.tolist()])
        return track.setup.actions.read(actions, len(rows))

    return plan
