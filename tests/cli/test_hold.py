"""`magfold hold`: what it prints, what it writes, and what it refuses."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import magfold_env as mf
from tests.command_line import fails_in_one_line, rows, run

SCENE = "paper/sequence-3"


def test_it_shows_and_writes_what_holding_returns(tmp_path: Path) -> None:
    data, png = tmp_path / "holding.json", tmp_path / "holding.png"
    angles = ("--angle", 90, "--angle", 300)
    result = run("hold", SCENE, *angles, "--json", data, "--png", png)
    assert result.exit_code == 0, result.stderr
    found = mf.holding(mf.simulate(mf.load_scene(SCENE)), directions=np.radians([90.0, 300.0]))
    shown = rows(result.stdout)
    assert shown[0] == ["1", "L", "none", "7.079", "-30.23"]
    assert shown[5] == ["90°", f"{np.degrees(found.from_front[0]):.0f}°", f"{found.pull[0]:.4g}"]
    assert result.stdout.splitlines()[-3] == f"{found}."
    assert json.loads(data.read_text("utf-8"))["pull"] == found.pull.tolist()
    with Image.open(png) as image:
        assert image.size == (1200, 720)


def test_a_fold_from_a_file_is_the_same(tmp_path: Path) -> None:
    fold = tmp_path / "fold.json"
    mounted = ("--mount", "pinned", "--seed", 1)
    assert run("fold", SCENE, *mounted, "--json", fold).exit_code == 0
    assert run("hold", fold).stdout == run("hold", SCENE, *mounted).stdout
    fails_in_one_line(run("hold", fold, "--friction", 0.1), "a fold from a file is what it is")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((SCENE, "--held", 1), "held: 1 is not allowed; must be from 1 to 6 and not the one"),
        ((SCENE, "--pulled", 0), "pulled: 0 is not allowed; must be from 1 to 6"),
        ((SCENE, "--png", "/nowhere/x.png"), "--png: '/nowhere/x.png' is not allowed; its folder"),
        (("nowhere.json",), "error: nowhere.json: No such file or directory"),
    ],
)
def test_what_is_not_allowed_is_told(arguments: tuple[object, ...], message: str) -> None:
    fails_in_one_line(run("hold", *arguments), message)
