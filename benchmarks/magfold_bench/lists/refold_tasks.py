"""Find chains that fold into two words, one after the other.

Random chains are pushed out, pulled in and pushed out again at constant speeds, in draws of a
separate random stream. A chain that reaches two words is then tried with every pair of push speeds.
The two different words that one such pair reaches most often make a task if the chain reaches both
again in other draws. The ease of a task is the number of these draws in which it does so.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from magfold_bench.lists.feed_tasks import random_faces
from magfold_env.envs.baselines.legs import Following
from magfold_env.envs.baselines.three_speeds import PULLS, PUSHES, Speeds, push_pull_push
from magfold_env.envs.chains.arrays import FOLDED, Bools, Ints
from magfold_env.envs.reprogram import ReprogramEnv, ReprogramEpisodes
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.envs.tasks.feed_tasks import RefoldTask
from magfold_env.envs.tasks.goals import SUCCESS_TOLERANCE

SCENE = "reprogram"
AT_ONCE = 250
"""Number of chains tried in parallel."""

DRAWS = 6
OTHER_DRAWS = 24
LEAST = 3
"""Smallest number of other draws in which the chain must reach both words."""

Found = tuple[int, RefoldTask]


def find_refolds(direction: str, seed: int = 0, threads: int = 1) -> Iterator[Found]:
    """Yield tasks endlessly, each with the number of draws in which both words are reached."""
    rng = np.random.default_rng([seed, direction == "forward"])
    while True:
        chains = random_faces(rng, (AT_ONCE, 6))
        # The words do not matter yet.
        blank: Any = {"direction": direction, "first": "LRLRL", "target": "LRLRL"}
        tasks = [RefoldTask(sequence=tuple(each), **blank) for each in chains]
        middle = (PUSHES[1], PULLS[0], PUSHES[1])
        words = words_in_turn(tasks, [middle] * AT_ONCE, _seeds(0, AT_ONCE), threads)
        for task, pair in zip(tasks, words, strict=True):
            if all(pair):
                yield from _task(task, threads)


def _task(chain: RefoldTask, threads: int) -> list[Found]:
    """Return a list with the one task that a chain yields, or an empty list."""
    schedules = list(product(PUSHES, PULLS[:1], PUSHES))
    speeds = [each for each in schedules for _ in range(DRAWS)]
    seeds = _seeds(AT_ONCE, DRAWS) * len(schedules)
    words = words_in_turn([chain] * len(seeds), speeds, seeds, threads)
    keys = [(k // DRAWS, pair) for k, pair in enumerate(words)]
    counts = Counter(key for key in keys if all(key[1]) and key[1][0] != key[1][1])
    if not counts:
        return []
    (best, pair), _ = counts.most_common(1)[0]
    seeds = _seeds(AT_ONCE + DRAWS, OTHER_DRAWS)
    again = [schedules[best]] * len(seeds)
    count = words_in_turn([chain] * len(seeds), again, seeds, threads).count(pair)
    task = chain.model_copy(update={"first": pair[0], "target": pair[1]})
    return [(count, task)] if count >= LEAST else []


def words_in_turn(
    tasks: Sequence[RefoldTask], speeds: Sequence[Speeds], seeds: Sequence[int], threads: int = 1
) -> list[tuple[str, str]]:
    """Return the two words into which each chain folds, regardless of its task; "" for no word.

    There is no second word if there is no first word or the chain is not drawn in.
    """
    setup = ReprogramEnv.make_setup(SCENE, tasks=tasks)
    episodes = ReprogramEpisodes(setup, len(tasks), threads)
    episodes.rngs = [seeding.np_random(seed)[0] for seed in seeds]
    rows = episodes.rows
    episodes.begin(rows, list(rows))
    plan = Following([push_pull_push(setup.scene, each) for each in speeds])
    first, second = [""] * len(rows), [""] * len(rows)
    while len(rows):
        before = plan.at[rows]
        (asked,) = plan(episodes, rows)
        turned = plan.at[rows] != before
        right = (plan.at[rows] == 3) & episodes.is_in(rows)
        right |= (plan.at[rows] == 2) & episodes.is_last_held(rows) & _is_folded(episodes, rows)
        for row in rows[turned & right & (plan.at[rows] == 2)]:
            first[row] = str(episodes.words(np.array([row]))[0])
        on = ~turned | right | (plan.at[rows] == 1)
        rows, asked = rows[on], asked[on]
        episodes.step(rows, (asked,))
        over = episodes.terminated[rows]
        for row in rows[over & (plan.at[rows] == 3)]:
            if episodes.arrays.status[row] == FOLDED:
                second[row] = str(episodes.words(np.array([row]))[0])
        rows = rows[~over]
    return list(zip(first, second, strict=True))


def _is_folded(episodes: Any, rows: Ints) -> Bools:
    """Return whether every joint of each chain is at a right angle."""
    joints = np.diff(episodes.arrays.angles[rows], axis=1)
    return np.all(np.abs(np.abs(joints) - 0.5 * np.pi) <= SUCCESS_TOLERANCE, axis=1)


def _seeds(first: int, count: int) -> list[int]:
    """Return seeds of the stream that selects tasks."""
    return episode_seeds("reprogram", first + count)[first:]
