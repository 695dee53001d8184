"""What does not move: rectangles, what is built of them, and where they may stand."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import magfold_env as mf
from magfold_env.scene import Rectangle, chamber, channel, funnel
from magfold_env.shapes import FloatArray

SCENE = mf.Scene(sequence=("NSNN", "NSSN", "SNSS"))
TUBE = SCENE.replace(mount="tube")
angles = st.floats(-4.0, 4.0)
sizes = st.floats(1e-3, 0.05)


def points_of(each: Rectangle, count: int = 41) -> FloatArray:
    """Points all over a rectangle, (count², 2), its edges among them."""
    share = np.linspace(-0.5, 0.5, count)
    x, y = (grid.ravel() for grid in np.meshgrid(each.size[0] * share, each.size[1] * share))
    place = (x + 1j * y) * np.exp(1j * each.heading)
    return np.array(each.position) + np.stack([place.real, place.imag], axis=1)


def spot(position: tuple[float, float], size: float = 1e-3) -> Rectangle:
    return Rectangle(position=position, size=(size, size))


@given(position=st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)), heading=angles,
       size=st.tuples(sizes, sizes))  # fmt: skip
def test_corners_are_counter_clockwise_and_as_far_apart_as_it_is_large(
    position: tuple[float, float], heading: float, size: tuple[float, float]
) -> None:
    each = Rectangle(position=position, size=size, heading=heading)
    sides = np.roll(each.corners, -1, axis=0) - each.corners
    along = np.array([math.cos(heading), math.sin(heading)])
    np.testing.assert_allclose(each.corners.mean(axis=0), position, atol=1e-15)
    np.testing.assert_allclose(sides[1], -size[0] * along, atol=1e-14)
    np.testing.assert_allclose(np.hypot(*sides.T), [size[1], size[0]] * 2, atol=1e-14)
    assert np.linalg.det(sides[:2]) > 0.0


@given(st.tuples(st.floats(-0.1, 0.05), st.floats(-0.05, 0.05)), angles, sizes, sizes)
def test_it_overlaps_an_outline_if_a_point_of_it_lies_inside(
    position: tuple[float, float], heading: float, one: float, other: float
) -> None:
    each = Rectangle(position=position, size=(one, other), heading=heading)
    outline = np.array([(-0.5, -0.01), (0.0, -0.01), (0.0, 0.01), (-0.5, 0.01)])
    x, y = points_of(each).T

    def inside(margin: float) -> bool:
        return bool(((x < -margin) & (np.abs(y) < 0.01 - margin)).any())

    if inside(0.0):
        assert each.overlaps(outline)
    elif not inside(-0.04 * max(one, other)):  # not even with the spaces between the points
        assert not each.overlaps(outline)


@pytest.mark.parametrize("position", [(-0.05, 0.0), (0.01, 0.0), (0.01, -0.009)])
def test_the_bore_and_as_much_before_it_as_a_casing_is_long_stay_free(
    position: tuple[float, float],
) -> None:
    with pytest.raises(mf.SceneError, match=r"obstacles\[1\]\.position: .*free the tube's bore"):
        TUBE.replace(obstacles=(spot((0.2, 0.2)), spot(position)))
    assert SCENE.replace(obstacles=(spot((-0.05, 0.0)),)).obstacles


def test_beside_the_bore_and_farther_before_it_an_obstacle_may_stand() -> None:
    half, free = TUBE.bore / 2, TUBE.casing.diagonal
    beside, before = spot((-0.05, half + 5e-4 + 1e-9)), spot((free + 5e-4 + 1e-9, 0.0))
    assert TUBE.replace(obstacles=(beside, before)).obstacles == (beside, before)


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


def test_a_channel_has_two_walls_as_far_apart_as_it_is_wide() -> None:
    one, other = channel((0.01, 0.02), (0.04, 0.06), width=0.02, wall=0.002)
    for each in (one, other):
        assert each.size == pytest.approx((0.05, 0.002))
        assert each.heading == pytest.approx(math.atan2(4, 3))
    np.testing.assert_allclose(np.add(one.position, other.position) / 2, (0.025, 0.04))
    assert math.dist(one.position, other.position) == pytest.approx(0.022)


def test_a_chamber_is_closed_but_for_its_opening() -> None:
    walls = chamber((0.02, -0.03), (0.05, 0.04), opening=0.018, wall=0.001)
    rng = np.random.default_rng(0)
    crossed = []
    for turn in rng.uniform(-np.pi, np.pi, 400):
        ray = np.array([0.045, -0.01]) + np.linspace(0.0, 0.1, 2001)[:, None] * [
            math.cos(turn), math.sin(turn)
        ]  # fmt: skip
        hit = any(within(each, ray).any() for each in walls)
        at_left = ray[np.argmax(ray[:, 0] < 0.02)]
        leaves = bool((ray[:, 0] < 0.02).any()) and abs(float(at_left[1])) < 0.009
        crossed.append((hit, leaves))
    near_edge = sum(hit == leaves for hit, leaves in crossed)
    assert near_edge <= 4  # rays that graze an edge of the opening
    assert any(leaves for _, leaves in crossed)


def within(each: Rectangle, places: FloatArray) -> np.ndarray:
    """Whether points (k, 2) lie in a rectangle."""
    away = (places - each.position) @ [1.0, 1j] * np.exp(-1j * each.heading)
    return (np.abs(away.real) <= each.size[0] / 2) & (np.abs(away.imag) <= each.size[1] / 2)


def test_a_funnel_begins_at_the_rim_and_opens() -> None:
    bore, length, angle = TUBE.bore, 0.03, 0.6
    upper, lower = funnel(bore, length, angle)
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


def test_obstacles_are_drawn_together_as_widely_as_said() -> None:
    walls = (*channel((0.02, 0.0), (0.1, 0.0), 0.05), spot((0.12, 0.0)))
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


def test_obstacles_that_may_be_drawn_into_the_bore_are_refused() -> None:
    walls = channel((0.0, 0.0), (0.1, 0.0), 0.03)
    scene = TUBE.replace(obstacles=walls, spreads={"obstacle_offset": 0.005})
    with pytest.raises(mf.SceneError, match=r"spreads\.obstacle_offset: 0\.006 .*bore"):
        scene.replace(spreads={"obstacle_offset": 0.006})


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: channel((0, 0), (0, 0), width=0.1), "length: 0.0 is not allowed"),
        (lambda: channel((0, 0), (1, 0), width=-0.1), "width: -0.1 is not allowed"),
        (lambda: chamber((0.02, -0.02), (0.1, 0.1), opening=0.05), "opening: 0.05 is not allowed"),
        (lambda: funnel(0.02, 0.03, angle=2.0), "angle: 2.0 is not allowed"),
        (lambda: funnel(0.02, math.nan), "length: nan is not allowed"),
    ],
)
def test_what_cannot_be_built_is_an_error(build: Any, message: str) -> None:
    with pytest.raises(mf.SceneError, match=message):
        build()
