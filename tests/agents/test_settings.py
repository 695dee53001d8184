from pathlib import Path

import pytest

from agents.settings import SettingsError, load_settings, save_settings
from magfold_env.files import configs_dir


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "run.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_all_shipped_settings_are_valid() -> None:
    files = list((configs_dir() / "agents").glob("*.yaml"))
    assert files
    for file in files:
        assert load_settings(file) == load_settings(file.stem) == load_settings(file.name)


def test_settings_survive_a_round_trip(tmp_path: Path) -> None:
    settings = load_settings("ppo-tube-feed", seed=5, timesteps=100)
    assert (settings.seed, settings.timesteps) == (5, 100)
    save_settings(settings, tmp_path / "settings.yaml")
    assert load_settings(tmp_path / "settings.yaml") == settings


def test_an_override_of_none_leaves_the_file_alone() -> None:
    assert load_settings("ppo-tube-feed", seed=None) == load_settings("ppo-tube-feed")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name: run\ntimestep: 5", "timestep: 5 is not allowed; unknown key"),
        ("name: run\nppo: {lr: 0.1}", "ppo.lr: 0.1 is not allowed; unknown key"),
        ("name: run\nppo: {gamma: 1.5}", "ppo.gamma: 1.5 is not allowed; must be less than"),
        ("name: run\nppo: {learning_rate: .nan}", "ppo.learning_rate: nan is not allowed"),
        ("name: run\nenv: {speeds: 1}", "env.speeds: 1 is not allowed; must be greater than"),
        ("name: run\nenv: {randomisation: wild}", "env.randomisation: 'wild' is not allowed"),
        ("name: run\ntimesteps: -1", "timesteps: -1 is not allowed; must be greater than"),
        ("name: run\ndevice: tpu", "device: 'tpu' is not allowed; must be 'cpu'"),
        ("name: ../run", "name: '../run' is not allowed"),
        ("timesteps: 5", "name: None is not allowed; must be given"),
        ("- 1", r"\[1\] is not allowed; must be a mapping"),
        ("name: [", "not YAML"),
    ],
)
def test_wrong_settings_name_key_value_and_remedy(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        load_settings(written(tmp_path, text))


def test_a_missing_file_lists_what_is_shipped() -> None:
    with pytest.raises(SettingsError, match=r"ppo-tub: no such file; .*ppo-tube-feed"):
        load_settings("ppo-tub")
