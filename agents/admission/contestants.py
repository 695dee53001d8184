"""Who is compared by the rule of admission, and how each plays some episodes of an `Arena`.

================= ================================================================================
random            actions drawn evenly
always forward    the highest speed
baseline          plays what sets the task's baseline b, chosen on draws of its own: the best
                  constant speed (`magfold_env.envs.baselines.constant_speed`), or of two words the
                  best of three speeds (`magfold_env.envs.baselines.three_speeds`)
open loop         of many schedules the one that is best for the task, by successive halving on
                  draws of its own, the same for all tasks; the constant speeds are among them
oracle            knows an episode's hidden physics, not its start nor its noise: races the
                  schedules that came farthest in the task's search on copies that differ from the
                  episode in these, then plays the best
oracle, same draw the best of the same schedules on the very episode, which nobody can know
trained           policies, which play the most probable action
trained, drawn    the same, which draw their actions as in training
frozen            their actions of one episode in which nothing is drawn, replayed
trained blind     policies that were trained without motion, shown none, as
                  `magfold_env.scoring.shown.blind` has it
================= ================================================================================
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple
from zlib import crc32

import numpy as np
import torch

from agents.admission.arena import SEARCH, Arena, Field, copies
from agents.admission.halving import Ranked, halving
from agents.admission.schedules import Schedule, constant
from agents.training import policy_files
from agents.training.policy_files import SavedPolicy
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.feed_track import FeedEpisodes
from magfold_env.envs.spaces.actions import FASTEST
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.scoring.player import Player, choices
from magfold_env.scoring.track import WIDTH

RANDOM, FORWARD, BASELINE, OPEN_LOOP = "random", "always forward", "baseline", "open loop"
ORACLE, SAME_DRAW = "oracle", "oracle, same draw"
TRAINED, DRAWN = "trained", "trained, drawn"
FROZEN, BLIND = "frozen", "trained blind"

SIMPLE = (RANDOM, FORWARD, BASELINE, OPEN_LOOP)
"""Those of which an episode is all it takes."""


class Search(NamedTuple):
    """How much is tried."""

    candidates: int
    """Schedules."""
    budget: int
    """Episodes."""


def search(arena: Arena, number: int, effort: Search) -> list[Ranked]:
    """Return a task's schedules, by its number: the first is its open loop."""
    tried = arena.schedules(effort.candidates, number)
    return _race(arena.field, number, tried, SEARCH, effort.budget)


def play_simple(
    arena: Arena, open_loops: dict[int, Schedule], start: int, stop: int
) -> list[list[list[float]]]:
    """Return success and score of every one of `SIMPLE` in each of some episodes."""
    numbers, seeds = arena.draws(start, stop)
    listed, field = numbers.tolist(), arena.field
    drawn = [_at_random(arena, *each) for each in zip(listed, seeds, strict=True)]
    ends = {
        RANDOM: field.feed(numbers, seeds, np.array(drawn)),
        FORWARD: field.follow(numbers, seeds, [constant(FASTEST)] * len(seeds)),
        BASELINE: field.play(numbers, seeds, lambda part: arena.env.plan_of(listed[part])),
        OPEN_LOOP: field.follow(numbers, seeds, [open_loops[number] for number in listed]),
    }
    return np.stack([ends[name] for name in SIMPLE], axis=1).tolist()


def play_oracle(
    arena: Arena, best: dict[int, list[Schedule]], budget: int, episode: int
) -> list[list[float]]:
    """Return success and score of `ORACLE` and `SAME_DRAW` in an episode."""
    numbers, seeds = arena.draws(episode, episode + 1)
    tried = best[int(numbers[0])]
    field = Field(copied_episodes(arena, episode, WIDTH))
    winner = _race(field, 0, tried, copies(episode), budget)[0]
    ends = arena.field.follow(np.repeat(numbers, len(tried)), seeds * len(tried), tried)
    return [ends[winner.place].tolist(), max(ends.tolist())]


def copied_episodes(arena: Arena, episode: int, count: int) -> FeedEpisodes:
    """Return room for copies of an episode: its physics, with start and noise drawn anew."""
    scene = arena.drawn_scene(episode)
    found = arena.episodes(count, type(arena.world)(scene, tasks=[arena.env.task]))
    found.chains.drawn.drive_as(scene)
    return found


def play_policy(
    arena: Arena, saved: SavedPolicy, kind: str, start: int, stop: int
) -> list[list[float]]:
    """Return success and score of a policy in each of some episodes.

    `kind` is `TRAINED`, `DRAWN`, `FROZEN` or `BLIND`.

    Raises
    ------
    ValueError
        If it is of another environment.
    """
    numbers, seeds = arena.draws(start, stop)
    if kind == FROZEN:
        speeds = {number: _rehearsed(arena, saved, number) for number in set(numbers.tolist())}
        table = np.array([speeds[number] for number in numbers.tolist()])
        return arena.field.feed(numbers, seeds, table).tolist()
    if kind == BLIND:
        saved = replace(saved, shown=saved.shown.model_copy(update={"blind": True}))
    torch.manual_seed(start)
    return _play(arena, saved, numbers, seeds, kind == DRAWN)[1]


@cache
def own_policy(path: str) -> SavedPolicy:
    """Return this process's own copy of a trained policy, loaded once."""
    torch.set_num_threads(1)
    return policy_files.load(path)


def _play(
    arena: Arena, saved: SavedPolicy, numbers: Ints, seeds: Sequence[int], sampled: bool = False
) -> tuple[FeedEpisodes, list[list[float]]]:
    """Return episodes that a policy has played, with success and score of each."""
    env, episodes = arena.env_of(saved.policy.action_space), arena.episodes(len(seeds))
    player = Player(saved.policy, saved.shown, env, len(seeds), sampled)
    choose = choices(player, env, episodes)
    ends = episodes.play(seeds, numbers.tolist(), choose)
    return episodes, np.column_stack([ends["is_success"], ends["score"]]).tolist()


def _rehearsed(arena: Arena, saved: SavedPolicy, number: int) -> Floats:
    """Return the speeds of a policy where nothing is drawn [m/s], the last one kept."""
    still = Arena(arena.env_id, arena.tasks, randomised=False)
    episodes, _ = _play(still, saved, np.array([number]), [0])
    driven = episodes.driven[0, : int(episodes.steps[0])]
    return np.pad(driven, (0, arena.horizon - driven.size), mode="edge")


def _race(
    field: Field, number: int, tried: Sequence[Schedule], stream: str, budget: int
) -> list[Ranked]:
    def trial(candidates: Ints, start: int, stop: int) -> Floats:
        draws = stop - start
        seeds = episode_seeds(stream, stop)[start:] * len(candidates)
        found = [tried[place] for place in np.repeat(candidates, draws).tolist()]
        ends = field.follow(np.full(len(seeds), number), seeds, found)
        return ends.reshape(len(candidates), draws, 2)

    return halving(len(tried), budget, trial)


def _at_random(arena: Arena, number: int, seed: int) -> Floats:
    """Return the speeds that actions drawn evenly ask for [m/s]."""
    key = (1, crc32(arena.world.words[number].encode()))
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
    actions = rng.uniform(-1.0, 1.0, (arena.horizon, 1)).astype(np.float32)
    return arena.world.actions.read(actions, arena.horizon)[0]
