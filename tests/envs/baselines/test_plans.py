"""Tests that a baseline's plan can be played and reaches the stored score."""

from functools import partial
from typing import Any
from unittest.mock import Mock

import gymnasium
import numpy as np
import pytest

import magfold_env.envs  # noqa: F401
from magfold_env.envs.baselines import baseline, constant_speed, three_speeds, tray_order
from magfold_env.envs.camera_track import TIME_COST
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.scoring.track import TRACKS, TRAYS

SHIPPED = [env_id for env_id in TRACKS if env_id.endswith("-v0")]
"""Tracks whose baselines the package contains."""


@pytest.mark.medium
@pytest.mark.parametrize("env_id", SHIPPED)
def test_it_scores_what_is_stored(env_id: str) -> None:
    env: Any = gymnasium.make(env_id).unwrapped
    draws = env.episodes.baselines(env.setup).draws[1]
    numbers = [3] * draws + [len(env.tasks) - 1] * draws
    episodes = env.make_episodes(env.setup, len(numbers), 2)
    seeds = episode_seeds("scoring", draws) * 2
    ends = episodes.play(seeds, numbers, partial(env.plan_of(numbers), episodes))
    for part, number in ((slice(None, draws), 3), (slice(draws, None), numbers[-1])):
        found = env.baseline_of(number)
        assert ends["score"][part].mean() == pytest.approx(found.score, abs=1e-12)
        assert ends["is_success"][part].mean() == pytest.approx(found.success, abs=1e-12)


@pytest.mark.parametrize("env_id", SHIPPED)
def test_those_of_shipped_tasks_are_shipped(env_id: str, tmp_path: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr(baseline, "user_cache_path", lambda _name: tmp_path)
    env: Any = gymnasium.make(env_id).unwrapped
    found = [env.baseline_of(number) for number in range(len(env.tasks))]
    assert not list(tmp_path.iterdir())
    for each, task in zip(found, env.tasks, strict=True):
        if env_id in TRAYS:
            assert task.order_of(each.sequence or ()) is not None
        assert len(each.later) == (2 if env_id == "MagFold/Reprogram-v0" else 0)
        assert env_id != "MagFold/Lumen-v0" or 0.0 < each.score < 1.0


@pytest.mark.medium
@pytest.mark.parametrize("env_id", TRACKS)
def test_one_that_is_computed_is_what_its_schedule_scores(env_id, tmp_path, monkeypatch):
    monkeypatch.setattr(baseline, "user_cache_path", lambda _name: tmp_path)
    for store in (constant_speed.TaskStore, three_speeds.ThreeSpeedStore):
        monkeypatch.setattr(store, "draws", (3, 4))
    monkeypatch.setattr(constant_speed, "SPEEDS", (0.1, 0.3))
    monkeypatch.setattr(three_speeds, "PUSHES", (0.1, 0.4))
    options = {"reward": "relative", "difficulty": 0.05, "speeds": 2}
    env: Any = gymnasium.make(env_id, **options).unwrapped
    found, row = env.baseline_of(0), np.array([0])
    assert found.speed is not None
    scores = []
    for seed in episode_seeds("scoring", 4):
        env.reset(seed=seed, options={"task": 0})
        episodes, plan = env.episodes, env.plan_of([0])
        rewards, ends, before, time = np.zeros(1), {}, 0.0, 0.0
        while not ends:
            rewards, ends = episodes.step(row, plan(episodes, row))
            before, (time,) = time, episodes.times(row)
        scores.append(ends["score"][0])
        assert ends["baseline"] == found.score
        assert not ends["baseline_missing"]
        cost = TIME_COST * (time - before)
        assert rewards == pytest.approx(scores[-1] - found.score - cost)
    assert found.score == pytest.approx(np.mean(scores))
    assert gymnasium.make(env_id, **options).unwrapped.baseline_of(0) == found  # pyright: ignore[reportAttributeAccessIssue]


def test_that_there_is_no_design_is_kept_too(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(baseline, "user_cache_path", lambda _name: tmp_path)
    for searched in (Mock(return_value=[]), Mock(side_effect=AssertionError("searched again"))):
        monkeypatch.setattr(tray_order.TrayStore, "candidates", searched)
        env: Any = gymnasium.make("MagFold/Tray-v0", speeds=2).unwrapped
        assert env.baseline_of(0).flagged
