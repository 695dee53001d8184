from pathlib import Path
from typing import Any

import pytest

from agents.settings import SettingsError, TrainSettings, load_settings, save_settings
from agents.training.envs import check_envs, make_env
from magfold_env.envs.tasks.symmetry import side_of
from magfold_env.files import configs_dir

PRETRAINED = """
name: run
env: {components: 8, actions: box}
learner: {algorithm: tqc, ent_coef: auto, target_entropy: -2.5}
pretraining: [{timesteps: 100, env: {fidelity: quasistatic, shaping: energy}}]
stop: {success: 0.9, patience: 3}
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "run.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_all_shipped_settings_are_valid() -> None:
    files = list((configs_dir() / "agents").glob("*.yaml"))
    assert files
    for file in files:
        assert load_settings(file) == load_settings(file.stem) == load_settings(file.name)


@pytest.mark.parametrize("file", ["ppo-tube-feed", None])
def test_settings_survive_a_round_trip(tmp_path: Path, file: str | None) -> None:
    path = file or written(tmp_path, PRETRAINED)
    settings = load_settings(path, seed=5, timesteps=100)
    assert (settings.seed, settings.timesteps) == (5, 100)
    assert load_settings(path, seed=None) == load_settings(path)
    save_settings(settings, tmp_path / "settings.yaml")
    assert load_settings(tmp_path / "settings.yaml") == settings


FLOOR = "env: {id: MagFold/UnknownFloor-v0, actions: box}\n"


@pytest.mark.parametrize(("text", "message"), [
    ("timestep: 5", "timestep: 5 is not allowed; unknown key"),
    ("learner: {algorithm: ppo, lr: 0.1}", r"learner\.lr: 0.1 is not .*unknown key.* n_steps"),
    ("learner: {algorithm: sac, n_steps: 5}", r"learner\.n_steps: 5 is not .*unknown key"),
    ("learner: {algorithm: ppo, gamma: 1.5}", r"learner\.gamma: 1.5 is not .*less than"),
    ("learner: {algorithm: ppo, learning_rate: .nan}", r"learner\.learning_rate: nan is not"),
    ("learner: {algorithm: dqn}", "algorithm must be one of ppo, maskable-ppo, recurrent-ppo"),
    ("learner: {gamma: 0.9}", "algorithm must be one of ppo, maskable-ppo, recurrent-ppo"),
    ("learner: {algorithm: sac, ent_coef: low}", r"learner\.ent_coef: 'low' is not allowed"),
    ("env: {id: MagFold/Fold-v0}", r"env\.id: 'MagFold/Fold-v0' is not .*TubeFeed-v0"),
    ("env: {targets: 5}", r"env\.targets: 5 is not allowed"),
    ("env: {shaping: often}", r"env\.shaping: 'often' is not allowed; must be 'similarity'"),
    ("pretraining: [{timesteps: 0}]", r"pretraining\[0\]\.timesteps: 0 is not allowed"),
    ("learner: {algorithm: sac}", r"env\.actions: None is not .*must be 'box' with sac"),
    ("env: {actions: box}\nlearner: {algorithm: maskable-ppo}", r"env\.actions: 'box' is not"),
    (f"{FLOOR}learner: {{algorithm: maskable-ppo}}", r"env\.id: .*which magnets are chosen"),
    (f"{FLOOR}learner: {{algorithm: tqc, hindsight: {{}}}}", r"env\.id: .*'MagFold/TubeFeedGo"),
    (f"{FLOOR}learner: {{algorithm: ppo, features: mouth}}", r"env\.id: .* with features 'mo"),
    ("env: {actions: discrete}\nlearner: {algorithm: ppo, features: symmetric}",
     r"learner\.features: 'symmetric' is not allowed; must be 'chain' or 'mouth'"),
    ("learner: {algorithm: ppo, frames: 0}", r"learner\.frames: 0 is not .* greater than"),
    ("learner: {algorithm: ppo, shared_layers: true, features: symmetric}",
     r"learner\.shared_layers: True is not allowed; must be false with"),
    ("learner: {algorithm: recurrent-ppo, shared_layers: true}",
     r"learner\.shared_layers: True is not allowed; must be false with"),
    ("learner: {algorithm: ppo, view: canonical}", r"learner\.view: 'canonical' .* be 'own', exc"),
    ("learner: {algorithm: ppo, frames: 2, features: mouth}", r"learner\.frames: 2 .* be 1"),
    ("env: {id: MagFold/SequenceDesign-v0}\nlearner: {algorithm: ppo, blind: true}",
     r"learner\.blind: True .* with hindsight"),
    (f"{FLOOR}imitate: {{}}\nlearner: {{algorithm: sac}}",
     r"learner\.algorithm: 'sac' .*imitate"),
    ("imitate: {}", r"env\.id: .*, without pretraining, to imitate"),
    (f"{FLOOR}imitate: {{random: 1.0}}", r"imitate\.random: 1\.0 is not allowed"),
    ("env: {id: MagFold/Tray-v0}\nimitate: {plan: drawing back}",
     r"imitate\.plan: 'drawing back'.*a given chain"),
    (f"{FLOOR}imitate: {{plan: mending}}", r"imitate\.plan: 'mending' .*Anchor"),
    ("name: ../run", r"name: '\.\./run' is not allowed"),
    ("name: [", "line 1, column 8: expected the node content"),
])  # fmt: skip
def test_wrong_settings_name_key_value_and_remedy(tmp_path: Path, text: str, message: str) -> None:
    text = text if text.startswith("name") else f"name: run\n{text}"
    with pytest.raises(SettingsError, match=message):
        load_settings(written(tmp_path, text))


def test_no_training_sees_a_task_for_tests() -> None:
    found: list[str] = []
    for path in sorted((configs_dir() / "agents").glob("*.yaml")):
        settings = load_settings(path)
        # Validations, which choose the policy to keep, are played in the same environment.
        for phase in settings.phases:
            env: Any = make_env(phase.env).unwrapped
            if phase.env.id.startswith("MagFold/UnknownFloor-v1"):
                assert {side_of(task.sequence) for task in env.tasks} == {"train"}
                assert len(env.tasks) == 2000
                found.append(settings.name)
    assert found == ["ppo-unknown-floor-v1"]


@pytest.mark.parametrize(("settings", "message"), [
    ({"env": {"targets": ["LLLLL"]}}, r"^env: targets"),
    ({"env": {"id": "MagFold/TubeFeedGoal-v0", "reward": "score"}}, "^env: reward: must be"),
    ({"pretraining": [{"timesteps": 1, "env": {"components": 5}}]},
     r"^pretraining\[0\]\.env: its observation_space .* must be that of the main phase"),
    ({"pretraining": [{"timesteps": 1, "env": {"scene": "nowhere"}}]},
     r"^pretraining\[0\]\.env: .*nowhere"),
])  # fmt: skip
def test_wrong_environments_are_named(settings: dict, message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        check_envs(TrainSettings.model_validate({"name": "run"} | settings))


def test_any_setting_can_be_assigned(tmp_path: Path) -> None:
    assignments = ["learner.gamma=0.5", "env.targets=[LRLLL]", "stop.success = 0.7", "envs=3"]
    settings = load_settings(written(tmp_path, "name: run\nlearner: {algorithm: ppo}"), assignments)
    assert settings.learner.gamma == 0.5
    assert settings.env.targets == ("LRLLL",)
    assert settings.stop.success == 0.7
    assert settings.envs == 3


@pytest.mark.parametrize(("assignment", "message"), [
    ("seed", "'seed' is not allowed; must be a key and a value"),
    ("name.first=a", "name is not a group of settings"),
    ("seed=[", r"'seed=\[' is not allowed; its value: line 1, column 2: expected the node"),
    ("learner.beta=1", r"learner\.beta: 1 is not allowed; unknown key"),
])  # fmt: skip
def test_a_wrong_assignment_is_named(assignment: str, message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        load_settings("ppo-tube-feed", [assignment])
