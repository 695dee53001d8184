"""Charts of sweeps: what is in them."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import magfold_env as mf
from magfold_env.ensembles.releases import Run
from magfold_env.ensembles.sweeps import Outcome, scenes
from magfold_env.render import draw_sweep
from magfold_env.render.sweeps import LINES, MAPS, chart
from magfold_env.shapes import headings, word_to_angles

pytest.importorskip("matplotlib.figure")

SCENE = mf.Scene(sequence=("NSNS",) * 4)
WORDS = ("LRL", "LRR", "RLL", "RLR", "RRL", "RRR", "LLR", "LSL")


def made_of(over: dict[str, tuple[float, ...]], *words: str) -> mf.Sweep:
    """At point k the word k occurs twice, all others once."""
    ensembles: list[mf.Ensemble] = []
    for k, scene in enumerate(scenes(SCENE, over)):
        runs: list[Run] = []
        for word in (*words, words[k % len(words)]):
            angles = tuple(headings(word_to_angles(word), first=0.0).tolist())
            status = "misfolded" if "S" in word else "folded"
            runs.append(Run(len(runs), word, status, 0.0, 1.0, angles))
        ensembles.append(mf.Ensemble.of(scene, 0, runs))
    return mf.Sweep(SCENE, 0, over, tuple(ensembles))


def test_lines_are_the_shares_with_their_intervals() -> None:
    sweep = made_of({"friction": (0.1, 0.2, 0.4)}, "LRL", "LSL")
    (axis,) = chart(sweep).axes
    assert axis.get_xlabel() == "friction"
    assert axis.get_xscale() == "log"
    drawn = {line.get_label(): line.get_ydata() for line in axis.lines}
    assert drawn.keys() == {"LRL folded", "misfolded"}
    np.testing.assert_allclose(drawn["LRL folded"], [2 / 3, 1 / 3, 2 / 3])
    shares = sweep.probability("LRL", "folded")
    ends = axis.collections[0].get_paths()[0].vertices[:, 1]
    for end in ("low", "high"):
        assert {getattr(share, end) for share in shares} <= set(ends.tolist())


def test_the_rarest_share_a_line() -> None:
    figure = chart(made_of({"friction": (0.1, 0.2, 0.3)}, *WORDS))
    (axis,) = figure.axes
    assert axis.get_xscale() == "linear"
    labels = [line.get_label() for line in axis.lines]
    assert labels[LINES:] == ["others"]
    total = sum(line.get_ydata() for line in axis.lines)
    np.testing.assert_allclose(total, 1.0)
    colours = [line.get_color() for line in axis.lines[:LINES]]
    assert len(set(colours)) == LINES


def test_a_map_has_the_first_parameter_across() -> None:
    sweep = made_of({"friction": (0.1, 0.2, 0.4), "feed.speed": (0.1, 0.2)}, "LRL", "LSL")
    panels = chart(sweep).axes
    assert [axis.get_title() for axis in panels[:2]] == ["LRL folded", "misfolded"]
    for axis, ends in zip(panels, (("LRL", "folded"), (None, "misfolded")), strict=False):
        rates = np.array([share.rate for share in sweep.probability(*ends)]).reshape(3, 2)
        np.testing.assert_array_equal(axis.images[0].get_array(), rates.T)
        assert [text.get_text() for text in axis.get_xticklabels()] == ["0.1", "0.2", "0.4"]
        assert [text.get_text() for text in axis.texts[:3]] == [
            f"{100 * rate:.0f}" for rate in rates[:, 0]
        ]


def test_what_is_chosen_is_drawn_alone() -> None:
    sweep = made_of({"friction": (0.1, 0.2), "feed.speed": (0.1, 0.2)}, *WORDS)
    assert sum(bool(axis.get_title()) for axis in chart(sweep).axes) == MAPS
    axis, _ = chart(sweep, Outcome("RRR")).axes
    assert axis.get_title() == "RRR"
    line = made_of({"friction": (0.1, 0.2)}, *WORDS)
    (axis,) = chart(line, Outcome(None, mf.FoldStatus.MISFOLDED)).axes
    assert [line.get_label() for line in axis.lines] == ["misfolded"]


def test_close_values_are_told_apart() -> None:
    sweep = made_of({"friction": (0.10001, 0.10002), "feed.speed": (0.1, 0.2)}, "LRL")
    labels = [text.get_text() for text in chart(sweep).axes[0].get_xticklabels()]
    assert labels == ["0.10001", "0.10002"]


@pytest.mark.parametrize(
    "over", [{"friction": (0.1, 0.2)}, {"friction": (0, 1), "duration": (1, 2)}]
)
def test_the_chart_is_a_picture(over: dict[str, tuple[float, ...]], tmp_path: Path) -> None:
    sweep = made_of(over, *WORDS)
    draw_sweep(sweep, tmp_path / "sweep.png")
    with Image.open(tmp_path / "sweep.png") as image:
        assert image.format == "PNG"
        assert np.asarray(image.convert("L")).std() > 5.0
    draw_sweep(sweep, tmp_path / "sweep.svg")
    assert "<svg" in (tmp_path / "sweep.svg").read_text()
