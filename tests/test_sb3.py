"""Tests that the adapter and Stable-Baselines3's own vector environments agree."""

from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from sb3_contrib import MaskablePPO
from sb3_contrib.common.maskable.utils import get_action_masks
from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import DummyVecEnv

from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.envs.tube_feed_goal import TubeFeedGoalEnv
from magfold_env.envs.unknown_floor import UnknownFloorEnv
from magfold_env.sb3 import FoldVecEnv, make_sb3_vec
from tests.envs.vectors import same

QUICK: dict[str, Any] = {"fidelity": "quasistatic", "components": 3}
FEED, GOAL = "MagFold/TubeFeed-v0", "MagFold/TubeFeedGoal-v0"
FLOOR = "MagFold/UnknownFloor-v1"


@pytest.mark.parametrize(
    ("env_id", "single", "options"),
    [(FEED, TubeFeedEnv, QUICK), (GOAL, TubeFeedGoalEnv, QUICK), (FLOOR, UnknownFloorEnv, {})],
)
def test_it_says_what_stable_baselines_own_say(env_id: str, single: Any, options: Any) -> None:
    native = make_sb3_vec(env_id, 3, **options)
    other = make_vec_env(single, 3, seed=4, env_kwargs=options, vec_env_cls=DummyVecEnv)
    native.seed(4)
    assert same(native.reset(), other.reset())
    assert same(native.venv.reset_infos, other.reset_infos)
    native.action_space.seed(0)
    for _ in range(10):
        actions = np.array([native.action_space.sample() for _ in range(3)])
        told, expected = native.step(actions), other.step(actions)
        assert same(told[:3], expected[:3])
        for one, two in zip(told[3], expected[3], strict=True):
            episodes = [info.pop("episode", {}) for info in (one, two)]
            assert same(one, two)
            assert episodes[0].get("l") == episodes[1].get("l")
            assert episodes[0].get("r", 0.0) == pytest.approx(episodes[1].get("r", 0.0), abs=1e-5)
        assert same(native.venv.reset_infos, other.reset_infos)


def test_targets_are_given_as_options() -> None:
    env = make_sb3_vec(FEED, 2, **QUICK)
    env.set_options({"target": "LR"})
    env.reset()
    assert [info["target"] for info in env.venv.reset_infos] == ["LR", "LR"]
    env.set_options([{"target": "LR"}, {"target": "RR"}])
    env.reset()
    assert [info["target"] for info in env.venv.reset_infos] == ["LR", "RR"]
    floor = make_sb3_vec(FLOOR, 2)
    floor.set_options([{"task": 3}, {"task": 5}])
    floor.reset()
    tasks = floor.get_attr("tasks")[0]
    wanted = [tasks[number].target for number in (3, 5)]
    assert [info["target"] for info in floor.venv.reset_infos] == wanted
    env.set_options([{"target": "LR"}, {}])
    with pytest.raises(ValueError, match="must be the same for all environments, or a 'target'"):
        env.reset()


def test_it_needs_the_autoreset_mode_of_stable_baselines() -> None:
    vector: Any = gymnasium.make_vec(FEED, autoreset_mode=AutoresetMode.NEXT_STEP, **QUICK)
    with pytest.raises(ValueError, match=r"NEXT_STEP is not allowed; must be SAME_STEP"):
        FoldVecEnv(vector)


def test_attributes_are_those_of_an_environment() -> None:
    env = make_sb3_vec(FEED, 2, **QUICK)
    assert env.get_attr("targets", indices=[1]) == [("LL", "LR", "RL", "RR")]
    assert not env.has_attr("colour")
    assert env.env_is_wrapped(gymnasium.Wrapper) == [False, False]
    with pytest.raises(NotImplementedError, match="targets: cannot be set"):
        env.set_attr("targets", ("LL",))


@pytest.mark.train
def test_masks_reach_the_learner() -> None:
    env = make_sb3_vec(FEED, 2, catalogue=["NSNS", "SSNN"], **QUICK)
    MaskablePPO("MlpPolicy", env, n_steps=32, batch_size=32, n_epochs=1, seed=0).learn(64)
    masks = get_action_masks(env)
    assert masks.shape == (2, 25)
    assert masks[:, :16].sum() == 4


def test_masks_that_change_are_those_of_each_environment() -> None:
    env = make_sb3_vec("MagFold/Tray-v0", 3)
    env.reset()
    env.step(np.array([[row, 0, 4, 0] for row in range(3)]))
    masks = get_action_masks(env)
    np.testing.assert_array_equal(masks[:, :9], ~np.eye(3, 9, dtype=bool))
    assert not masks[:, -1].any()


@pytest.mark.medium
@pytest.mark.train
@pytest.mark.parametrize("make", [gymnasium.make, partial(make_sb3_vec, num_envs=2)])
def test_hindsight_replay_relabels_goals(make: Callable[..., Any]) -> None:
    env = make(GOAL, actions="box", **QUICK)
    model = SAC(
        "MultiInputPolicy", env, replay_buffer_class=HerReplayBuffer, learning_starts=60,
        batch_size=16, seed=0,
    )  # fmt: skip
    model.learn(120)
    buffer: Any = model.replay_buffer
    rewards = buffer.sample(512).rewards.numpy()
    assert set(np.unique(rewards)) == {-1.0, 0.0}
    # A success is rare in random actions, not among relabelled goals.
    assert np.mean(rewards == 0.0) > 0.2
