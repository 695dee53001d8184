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

from agents.admission import script
from agents.open_loops.search import Ranked, RolloutPool, Search, open_loops_of
from agents.training import drawing_back, policy_files
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
    def chains(self) -> list[int]:
        """The chain or tray of each played task, numbered from 0."""
        places: dict[Any, int] = {}
        parts = [self.env.tasks[number].parts for number in self.numbers]
        return [places.setdefault(each, len(places)) for each in parts]

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
def own_track(env_id: str, tasks: int | None) -> AdmissionTrack:
    """Return a track that the current process creates once and reuses."""
    return AdmissionTrack(env_id, tasks)


RANDOM, FORWARD, SCRIPT, OPEN_LOOP = "random", "always forward", "script", "open loop"
ORACLE, TRAINED, BLIND = "oracle", "trained", "trained blind"


def tune_script(track: AdmissionTrack, effort: Search, start: int, stop: int) -> list[int]:
    """Return the place of the script's settings, which are tuned on training tasks, in a list.

    There is one script for all tasks, so the range is from 0 to 1.
    """
    training = replace(track, tasks=None, split="train", stream=SEARCH)
    return [script.tuned(training, effort)] * (stop - start)


def play_simple(
    track: AdmissionTrack, open_loops: dict[int, Any], place: int | None, start: int, stop: int
) -> list[dict[str, list[float]]]:
    """Return the success and score of players that learn nothing, for a range of episodes.

    `place` is the index of the script's settings among its candidates, or None without a script.
    """
    numbers, seeds = track.draws(start, stop)
    listed, pool = numbers.tolist(), track.pool
    ends = {
        RANDOM: pool.play(
            numbers, seeds, lambda part: _at_random(track, listed[part], seeds[part])
        ),
        FORWARD: pool.follow(numbers, seeds, [track.open_loops.fastest] * len(seeds)),
        OPEN_LOOP: pool.follow(numbers, seeds, [open_loops[number] for number in listed]),
    }
    if place is not None:
        found = script.candidates(track.env, place + 1)[place]
        ends[SCRIPT] = pool.play(
            numbers, seeds, lambda part: drawing_back.playing([found] * len(seeds[part]))
        )
    return [{name: each[k].tolist() for name, each in ends.items()} for k in range(len(seeds))]


def search(track: AdmissionTrack, effort: Search, start: int, stop: int) -> list[list[Ranked]]:
    """Return the open loops tried for each task of a range, the best first."""
    return [track.pool.search(number, SEARCH, effort) for number in track.numbers[start:stop]]


def play_oracle(
    track: AdmissionTrack, best: dict[int, list[Any]], budget: int, start: int, stop: int
) -> list[list[float]]:
    """Return the success and score of `ORACLE`, for a range of episodes."""
    found: list[list[float]] = []
    for episode in range(start, stop):
        numbers, seeds = track.draws(episode, episode + 1)
        number = int(numbers[0])
        tried = track.open_loops.raced(best[number], number, track.drawn(episode)[1])
        pool = RolloutPool(copied_episodes(track, episode, WIDTH), track.open_loops)
        winner = tried[pool.race(0, tried, copies(episode), budget)[0].place]
        found.append(track.pool.follow(numbers, seeds, [winner])[0].tolist())
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

    `kind` is `TRAINED` or `BLIND`.

    Raises
    ------
    ValueError
        If the policy belongs to another environment.
    """
    numbers, seeds = track.draws(start, stop)
    shown = saved.shown.model_copy(update={"blind": saved.shown.blind or kind == BLIND})
    env, episodes = track.env_of(saved.policy.action_space), track.episodes(len(seeds))
    plan = Player(saved.policy, shown, env, len(seeds)).plan(env)
    (ends,) = play(episodes, numbers, seeds, lambda _: plan)
    return np.column_stack([ends["is_success"], ends["score"]]).tolist()


@cache
def own_policy(path: str) -> SavedPolicy:
    """Return a trained policy that the current process loads once and reuses."""
    torch.set_num_threads(1)
    return policy_files.load(path)


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
