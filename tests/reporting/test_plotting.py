"""Panels that fit a page."""

import pytest

from magfold_env.reporting.plotting import WIDEST, panels

pytest.importorskip("matplotlib.figure")


@pytest.mark.medium
@pytest.mark.parametrize("count", range(1, 7))
@pytest.mark.parametrize("shared", [True, False])
def test_no_row_of_panels_is_wider_than_a_page(count: int, shared: bool) -> None:
    figure, axes = panels(count, "title", 5.2, 4.6, shared=shared)
    assert figure.get_size_inches()[0] <= WIDEST
    assert len(axes) == len(figure.axes) == count
    for axis in axes:
        axis.plot([1, 2], [3, 4])
    figure.canvas.draw()
    assert all(tick.label1.get_visible() for axis in axes for tick in axis.xaxis.get_major_ticks())
