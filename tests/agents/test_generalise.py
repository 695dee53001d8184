import json
from pathlib import Path

import pytest
import typer
import yaml
from typer.testing import CliRunner

from agents.generalise import Fold, deal, main, settings_of, summary
from magfold_env.shapes import folded_words, mirror

WORDS = list(folded_words(5))
TINY = {
    "name": "tiny",
    "env": {"fidelity": "quasistatic"},
    "learner": {"algorithm": "ppo", "hidden": [8], "n_steps": 12, "batch_size": 12},
    "timesteps": 48,
    "validation_episodes": 2,
}


def test_every_word_is_held_out_once() -> None:
    dealt = deal(WORDS, 5)
    assert sorted(word for fold in dealt for word in fold) == sorted(WORDS)
    assert max(map(len, dealt)) - min(map(len, dealt)) <= 2
    assert all({mirror(word) for word in fold} == set(fold) for fold in dealt)
    assert deal(WORDS, 5) == dealt


def test_what_is_held_out_is_not_trained_on() -> None:
    held = deal(WORDS, 2)[1]
    settings = settings_of("ppo-floor-8", [], 5, held, 1)
    assert settings.seed == 1
    assert set(settings.env.targets or ()) == set(WORDS) - set(held)


def test_what_is_lost_is_taken_word_by_word() -> None:
    found = [
        Fold({"LL": 0.5, "LR": 1.0}, {"LS": 1.0, "SL": 0.6}, ""),
        Fold({"LS": 0.9, "SL": 0.0}, {"LL": 0.7, "LR": 1.0}, ""),
    ]
    rows = summary(found, {"LL": 0.0, "LR": 1.0, "LS": 1.0, "SL": 0.0})
    assert float(rows["held out"].value) == pytest.approx(0.6)
    assert float(rows["seen"].value) == pytest.approx(0.825)
    assert float(rows["lost"].value) == pytest.approx(0.225)
    assert float(rows["ahead of it, held out"].value) == pytest.approx(0.1)
    low, high = float(rows["lost"].low), float(rows["lost"].high)
    assert 0.0 <= low < 0.225 < high <= 0.6


@pytest.mark.medium
def test_the_command_trains_plays_and_goes_on(tmp_path: Path) -> None:
    config = tmp_path / "tiny.yaml"
    config.write_text(yaml.safe_dump(TINY), encoding="utf-8")
    app = typer.Typer()
    app.command()(main)
    arguments = [str(config), "--components", "4", "--folds", "2", "--draws", "2"]
    arguments += ["--processes", "1", "--against", "random", "--output", str(tmp_path / "runs")]
    first = CliRunner().invoke(app, arguments)
    assert first.exit_code == 0, first.output
    trained = (tmp_path / "runs" / "fold-1" / "policy.safetensors").stat().st_mtime_ns
    content = json.loads((tmp_path / "runs" / "generalise.json").read_text(encoding="utf-8"))
    held = [word for fold in content["figures"]["folds"] for word in fold["held"]]
    assert sorted(held) == sorted(folded_words(4))
    assert set(content["figures"]["other"]) == set(held)
    again = CliRunner().invoke(app, arguments)
    assert again.exit_code == 0, again.output
    assert (tmp_path / "runs" / "fold-1" / "policy.safetensors").stat().st_mtime_ns == trained


def test_bad_settings_are_told(tmp_path: Path) -> None:
    app = typer.Typer()
    app.command()(main)
    arguments = ["--set", "learner.algorithm=dqn", "--output", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2
    assert "dqn" in result.output
