import importlib
import json
from pathlib import Path

import pytest
import typer
from PIL import Image
from typer.testing import CliRunner

from agents.evaluate import compare
from agents.settings import EnvSettings

runner = CliRunner()


def test_the_comparison_writes_numbers_and_a_gif(tmp_path: Path) -> None:
    settings = EnvSettings(targets=("LRLLL", "RLRRR"))
    results = compare([], settings, draws=2, processes=1, folder=tmp_path)
    assert list(results) == ["random", "minimiser"]
    assert all(len(outcomes) == 4 for outcomes in results.values())
    content = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert content["policies"]["minimiser"]["success"]["trials"] == 4
    with Image.open(tmp_path / "folds.gif") as gif:
        assert getattr(gif, "n_frames", 1) > 10


def test_policies_are_compared_on_the_same_draws(tmp_path: Path) -> None:
    settings = EnvSettings(targets=("LRLLL",))
    results = compare([], settings, draws=2, processes=1, folder=tmp_path)
    scenes = [[outcome.scene for outcome in outcomes] for outcomes in results.values()]
    for first, second in zip(*scenes, strict=True):
        assert first is not None
        assert second is not None
        assert first.friction == second.friction
        assert first.start_angles == second.start_angles


@pytest.mark.parametrize("module", ["train", "evaluate"])
def test_a_wrong_name_ends_with_a_message_and_not_a_traceback(module: str) -> None:
    app = typer.Typer()
    app.command()(importlib.import_module(f"agents.{module}").main)
    arguments = ["no-such"] if module == "train" else ["--config", "no-such"]
    result = runner.invoke(app, arguments)
    assert result.exit_code == 1
    assert "no-such: no such file" in result.output
