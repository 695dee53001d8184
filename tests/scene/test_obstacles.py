"""Tests of obstacles, of their allowed places, and of the narrowest strip around a chain."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import magfold_env as mf
from magfold_env.scene.numbers import narrowest
from magfold_env.shapes import FloatArray

SCENE = mf.Scene(sequence=("NSNN", "NSSN", "SNSS"))
TUBE = SCENE.replace(mount="tube")
angles = st.floats(-4.0, 4.0)
sizes = st.floats(1e-3, 0.05)


def points_of(each: mf.Rectangle, count: int = 41) -> FloatArray:
    """Return points that fill a rectangle, (count², 2), including its edges."""
    share = np.linspace(-0.5, 0.5, count)
    x, y = (grid.ravel() for grid in np.meshgrid(each.size[0] * share, each.size[1] * share))
    place = (x + 1j * y) * np.exp(1j * each.heading)
    return np.array(each.position) + np.stack([place.real, place.imag], axis=1)


def spot(position: tuple[float, float], size: float = 1e-3) -> mf.Rectangle:
    return mf.Rectangle(position=position, size=(size, size))


@given(st.tuples(st.floats(-0.1, 0.05), st.floats(-0.05, 0.05)), angles, sizes, sizes)
def test_it_overlaps_an_outline_if_a_point_of_it_lies_inside(position, heading, one, other):
    each = mf.Rectangle(position=position, size=(one, other), heading=heading)
    outline = np.array([(-0.5, -0.01), (0.0, -0.01), (0.0, 0.01), (-0.5, 0.01)])
    x, y = points_of(each).T

    def inside(margin: float) -> bool:
        return bool(((x < -margin) & (np.abs(y) < 0.01 - margin)).any())

    if inside(0.0):
        assert each.overlaps(outline)
    elif not inside(-0.04 * max(one, other)):  # not even with the spaces between the points
        assert not each.overlaps(outline)


@pytest.mark.parametrize("position", [(-0.05, 0.0), (0.01, 0.0), (0.01, -0.009)])
def test_the_bore_and_as_much_before_it_as_a_casing_is_long_stay_free(position):
    with pytest.raises(mf.SceneError, match=r"obstacles\[1\]\.position: .*free the tube's bore"):
        TUBE.replace(obstacles=(spot((0.2, 0.2)), spot(position)))
    assert SCENE.replace(obstacles=(spot((-0.05, 0.0)),)).obstacles


@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_straight_chain_that_begins_in_one_is_refused(number: int) -> None:
    place = ((number - 0.5) * SCENE.casing.diagonal, 0.3 * SCENE.casing.side)
    found = rf"obstacles\[0\]\.position: .*component {number} begins there"
    with pytest.raises(mf.SceneError, match=found):
        SCENE.replace(obstacles=(spot(place),))
    # Without contact nothing is in the way.
    assert SCENE.replace(obstacles=(spot(place),), contact=False).obstacles


@pytest.mark.parametrize("bend", [1.2, -1.2])
def test_a_bent_chain_that_begins_in_one_fails_at_once(bend: float) -> None:
    # Where the tip of component 3 is when the second joint is bent to the left.
    place = SCENE.casing.diagonal * np.array([2.0 + 0.9 * math.cos(1.2), 0.9 * math.sin(1.2)])
    scene = SCENE.replace(
        obstacles=(spot(tuple(place.tolist())),), start_angles=(0.0, bend), duration=1e-3
    )
    fold = mf.simulate(scene)
    assert (fold.status is mf.FoldStatus.FAILED) == (bend > 0.0)
    assert (fold.message == "component 3 and an obstacle overlap at the start") == (bend > 0.0)


def test_a_funnel_begins_at_the_rim_and_opens() -> None:
    bore, length, angle = TUBE.bore, 0.03, 0.6
    upper, lower = mf.funnel(bore, length, angle)
    rim = np.array([0.0, bore / 2])
    inner = [corner for corner in upper.corners if math.dist(corner, rim) < 1e-3 + 1e-9]
    assert min(math.dist(corner, rim) for corner in inner) < 2e-3
    assert upper.corners[:, 1].min() >= bore / 2 - 1e-12
    tip = upper.corners[np.argmax(upper.corners[:, 0])]
    assert tip[0] == pytest.approx(length * math.cos(angle), abs=1e-3)
    np.testing.assert_allclose(
        np.sort(upper.corners[:, 1]), np.sort(-lower.corners[:, 1]), atol=1e-15
    )
    assert TUBE.replace(obstacles=(upper, lower)).obstacles


def test_obstacles_are_drawn_together_as_widely_as_said_but_not_into_the_bore() -> None:
    walls = (*mf.channel((0.02, 0.0), (0.1, 0.0), 0.05), spot((0.12, 0.0)))
    scene = TUBE.replace(obstacles=walls, spreads={"obstacle_width": 0.2, "obstacle_offset": 0.004})
    rng = np.random.default_rng(0)
    drawn = [scene.draw(rng) for _ in range(200)]
    places = np.array([[each.position[1] for each in one.obstacles] for one in drawn])
    width, offset = (places[:, 0] - places[:, 1]) / 0.051, places[:, 2]
    np.testing.assert_allclose(places[:, 0] + places[:, 1], 2.0 * offset, atol=1e-15)
    assert (width.min(), width.max()) == pytest.approx((0.8, 1.2), abs=0.02)
    assert (offset.min(), offset.max()) == pytest.approx((-0.004, 0.004), abs=4e-4)
    assert all(one.is_concrete for one in drawn)
    turned = scene.replace(spreads={"obstacle_offset": 0.0}).draw(np.random.default_rng(0))
    assert drawn[0].start_offsets == turned.start_offsets  # the other draws are as they were
    walls = mf.channel((0.0, 0.0), (0.1, 0.0), 0.03)
    scene = TUBE.replace(obstacles=walls, spreads={"obstacle_offset": 0.005})
    with pytest.raises(mf.SceneError, match=r"spreads\.obstacle_offset: 0\.006 .*bore"):
        scene.replace(spreads={"obstacle_offset": 0.006})


JOINTS = st.lists(st.floats(-1.5, 1.5), max_size=11)


def turned(joints, extra=0.0):
    headings = extra + np.cumsum((0.0, *joints))
    return np.cos(headings), np.sin(headings)


@given(JOINTS, st.floats(-3.0, 3.0))
def test_no_direction_of_many_gives_a_narrower_strip(joints, extra):
    cos, sin = turned(joints, extra)
    along, across = narrowest(cos, sin)
    np.testing.assert_allclose(across.min(), -across.max(), atol=1e-12)
    np.testing.assert_allclose(np.diff(across) ** 2 + along**2, 1.0, atol=1e-9)
    # The same chain, turned: neighbouring links are at the same angle.
    link, given_link = along + 1j * np.diff(across), cos + 1j * sin
    np.testing.assert_allclose(
        link[1:] * link[:-1].conj(), given_link[1:] * given_link[:-1].conj(), atol=1e-9
    )
    assert along.sum() >= -1e-9
    hinges = np.concatenate([[0.0], np.cumsum(cos + 1j * sin)])
    turns = np.exp(1j * np.linspace(0.0, np.pi, 361))
    widths = np.ptp(np.imag(hinges[:, None] * turns), axis=0)
    assert np.ptp(across) <= widths.min() + 1e-9
