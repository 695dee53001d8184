"""RLlib trains in the same environment, with the settings of `agents.train`."""

from pathlib import Path

import pytest

pytest.importorskip("ray.rllib", reason="needs RLlib, see docs/training.md")

import typer
from typer.testing import CliRunner

from agents.rllib_example import main, ppo_config
from agents.settings import SettingsError, load_settings, save_settings
from tests.agents.training import tiny

# Ray leaves sockets and files to be closed by the collector, and warns of its own old names.
pytestmark = [pytest.mark.train, pytest.mark.slow, pytest.mark.filterwarnings("default")]

app = typer.Typer()
app.command()(main)


def test_settings_are_told_in_rllibs_words() -> None:
    settings = tiny(envs=3, timesteps=500)
    learner = settings.learner.model_copy(update={"anneal": True, "learning_rate": 0.01})
    config = ppo_config(settings.model_copy(update={"learner": learner}))
    assert config.env == "MagFold/TubeFeed-v0"
    own = {"id": config.env, "gamma": 1.0}
    assert config.env_config == {"fidelity": "quasistatic", "components": 3, **own}
    assert config.train_batch_size == 24 * 3
    assert config.lr == [[0, 0.01], [500, 0.0]]


def test_rllib_trains_and_leaves_a_checkpoint(tmp_path: Path) -> None:
    settings = tiny(timesteps=100, envs=2)
    save_settings(settings, tmp_path / "run.yaml")
    output = tmp_path / "out"
    result = CliRunner().invoke(app, [str(tmp_path / "run.yaml"), "--output", str(output)])
    assert result.exit_code == 0, result.output
    assert "144/100 steps, mean return" in result.output
    assert (output / "rllib_checkpoint.json").is_file()


def test_other_learners_are_refused() -> None:
    with pytest.raises(SettingsError, match=r"learner\.algorithm: 'sac' is not allowed; must be p"):
        ppo_config(load_settings("sac-tube-feed"))
