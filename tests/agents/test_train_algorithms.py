"""Tests that every algorithm trains in the environments that it supports."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO

from agents.settings import EnvSettings, StopSettings, load_settings
from agents.training import policy_files
from agents.training.envs import check_envs, make_env, make_training_envs
from agents.training.folder import RunInfo
from agents.training.models import LearningRate, Progress, make_model
from agents.training.run import Validation, train
from magfold_env.files import configs_dir
from magfold_env.scoring.track import TRACKS
from tests.agents.training import LEARNERS, records, tiny, weights

FLOOR = {"id": "MagFold/UnknownFloor-v0", "actions": "box"}
RUNS = [
    *(pytest.param(tiny(name), id=name) for name in LEARNERS),
    *(pytest.param(tiny(name, True), id=f"{name} with hindsight") for name in ("sac", "tqc")),
    *(
        pytest.param(tiny(name, env=FLOOR), id=f"{name} on a track")
        for name in ("recurrent-ppo", "sac", "tqc")
    ),
]


@pytest.mark.medium
@pytest.mark.train
@pytest.mark.parametrize("settings", RUNS)
def test_a_run_changes_the_networks_and_leaves_its_files(settings, tmp_path):
    settings = settings.model_copy(update={"timesteps": 240})
    policy = train(settings, tmp_path)
    envs = make_training_envs(settings, 0)
    untrained = make_model(settings.learner, envs, settings.seed).policy.state_dict()
    envs.close()
    trained = weights(policy)
    assert trained.keys() == untrained.keys()
    assert any(not torch.equal(trained[name], untrained[name]) for name in trained)
    assert (tmp_path / "best.safetensors").is_file()
    assert load_settings(tmp_path / "settings.yaml") == settings
    info: Any = RunInfo.read(tmp_path)
    assert info.algorithm == settings.learner.algorithm
    assert info.steps >= 240
    assert info.made["torch"] == torch.__version__
    written = records(tmp_path)
    assert "validation/success_rate" in written
    # On a track no episode need have ended.
    assert "rollout/ep_rew_mean" in written or settings.env.id in TRACKS


@pytest.mark.medium
@pytest.mark.train
def test_a_masked_policy_takes_what_can_be_built(tmp_path: Path) -> None:
    settings = tiny("maskable-ppo")
    policy: Any = policy_files.load(train(settings, tmp_path)).policy
    env = make_env(settings.env)
    masks = env.get_wrapper_attr("action_masks")()
    observation, _ = env.reset(seed=0)
    for _ in range(50):
        action, _ = policy.predict(observation, action_masks=masks)
        assert masks[int(action[0])]


# Easy targets are told from hard ones by counting, which takes seconds for chains of eight.
SHIPPED = [
    pytest.param(file.stem, marks=pytest.mark.slow if "curriculum" in file.stem else ())
    for file in sorted((configs_dir() / "agents").glob("*.yaml"))
]


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_settings_make_their_environments_and_learner(name: str) -> None:
    settings = load_settings(name)
    check_envs(settings)
    envs = make_training_envs(settings, len(settings.phases) - 1)
    model = make_model(settings.learner, envs, 0)
    assert model.action_space == envs.action_space


def test_the_bonus_of_entropy_falls_over_a_run(tmp_path: Path, monkeypatch: Any) -> None:
    used: list[tuple[int, float]] = []

    def update(model: PPO) -> None:
        used.append((model.num_timesteps, model.ent_coef))

    monkeypatch.setattr(PPO, "train", update)
    settings = tiny("ppo", own={"ent_coef": 0.1, "anneal_entropy": True})
    train(settings, tmp_path)
    assert len(used) > 1
    rollout = used[0][0]
    for steps, weight in used:  # as the rollout began
        assert weight == pytest.approx(0.1 * (1 - (steps - rollout) / settings.timesteps))


def test_a_rate_falls_to_zero_over_its_phase_and_not_beyond() -> None:
    rate = LearningRate(0.1, anneal=True, start=300, end=500)
    remaining = [1 - steps / 500 for steps in (300, 400, 500, 510)]
    np.testing.assert_allclose([rate(share) for share in remaining], [0.1, 0.05, 0.0, 0.0])
    assert LearningRate(0.1, anneal=False, start=300, end=500)(0.1) == 0.1


def test_a_phase_stops_when_it_is_good_enough_or_no_longer_gets_better() -> None:
    def result(success: float, score: float = 0.5) -> dict[str, float]:
        return {"success_rate": success, "score": score}

    progress = Progress()
    stop = StopSettings(success=0.9, patience=2)
    bests = [progress.note(r, stop) for r in (result(0.2), result(0.2, 0.6), result(0.2))]
    assert bests == [True, True, False]
    assert not progress.stopping
    progress.note(result(0.1), stop)
    assert progress.stopping
    progress.next_phase(100)
    assert not progress.stopping
    assert progress.note(result(0.95), stop)
    assert progress.stopping


@pytest.mark.train
def test_a_phase_that_is_good_enough_hands_over_to_the_next(tmp_path: Path) -> None:
    before = {"timesteps": 5000, "env": {"match": "outline"}, "stop": {"success": 0.0}}
    train(tiny(pretraining=[before], timesteps=100), tmp_path)
    info: Any = RunInfo.read(tmp_path)
    assert info.steps < 400


def test_phases_differ_in_what_they_say_and_have_their_own_seeds() -> None:
    settings = tiny(pretraining=[{"timesteps": 10, "env": {"match": "outline", "speeds": 5}}])
    first, main = settings.phases
    assert first.timesteps == 10
    assert main.env == settings.env
    assert first.env == settings.env.model_copy(update={"match": "outline", "speeds": 5})
    settings = tiny(pretraining=[{"timesteps": 10}], envs=2)
    drawn = []
    for phase in (0, 1, 1):
        envs = make_training_envs(settings, phase)
        drawn.append([np.asarray(envs.reset()).tolist() for _ in range(5)])
    assert drawn[0] != drawn[1] == drawn[2]


def test_validation_plays_the_same_draws_every_time() -> None:
    settings = tiny("ppo", env={"targets": ["LRLLL", "RLRRR"], "fidelity": "quasistatic"})
    model = make_model(settings.learner, make_training_envs(settings, 0), 0)
    validation = Validation(settings.env, 4, settings.learner)
    result = validation(model)
    assert set(result) == {"success_rate", "score"}
    assert result == validation(model) == Validation(settings.env, 4, settings.learner)(model)


def test_options_that_are_not_given_are_the_environments_own() -> None:
    assert EnvSettings().options() == {}
    assert EnvSettings(baseline=False).options() == {"baseline": None}
    assert EnvSettings(shaping=True).unshaped().options() == {}
