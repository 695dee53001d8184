"""Pictures of what a fold withstands."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import magfold_env as mf
from magfold_env.render import draw_holding, style

FOUND = mf.holding(mf.simulate(mf.load_scene("paper/sequence-3")))


def _count(path: Path, colour: style.Colour) -> int:
    with Image.open(path) as image:
        return int((np.asarray(image) == np.array(colour[:3])).all(axis=-1).sum())


@pytest.mark.parametrize("pull", [0.3, 0.0, np.inf])
def test_any_pull_can_be_drawn(pull: float, tmp_path: Path) -> None:
    path = tmp_path / "holding.png"
    draw_holding(replace(FOUND, pull=np.full(24, pull), opening=np.full((5, 2), pull)), path)
    assert _count(path, style.MARKED) > 100
    assert [entry.name for entry in tmp_path.iterdir()] == ["holding.png"]


def test_the_curve_grows_with_the_pull(tmp_path: Path) -> None:
    path, round_pull = tmp_path / "holding.png", np.full(24, 1.0)
    areas: list[int] = []
    for most in (1.2, 2.8):
        pull = round_pull.copy()
        pull[::2] = most
        draw_holding(replace(FOUND, pull=pull), path)
        areas.append(_count(path, style.MARKED))
    assert areas[1] > areas[0]  # a star has a longer outline
