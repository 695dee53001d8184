"""Diagrams of rows: what stands in which panel and line, and that nothing is cut off."""

import pytest

from magfold_bench.presentation import Lines

pytest.importorskip("matplotlib.figure")


@pytest.mark.parametrize("shared", [True, False])
def test_every_point_is_within_its_panel(shared: bool) -> None:
    rows = [
        {"kind": kind, "by": by, "x": 10.0**k * scale, "y": 2.0**k, "chosen": k == 1}
        for kind, scale in (("near", 1.0), ("far", 1e4))
        for by in ("one", "other")
        for k in range(3)
    ]
    lines = Lines("title", "x", "y", "by", ("kind",), star="chosen", shared=shared)
    figure = lines.draw(rows)
    assert [axis.get_title() for axis in figure.axes] == ["near", "far"]
    for axis, scale in zip(figure.axes, (1.0, 1e4), strict=True):
        low, high = axis.get_xlim()
        assert low <= scale
        assert 100.0 * scale <= high
        assert [line.get_label() for line in axis.lines] == ["one", "other", "chosen"]
        assert list(axis.lines[-1].get_xdata()) == [10.0 * scale] * 2
