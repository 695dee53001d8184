"""Tests of the replay page as a file: its contents, and that it needs no other file."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.fold import kinetic_energy, recording
from magfold_env.replay import page_data
from magfold_env.simulation.frames import magnetic_energy
from tests.folds import FREE, recorded
from tests.markup import Markup

TUBE = mf.load_scene("tube-feed")


def _page(fold: mf.Fold, folder: Path) -> tuple[Markup, dict[str, Any]]:
    fold.to_html(folder / "fold.html")
    found = Markup((folder / "fold.html").read_text(encoding="utf-8"))
    return found, json.loads(found.texts["application/json"])


def test_a_page_holds_the_recorded_motion(tmp_path: Path) -> None:
    fold = recorded("LRLLL")
    motion: Any = fold.trajectory
    reader, data = _page(fold, tmp_path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["fold.html"]
    assert (data["word"], data["status"], data["message"]) == ("LRLLL", "folded", fold.message)
    assert reader.texts["title"] == "Fold LRLLL, folded"
    assert data["sequence"] == list(FREE.sequence)
    np.testing.assert_allclose(data["time"], motion.time, atol=1e-6)
    np.testing.assert_allclose(data["angles"], motion.angles, atol=1e-4)
    np.testing.assert_allclose(np.array(data["base"]) / 1e3, motion.base, atol=1e-7)
    for name, find in (("magnetic", magnetic_energy), ("kinetic", kinetic_energy)):
        expected = 1e3 * find(FREE, motion)
        np.testing.assert_allclose(data[name], expected, atol=1e-4 * np.abs(expected).max())
    assert data["tube"] is data["field"] is None


def test_a_page_asks_for_nothing_outside_itself(tmp_path: Path) -> None:
    reader, _ = _page(recorded("LRLLL"), tmp_path)
    assert [each for each in reader.addresses if not each.startswith("data:")] == []
    text = (tmp_path / "fold.html").read_text(encoding="utf-8")
    # The one address is the name of SVG's elements, which nothing is fetched from.
    assert set(re.findall(r"https?://[^\"' ]+", text)) == {"http://www.w3.org/2000/svg"}
    assert "@import" not in text
    assert "default-src 'none'" in text


@pytest.mark.parametrize(
    "text", ["</script><script>alert(1)</script>", "<!-- <script>", "\u2028 & $x"]
)
def test_no_text_of_a_fold_can_end_its_script(text: str, tmp_path: Path) -> None:
    fold = recorded("LRLLL")
    plain, _ = _page(fold, tmp_path)
    reader, data = _page(replace(fold, message=text), tmp_path)
    assert data["message"] == text
    assert reader.texts["module"] == plain.texts["module"]


def test_what_surrounds_a_chain_is_on_the_page() -> None:
    magnet = mf.FixedMagnet(position=(0.05, 0.1), width=0.04, height=0.04, thickness=0.02)
    scene = TUBE.replace(field={"uniform": (0.0, 2e-5), "magnet": magnet.model_dump()})
    data = page_data(recording(recorded("LRLLL", scene)))
    assert data["tube"] == {"bore": round(1e3 * scene.bore, 4), "wall": 1.0}
    np.testing.assert_allclose(
        np.array(data["field"]["corners"]) / 1e3, magnet.outline.corners, atol=1e-7
    )
    assert data["field"]["uniform"] == pytest.approx([0.0, 0.02])
    assert data["order"] == [0, 1, 2, 3, 4, 5]
    # Loaded at the mouth: one more than has left it.
    # The one in the mouth has its magnets too, once it moves.
    assert data["loaded"] == [0] + [min(out + 1, 6) for out in data["released"][1:]]
    backward = recorded("LRLLL", scene.replace(feed={"direction": "backward"}))
    assert page_data(recording(backward))["order"] == [5, 4, 3, 2, 1, 0]
    bare = page_data(recording(recorded("LRLLL", FREE.replace(magnets=None, mount="pinned"))))
    assert bare["magnets"] is bare["magnetic"] is None
    assert bare["pinned"]


def test_a_fold_is_shown_up_to_where_it_broke_down_if_it_was_recorded(tmp_path: Path) -> None:
    fold: Any = replace(recorded("LRLLL"), energy=np.nan, angles=np.full(6, np.nan))
    fold.trajectory.angles[20:] = np.nan
    data = page_data(recording(fold))
    assert len(data["time"]) == len(data["angles"]) == len(data["magnetic"]) == 20
    assert json.dumps(data, allow_nan=False)
    fold.trajectory.base[0] = np.inf
    with pytest.raises(ValueError, match="without a finite frame"):
        page_data(recording(fold))
    still = replace(recorded("LRLLL"), trajectory=None)
    with pytest.raises(ValueError, match="simulate it with a frame_rate"):
        still.to_html(tmp_path / "fold.html")
    assert not list(tmp_path.iterdir())
