import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest
import torch
import typer
from typer.testing import CliRunner

from agents import one_file_ppo

FILE = Path(one_file_ppo.__file__)

app = typer.Typer()
app.command()(one_file_ppo.main)


def test_it_can_be_copied_away() -> None:
    tree = ast.parse(FILE.read_text(encoding="utf-8"))
    named = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    plain = [node.names for node in ast.walk(tree) if isinstance(node, ast.Import)]
    named += [name.name for names in plain for name in names]
    others = {name.partition(".")[0] for name in named} - set(sys.stdlib_module_names)
    assert others == {"gymnasium", "magfold_env", "numpy", "rich", "torch", "typer"}


@pytest.mark.medium
@pytest.mark.train
def test_the_seed_decides_the_weights(tmp_path: Path) -> None:
    weights: list[dict[str, torch.Tensor]] = []
    for name in ("one", "two"):
        options = ["--steps", "0", "--draws", "1", "--energy-steps", "3000", "--seed", "3"]
        result = CliRunner().invoke(app, [*options, "--output", str(tmp_path / name)])
        assert result.exit_code == 0, result.output
        assert re.search(r"greedy, held-out draws: \d+ % \(\d+–\d+\)", result.output)
        weights.append(torch.load(tmp_path / name, weights_only=True))
    one, two = weights
    assert all(torch.equal(one[name], two[name]) for name in one)


@pytest.mark.train
@pytest.mark.slow
def test_it_folds_95_per_cent_of_six_components() -> None:
    # However long its steps take on a busy machine.
    run = subprocess.run(
        [sys.executable, FILE, "--minutes", "60"], capture_output=True, text=True, check=True
    )
    found = re.search(r"held-out draws: (\d+) %", run.stdout)
    assert found is not None
    assert int(found[1]) >= 95
