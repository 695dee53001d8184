"""Tests of charts of ensembles and sweeps, and of pictures of limit loads."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.ensembles.releases import Run
from magfold_env.ensembles.sweeps import scenes
from magfold_env.render.charts import chart
from magfold_env.shapes import headings, word_to_angles

pytest.importorskip("matplotlib.figure")

SCENE = mf.Scene(sequence=("NSNS",) * 4)


def swept(over: dict[str, tuple[float, ...]], *words: str) -> mf.Sweep:
    """Return a sweep in which word k occurs twice at point k, and all others once."""
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
    sweep = swept({"friction": (0.1, 0.2, 0.4)}, "LRL", "LSL")
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


def test_a_map_has_the_first_parameter_across() -> None:
    sweep = swept({"friction": (0.1, 0.2, 0.4), "feed.speed": (0.1, 0.2)}, "LRL", "LSL")
    panels = chart(sweep).axes
    assert [axis.get_title() for axis in panels[:2]] == ["LRL folded", "misfolded"]
    for axis, ends in zip(panels, (("LRL", "folded"), (None, "misfolded")), strict=False):
        rates = np.array([share.rate for share in sweep.probability(*ends)]).reshape(3, 2)
        np.testing.assert_array_equal(axis.images[0].get_array(), rates.T)
        assert [text.get_text() for text in axis.get_xticklabels()] == ["0.1", "0.2", "0.4"]
        assert [text.get_text() for text in axis.texts[:3]] == [
            f"{100 * rate:.0f}" for rate in rates[:, 0]
        ]
