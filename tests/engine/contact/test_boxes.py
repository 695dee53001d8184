"""Tests of squares: which ones can meet, the gaps between rounded boxes, and their derivatives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_env.engine.contact import boxes, jacobian
from tests.engine import reference
from tests.engine.contact.box_case import RADIUS, ROCKS, SIDE, Boxes, layouts, pairs, seeds


def end_separation(joints):
    """Return the separation of the first and the last square, with unit sides and sharp corners."""
    headings = np.concatenate([[0.0], np.cumsum(joints)])
    places = reference.centres(np.append(headings, [0.0, 0.0]), 1.0)
    return reference.separation(
        reference.square(places[0], headings[0], 0.5),
        reference.square(places[-1], headings[-1], 0.5),
    )


def test_near_components_cannot_overlap() -> None:
    grid = np.linspace(-np.pi / 2, np.pi / 2, 13)
    worst = min(end_separation([a, b, c]) for a in grid for b in grid for c in grid)
    assert worst >= -1e-12
    # Where three squares turn round one corner, and four close a ring.
    rng = np.random.default_rng(4)
    for _ in range(1000):
        stops = rng.choice([-1.0, 1.0], 3) * np.pi / 2
        joints = stops * (1.0 - 10 ** rng.uniform(-12, -1, 3))
        assert end_separation(joints) >= -1e-12
        assert end_separation(joints[:2]) >= -1e-12


def test_a_corner_beside_the_one_in_the_mouth_meets_the_next():
    # A chain that turns back to its tube: its last square lies beside the one in the mouth.
    case = Boxes(8, 3, tube=True)
    case.place(np.zeros(10))
    work = case.work
    for places in (work.boxes.x, work.boxes.y):
        places[5] = places[1]
    work.boxes.x[5] += 0.9 * SIDE * np.sqrt(2)
    rows = jacobian.collect_contacts(3, case.model, work, 0, jacobian.TOUCH * SIDE)
    assert {(1, 5), (5, 1)} & {tuple(row[:2]) for row in work.rows.id[:rows].tolist()}


def test_corners_face_each_other_only_where_no_side_is_nearer():
    rng, case, seen = np.random.default_rng(5), Boxes(6), 0
    for _ in range(500):
        case.place(np.zeros(8))
        placed = case.work.boxes
        # Corner 2 of the last square about as far from one of the first as their radii are long.
        first = np.array([placed.x[0], placed.y[0]]) + boxes.corner(case.work, 0, 0)
        turn = rng.uniform(-np.pi, np.pi)
        placed.c[5], placed.s[5] = np.cos(turn), np.sin(turn)
        place = first - boxes.corner(case.work, 5, 2) + rng.uniform(-4.0, 4.0, 2) * RADIUS
        placed.x[5], placed.y[5] = place
        if boxes.separation(case.work, 0, 5) <= 0.0:
            continue
        rows = [(case.work, *((0, 5) if k < 4 else (5, 0)), k % 4) for k in range(8)]
        gaps = np.array([boxes.corner_gap(case.model, *row) for row in rows])
        beside = np.array([boxes.is_beside_face(*row) for row in rows])
        facing = np.array([boxes.corner_offset(*row)[3] for row in rows]) & ~beside
        nearest = gaps[~beside].min()
        assert (gaps[beside] > nearest).all()
        # Of corners that all but touch only one pair can face each other, and it is the nearest.
        assert gaps[facing & (gaps < RADIUS)] == pytest.approx(nearest, abs=1e-12)
        seen += (beside & (gaps < RADIUS)).any()
    assert seen > 10


def test_engine_looks_at_every_pair_that_can_meet():
    free = {(i, j) for i in range(7) for j in range(i + 4, 7)}
    assert set(pairs(Boxes(7))) == free
    # Component 0 is deep in the tube, 2 sticks out of it and leaves room beside 1; the walls are
    # boxes 7 and 8.
    held = {(1, 5), (1, 6), (2, 6)} | {(i, w) for i in range(3, 7) for w in (7, 8)}
    assert set(pairs(Boxes(7, 3, tube=True))) == held


@given(seed=seeds)
def test_a_corner_beyond_a_wall_is_told_from_one_in_front_of_it(seed):
    rng = np.random.default_rng(seed)
    case = Boxes(5, 0, tube=True, obstacles=ROCKS[:1])
    case.place(case.random_q(rng))
    work, model = case.work, case.model
    wall, k = case.n + int(rng.integers(3)), int(rng.integers(4))
    middle = np.array([work.boxes.x[wall], work.boxes.y[wall]])
    half_length, half = work.boxes.a[wall], work.boxes.b[wall]
    # An obstacle's longer side lies along its own axis, whatever its heading says.
    along = 0.0 if wall < case.n + 2 else ROCKS[0].heading + np.pi / 2
    frame = np.array([[np.cos(along), np.sin(along)], [-np.sin(along), np.cos(along)]])
    # Somewhere at an end, at either face of the wall.
    end = middle + half_length * frame[0] + rng.uniform(-1.0, 1.0, 2) * SIDE
    work.boxes.x[2], work.boxes.y[2] = end
    turn = rng.uniform(-np.pi, np.pi)
    work.boxes.c[2], work.boxes.s[2] = np.cos(turn), np.sin(turn)

    corner = frame @ (end + boxes.corner(work, 2, k) - middle)
    centre, middle = frame @ (end - middle), np.zeros(2)
    side = np.sign(centre[1] - middle[1])
    face = middle[1] + side * half
    before, behind = side * (centre[1] - face), side * (face - corner[1])
    expected = -1.0
    if before > 0.0 and behind > 0.0:
        crossing = np.interp(0.0, [-before, behind], [centre[0], corner[0]])
        if abs(crossing - middle[0]) <= half_length:
            expected = behind + case.radii(wall, 2)
    assert boxes.behind_face(model, work, wall, 2, k) == pytest.approx(expected, abs=1e-12)


@given(seed=seeds, rocks=st.sampled_from([(), ROCKS]))
def test_boxes_overlap_where_no_side_separates_them(seed, rocks):
    case = Boxes(6, obstacles=rocks)
    q = case.random_q(np.random.default_rng(seed))
    case.place(q)
    overlapping = []
    for i, j in pairs(case):
        expected = reference.separation(case.polygon(i, q), case.polygon(j, q))
        assert boxes.separation(case.work, i, j) == pytest.approx(expected, abs=1e-12)
        if expected < case.radii(i, j) - boxes.OVERLAP * SIDE:
            overlapping.append((i, j))
    assert boxes.first_overlap(case.model, case.work) == (overlapping or [(-1, -1)])[0]


@given(seed=seeds, layout=layouts)
def test_a_box_has_the_four_corners_of_its_polygon(seed, layout):
    case = Boxes(**layout)
    q = case.random_q(np.random.default_rng(seed))
    case.place(q)
    for box in range(boxes.first_box(case.lo), case.work.boxes.x.size):
        centre = case.work.boxes.x[box], case.work.boxes.y[box]
        found = np.array([np.add(centre, boxes.corner(case.work, box, k)) for k in range(4)])
        apart = np.linalg.norm(found[:, None] - case.polygon(box, q).corners[0], axis=2)
        assert apart.min(axis=0).max() < 1e-12
        assert apart.min(axis=1).max() < 1e-12


@given(seed=seeds, layout=layouts)
def test_gaps_are_those_of_corners_and_negative_inside(seed, layout):
    rng = np.random.default_rng(seed)
    case = Boxes(**layout)
    q = case.random_q(rng)
    for i, j in pairs(case):
        for box, other in ((i, j), (j, i)):
            for k in range(4):
                expected = case.row_gap(box, other, k, q)
                found = boxes.corner_gap(case.model, case.work, box, other, k)
                assert found == pytest.approx(expected, abs=1e-12)
