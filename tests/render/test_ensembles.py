"""Bar charts of ensembles: what is in them."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import magfold_env as mf
from magfold_env.ensembles.releases import Bar, Run, bars
from magfold_env.render import draw_ensemble
from magfold_env.render.ensembles import SLOTS, bar_chart
from magfold_env.shapes import headings, word_to_angles

pytest.importorskip("matplotlib.figure")

SCENE = mf.Scene(sequence=("NSNS",) * 4)
WORDS = ("LRL", "LRR", "RLL", "RLR", "LSL", "LLS", "SLR", "RRL")


def made_of(*words: str) -> mf.Ensemble:
    runs: list[Run] = []
    for k, word in enumerate(words):
        status = "misfolded" if "S" in word else "folded"
        angles = headings(word_to_angles(word), first=0.1 * k)
        runs.append(Run(k, word, status, 0.0, 1.0, tuple(angles.tolist())))
    return mf.Ensemble.of(SCENE, 0, runs)


def test_bars_are_the_outcomes_with_the_joints_of_a_run() -> None:
    ensemble = made_of("LRL", "LSL", "LRL")
    first, second = bars(ensemble)
    assert (first.word, first.status, first.rate) == ("LRL", "folded", 2 / 3)
    assert (second.word, second.status, second.rate) == ("LSL", "misfolded", 1 / 3)
    share = ensemble.outcomes["LRL", mf.FoldStatus.FOLDED]
    assert (first.low, first.high) == (share.low, share.high)
    np.testing.assert_allclose(second.joints, word_to_angles("LSL"), atol=1e-15)


def test_a_panel_shows_the_most_frequent_and_the_rest_together() -> None:
    words = [word for k, word in enumerate(WORDS) for _ in range(len(WORDS) - k)]
    ensemble = made_of(*words)
    figure = bar_chart({"many": bars(ensemble), "few": bars(made_of("LRL"))})
    many, few = figure.axes[:2]
    heights = [patch.get_height() for patch in many.patches]
    rates = [share.rate for share in ensemble.outcomes.values()]
    np.testing.assert_allclose(heights, [*rates[: SLOTS - 1], sum(rates[SLOTS - 1 :])])
    assert [text.get_text() for text in many.get_xticklabels()] == [*WORDS[: SLOTS - 1], "others"]
    assert [patch.get_height() for patch in few.patches] == [1.0]
    # An outline of four casings under each bar but the last.
    assert [len(axis.patches) for axis in many.child_axes] == [SCENE.n] * (SLOTS - 1)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["folded", "misfolded", "others"]


def test_panels_fill_rows_and_what_is_left_stays_empty() -> None:
    figure = bar_chart({str(k): [Bar("L", "failed", 1.0, 0.9, 1.0, (1.5,))] for k in range(4)})
    assert [axis.axison for axis in figure.axes] == [True] * 4 + [False] * 2


@pytest.mark.parametrize("words", [WORDS, ("LRL",)])
def test_the_chart_is_a_png(words: tuple[str, ...], tmp_path: Path) -> None:
    draw_ensemble(made_of(*words), tmp_path / "bars.png")
    with Image.open(tmp_path / "bars.png") as image:
        assert image.format == "PNG"
        assert np.asarray(image.convert("L")).std() > 5.0
