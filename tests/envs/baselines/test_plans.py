"""What sets a baseline can be played, and scores what is stored."""

from functools import partial
from typing import Any

import gymnasium
import pytest

import magfold_env.envs  # noqa: F401
from magfold_env.envs.baselines import baseline, constant_speed, three_speeds, tray_order
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.scoring.track import TRACKS, TRAYS

DRAWS = {
    constant_speed.ConstantSpeedStore: constant_speed.SCORING_DRAWS,
    three_speeds.ThreeSpeedStore: three_speeds.SCORING_DRAWS,
    tray_order.TrayStore: tray_order.SCORING_DRAWS,
}


@pytest.mark.medium
@pytest.mark.parametrize("env_id", TRACKS)
def test_it_scores_what_is_stored(env_id: str) -> None:
    env: Any = gymnasium.make(env_id).unwrapped
    store = env.episodes.baselines(env.world)
    draws = next(count for kind, count in DRAWS.items() if isinstance(store, kind))
    numbers = [3] * draws + [len(env.tasks) - 1] * draws
    episodes = env.make_episodes(env.world, len(numbers), 2)
    seeds = episode_seeds("scoring", draws) * 2
    ends = episodes.play(seeds, numbers, partial(env.plan_of(numbers), episodes))
    for part, number in ((slice(None, draws), 3), (slice(draws, None), numbers[-1])):
        found = env.baseline_of(number)
        assert ends["score"][part].mean() == pytest.approx(found.score, abs=1e-12)
        assert ends["is_success"][part].mean() == pytest.approx(found.success, abs=1e-12)


@pytest.mark.parametrize("env_id", TRACKS)
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
