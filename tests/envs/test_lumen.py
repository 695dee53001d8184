"""Tests of `Lumen`: a chain folds in a random chamber that observations do not show."""

from typing import Any

import gymnasium
import numpy as np
import pytest

from magfold_bench.laws.overlap import deepest_overlap
from magfold_bench.lists.feed_tasks import words_at_speeds
from magfold_env.envs.lumen import LumenEnv


@pytest.mark.medium
def test_chains_meet_their_own_chambers_and_no_others() -> None:
    env: Any = gymnasium.make_vec("MagFold/Lumen-v0", num_envs=32).unwrapped
    env.reset(seed=0)
    scenes = [env.episodes.scene(row) for row in range(32)]
    arrays, own, others = env.episodes.arrays, [], []
    ended = np.zeros(32, dtype=bool)
    while not ended.any():
        _, _, ended, _, _ = env.step(np.full((32, 1), 0.5, dtype=np.float32))
        for row in np.flatnonzero(~ended).tolist():
            state = arrays.angles[row], arrays.base[row], int(arrays.released[row].sum())
            own.append(deepest_overlap(scenes[row], *state))
            moved = scenes[row].replace(obstacles=scenes[row - 1].obstacles)
            others.append(deepest_overlap(moved, *state))
    assert max(own) < 2e-4
    assert max(others) > 1e-3


@pytest.mark.slow
def test_the_shipped_tasks_take_several_speeds() -> None:
    env = LumenEnv()
    assert len(env.tasks) <= 24
    assert len({task.sequence for task in env.tasks}) == len(env.tasks)
    words = words_at_speeds(list(env.tasks), 2, range(8, 72), env.scene)  # not those of the choice
    came = words == np.array([task.target for task in env.tasks])[:, None, None]
    best, some = came.mean(axis=1).max(axis=1), came.any(axis=2).mean(axis=1)
    # The figures of the page.
    assert best.mean() == pytest.approx(0.54, abs=0.02)
    assert some.mean() == pytest.approx(0.67, abs=0.02)
    assert (some - best > 0.01).all()
