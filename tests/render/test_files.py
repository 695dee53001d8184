"""Tests of the files of pictures and animations of folds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import magfold_env as mf
from magfold_env.minimiser.states import state_of
from magfold_env.render import draw_states, save_gif, save_png, style
from tests.folds import FREE, recorded
from tests.render.test_render import count_of


def test_png_of_a_fold(tmp_path: Path) -> None:
    path = tmp_path / "fold.png"
    save_png(recorded("LRLLL"), path, target="LRLLL", size=(400, 300))
    with Image.open(path) as image:
        assert image.size == (400, 300)
        assert count_of(np.asarray(image.convert("RGB")), style.NORTH) > 500
    assert [entry.name for entry in tmp_path.iterdir()] == ["fold.png"]


def test_gif_of_a_fold_plays_as_long_as_asked_and_is_small(tmp_path: Path) -> None:
    path = tmp_path / "fold.gif"
    save_gif(recorded("LRLLL"), path, fps=10, seconds=2.0, hold=1.0, targets=["LRLLL"])
    with Image.open(path) as image:
        assert image.size == (640, 480)
        durations: list[int] = []
        for k in range(getattr(image, "n_frames", 1)):
            image.seek(k)
            durations.append(image.info["duration"])
        assert image.info["loop"] == 0
    assert sum(durations) == pytest.approx(3000, abs=20)
    assert durations[-1] >= 1000
    assert path.stat().st_size < 2e6


def test_wrong_arguments_of_a_gif_are_named(tmp_path: Path) -> None:
    fold = recorded("LRLLL", frames=2)
    still = mf.Fold(**{**vars(fold), "trajectory": None})
    path = tmp_path / "fold.gif"
    with pytest.raises(ValueError, match=r"folds: \[\] is not allowed"):
        save_gif([], path)
    with pytest.raises(ValueError, match="simulate it with a frame_rate"):
        save_gif(still, path)
    with pytest.raises(ValueError, match="fps: 0 is not allowed; must be from 1 to 50"):
        save_gif(fold, path, fps=0)
    with pytest.raises(ValueError, match="seconds: nan is not allowed; must be greater than 0"):
        save_gif(fold, path, seconds=float("nan"))
    with pytest.raises(ValueError, match=r"targets: .* must have 1 words"):
        save_gif(fold, path, targets=["LRLLL", "LRLLL"])
    assert not list(tmp_path.iterdir())


def test_a_fold_that_broke_down_is_shown_up_to_there(tmp_path: Path) -> None:
    fold = recorded("LRLLL", frames=10)
    assert fold.trajectory is not None
    fold.trajectory.angles[6:] = np.nan
    fold.angles[:] = np.nan
    path = tmp_path / "fold.gif"
    save_gif(fold, path, seconds=1.0)
    assert path.stat().st_size > 1000
    with pytest.raises(ValueError, match="cannot be drawn; must be finite"):
        save_png(fold, tmp_path / "fold.png")
    fold.trajectory.base[0] = np.inf
    with pytest.raises(ValueError, match="without a finite frame"):
        save_gif(fold, path)


def test_a_sheet_of_states_rings_conflicts_alone(tmp_path: Path) -> None:
    def drawn(conflicts: tuple[tuple[int, int], ...]) -> np.ndarray:
        states = [replace(state_of(FREE, "LRLLL"), conflicts=conflicts), state_of(FREE, "SSSSS")]
        draw_states(FREE, states, tmp_path / "states.png")
        with Image.open(tmp_path / "states.png") as image:
            return np.asarray(image.convert("RGB"))

    assert drawn(()).shape == (260, 520, 3)
    assert count_of(drawn(()), style.CONFLICT) == 0
    one, two = (count_of(drawn(pairs), style.CONFLICT) for pairs in (((4, 5),), ((4, 5), (1, 2))))
    assert one > 20
    assert two == pytest.approx(2 * one, rel=0.2)
    with pytest.raises(ValueError, match=r"states: \[\] is not allowed"):
        draw_states(FREE, [], tmp_path / "none.png")
