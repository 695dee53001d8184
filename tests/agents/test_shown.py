"""Tests that networks receive the same observations in training and in play."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.wrappers import FrameStackObservation

from agents.evaluation import episodes
from agents.evaluation.policies import make_policy
from agents.settings import TrainSettings
from agents.training import policy_files
from agents.training.envs import envs_state, make_training_envs, set_envs_state
from agents.training.models import make_model
from magfold_env.scoring.observation_view import TASK, blind
from tests.agents.training import tiny

FLOOR = "MagFold/UnknownFloor-v0"


def both(**shown: Any) -> tuple[Any, Any]:
    """Return equal environments of two chains, unchanged and with observations for networks."""
    one, other = (tiny(own=each, envs=2) for each in ({}, shown))
    return make_training_envs(one, 0), make_training_envs(other, 0)


@pytest.mark.parametrize("blinded", [False, True])
def test_the_last_observations_are_shown_and_the_first_stands_for_those_before(blinded):
    plain, shown = both(frames=3, blind=blinded)
    layout = plain.get_attr("layout")[0]
    seen = plain.reset()
    frames = [[each] * 3 for each in seen]

    def expected(kept: Any) -> Any:
        return blind(layout, np.array(kept)) if blinded else np.array(kept)

    np.testing.assert_array_equal(shown.reset(), expected(frames))
    ends = 0
    for _ in range(8):
        actions = np.array([plain.action_space.sample() for _ in frames])
        seen, _, over, infos = plain.step(actions)
        stacked, _, same, told = shown.step(actions)
        np.testing.assert_array_equal(over, same)
        for row, each in enumerate(frames):
            if over[row]:
                ends += 1
                last = [*each[1:], infos[row]["terminal_observation"]]
                np.testing.assert_array_equal(told[row]["terminal_observation"], expected(last))
            each[:] = [seen[row]] * 3 if over[row] else [*each[1:], seen[row]]
        np.testing.assert_array_equal(stacked, expected(frames))
    assert ends >= 2


def test_in_the_canonical_view_only_the_newest_observation_states_the_task() -> None:
    env = {"id": FLOOR, "actions": "discrete"}
    single: Any
    stacked: Any
    single, stacked = (
        make_training_envs(tiny(own={"view": "canonical", "frames": each}, env=env, envs=1), 0)
        for each in (1, 3)
    )
    layout = single.get_attr("layout")[0]
    task = np.concatenate([np.arange(layout.size)[layout.slices[name]] for name in TASK])
    kept = [single.reset()] * 3
    shown, ends = stacked.reset(), 0
    for _ in range(300):
        np.testing.assert_array_equal(shown[:, 2], kept[2])
        assert kept[2][:, task].any()
        for older, own in zip((shown[:, 0], shown[:, 1]), kept, strict=False):
            assert not older[:, task].any()
            np.testing.assert_array_equal(np.delete(older, task, 1), np.delete(own, task, 1))
        action = np.array([10])
        seen, _, over, infos = single.step(action)
        shown, _, _, told = stacked.step(action)
        if over[0]:
            ends += 1
            last = told[0]["terminal_observation"]
            np.testing.assert_array_equal(last[2], infos[0]["terminal_observation"])
            assert not last[:2, task].any()
        kept = [seen] * 3 if over[0] else [*kept[1:], seen]
    assert ends >= 2


def test_what_was_shown_belongs_to_the_state() -> None:
    _, shown = both(frames=3)
    shown.reset()
    actions = np.array([shown.action_space.sample() for _ in range(2)])
    shown.step(actions)
    state = envs_state(shown)
    first = shown.step(actions)[0]
    set_envs_state(shown, state)
    np.testing.assert_array_equal(shown.step(actions)[0], first)


def untrained(settings: TrainSettings, path: Path) -> Any:
    """Write an untrained policy; return its model."""
    model = make_model(settings.learner, make_training_envs(settings, 0), 0)
    policy_files.save(model, path, settings.learner)
    return model


@pytest.mark.parametrize("env_id", ["MagFold/TubeFeed-v0", FLOOR])
@pytest.mark.parametrize("algorithm", ["ppo", "recurrent-ppo"])
def test_a_policy_that_plays_is_shown_what_its_file_says(algorithm, env_id, tmp_path):
    fidelity = {} if env_id == FLOOR else {"fidelity": "quasistatic", "components": 4}
    env = {"id": env_id, "actions": "discrete", **fidelity}
    settings = tiny(algorithm, own={"frames": 3}, env=env)
    model = untrained(settings, tmp_path / "policy.safetensors")
    policy = make_policy(str(tmp_path / "policy.safetensors"))
    env = episodes.make_env(settings.env)
    stacked = FrameStackObservation(episodes.make_env(settings.env), 3)
    rng = np.random.default_rng(0)
    for seed in range(2):
        env.reset(seed=seed)
        act = policy(env, env.episodes.numbers.tolist(), [rng])
        seen, _ = stacked.reset(seed=seed)
        ended, steps, memory = False, 0, None
        while not ended and steps < 20:
            (action,) = act(env.episodes, np.array([0]))
            best, memory = model.predict(seen, memory, deterministic=True)
            assert action == best
            _, _, ended, _, _ = env.step(action)
            seen, *_ = stacked.step(action)
            steps += 1


def test_a_policy_trained_blind_plays_blind(tmp_path: Path) -> None:
    seeing, blinded = (
        tiny("maskable-ppo", own={"frames": 2, "blind": each}) for each in (False, True)
    )
    paths = tmp_path / "seeing.safetensors", tmp_path / "blind.safetensors"
    for settings, path in zip((seeing, blinded), paths, strict=True):
        untrained(settings, path)
    names = [f"no-motion:{paths[0]}", str(paths[1]), f"no-motion:{paths[1]}", f"blind:{paths[0]}"]
    env = episodes.make_env(seeing.env)
    target = env.targets[0]
    outcomes = [
        [episodes.play(make_policy(name), env, target, seed) for seed in range(4)] for name in names
    ]
    assert all(each == outcomes[0] for each in outcomes)
