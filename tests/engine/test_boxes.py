"""Squares: which can meet, the gap between rounded boxes, and its derivatives."""

import numpy as np
import pytest
from hypothesis import assume, given, target
from hypothesis import strategies as st

from magfold_env.engine import boxes, chain, contact
from magfold_env.engine.feed import place_all
from magfold_env.engine.pack import pack
from magfold_env.engine.workspace import new_work
from magfold_env.scene import Scene
from magfold_env.scene_parts import Casing, Magnets
from tests.engine import reference

SIDE = 0.0125
RADIUS = Casing().corner_radius
CORE = (1.0 - boxes.SHRINK) * SIDE / 2 - RADIUS
right_angle = st.floats(-np.pi / 2, np.pi / 2)
seeds = st.integers(0, 2**32 - 1)


def end_separation(joints):
    """Separation of the first and the last square of unit side, over sharp corners."""
    headings = np.concatenate([[0.0], np.cumsum(joints)])
    places = reference.centres(np.append(headings, [0.0, 0.0]), 1.0)
    return reference.separation(
        reference.square(places[0], headings[0], 0.5),
        reference.square(places[-1], headings[-1], 0.5),
    )


@given(joints=st.lists(right_angle, min_size=1, max_size=3))
def test_near_components_cannot_overlap(joints):
    gap = end_separation(joints)
    target(-gap)
    assert gap >= -1e-12


def test_near_components_cannot_overlap_on_a_grid():
    grid = np.linspace(-np.pi / 2, np.pi / 2, 13)
    worst = min(end_separation([a, b, c]) for a in grid for b in grid for c in grid)
    assert worst >= -1e-12


def test_near_components_cannot_overlap_next_to_the_stops():
    # Where three squares turn round one corner, and four close a ring.
    rng = np.random.default_rng(4)
    for _ in range(1000):
        stops = rng.choice([-1.0, 1.0], 3) * np.pi / 2
        joints = stops * (1.0 - 10 ** rng.uniform(-12, -1, 3))
        assert end_separation(joints) >= -1e-12
        assert end_separation(joints[:2]) >= -1e-12


def test_components_four_apart_can_overlap():
    assert end_separation([np.pi / 2] * 4) < -0.5


@pytest.mark.parametrize(("lo", "first"), [(0, 0), (1, 0), (2, 0), (3, 1), (6, 4)])
def test_the_two_held_components_next_to_the_mouth_are_in_the_way(lo, first):
    assert boxes.first_box(lo) == first


def test_a_corner_beside_the_one_in_the_mouth_meets_the_next():
    # A chain that turns back to its tube: its last square lies beside the one in the mouth.
    case = Boxes(8, 3, tube=True)
    case.place(np.zeros(10))
    work = case.work
    for name in ("box_x", "box_y"):
        getattr(work, name)[5] = getattr(work, name)[1]
    work.box_x[5] += 0.9 * SIDE * np.sqrt(2)
    rows = contact.collect_contacts(3, case.model, work, 0)
    assert {(1, 5), (5, 1)} & {tuple(row[:2]) for row in work.row_id[:rows].tolist()}


class Boxes:
    """A chain of which `lo` components are held in a tube, and the gaps between its boxes."""

    def __init__(self, n, lo=0, *, tube=False):
        scene = Scene(
            sequence=("NNNN",) * n, magnets=None, mount="tube" if tube else "free", friction=0.0
        )
        self.n, self.lo = n, lo
        self.model = pack(scene)
        self.work = new_work(self.model)

    def place(self, q):
        place_all(self.lo, self.model, q, self.work.pose)
        boxes.place_boxes(max(self.lo - 1, 0), self.model, self.work.pose, self.work)

    def polygon(self, box, q):
        """Core of a box (4, 2) from the coordinates alone."""
        if box >= self.n:
            length = 2 * self.n * SIDE * np.sqrt(2)
            radius = min(RADIUS, self.model.wall / 4)
            sign = 1 if box == self.n else -1
            middle = sign * (self.model.bore + self.model.wall) / 2
            half = length / 2 - radius, self.model.wall / 2 - radius
            return reference.rectangle(np.array([-length / 2, middle]), *half)
        if box >= self.lo:
            tail = reference.centres(q[self.lo :], SIDE)
            return reference.square(tail[box - self.lo], q[box], CORE)
        # The outermost held component ends at the base.
        half = SIDE / np.sqrt(2) * np.array([np.cos(q[box]), np.sin(q[box])])
        return reference.square(q[-2:] - half, q[box], CORE)

    def radii(self, box, other):
        walls = (box >= self.n) + (other >= self.n)
        return (2 - walls) * RADIUS + walls * min(RADIUS, self.model.wall / 4)

    def gap(self, box, other, q):
        """Gap of two boxes whose cores do not overlap."""
        distance = reference.polygon_distance(self.polygon(box, q), self.polygon(other, q))
        return distance - self.radii(box, other)

    def row_gap(self, box, other, k, q):
        """Gap of corner k of `other` from `box`; corners as the engine numbers them."""
        self.place(q)
        work = self.work
        corner = np.array(boxes.corner(work, other, k))
        place = np.array([work.box_x[other], work.box_y[other]]) + corner
        core = self.polygon(box, q)
        sides = list(zip(core, np.roll(core, -1, axis=0), strict=True))
        away = min(reference.distance_to_segment(place, *ends) for ends in sides)
        # Counter-clockwise: what is inside lies to the left of every side.
        inside = all(np.linalg.det([end - begin, place - begin]) > 0.0 for begin, end in sides)
        return (-away if inside else away) - self.radii(box, other)

    def random_q(self, rng):
        joints = rng.uniform(-np.pi / 2, np.pi / 2, self.n)
        joints[: self.lo] = 0.0
        joints[0] = 0.0 if self.lo else joints[0]
        base = rng.uniform(0.0, 0.01) if self.lo else 0.0
        return np.append(np.cumsum(joints), [base, 0.0])


def pairs(case):
    """All the pairs that the engine looks at."""
    for i in range(max(case.lo - 1, 0), case.n):
        j = boxes.next_partner(case.model, case.lo, i, i)
        while j < case.n + boxes.OBSTACLES:
            yield i, j
            j = boxes.next_partner(case.model, case.lo, i, j)


layouts = st.sampled_from([(7, 0, False), (7, 3, True), (6, 1, True), (6, 0, True)])


@given(seed=seeds, layout=layouts)
def test_gap_is_the_distance_of_the_rounded_boxes(seed, layout):
    n, lo, tube = layout
    rng = np.random.default_rng(seed)
    case = Boxes(n, lo, tube=tube)
    q = case.random_q(rng)
    for i, j in pairs(case):
        if reference.separation(case.polygon(i, q), case.polygon(j, q)) <= 0.0:
            continue
        case.place(q)
        gaps = [boxes.corner_gap(case.model, case.work, i, j, k) for k in range(4)]
        gaps += [boxes.corner_gap(case.model, case.work, j, i, k) for k in range(4)]
        assert min(gaps) == pytest.approx(case.gap(i, j, q), abs=1e-15)


def test_engine_looks_at_every_pair_that_can_meet():
    free = {(i, j) for i in range(7) for j in range(i + 4, 7)}
    assert set(pairs(Boxes(7))) == free
    # Components 0 and 1 are deep in the tube, 2 sticks out of it; the walls are boxes 7 and 8.
    held = {(2, j) for j in (6,)} | {(i, w) for i in range(3, 7) for w in (7, 8)}
    assert set(pairs(Boxes(7, 3, tube=True))) == held


@given(seed=seeds)
def test_a_corner_beyond_a_wall_is_told_from_one_in_front_of_it(seed):
    rng = np.random.default_rng(seed)
    case = Boxes(5, 0, tube=True)
    case.place(case.random_q(rng))
    work, model = case.work, case.model
    wall, k = case.n + int(rng.integers(2)), int(rng.integers(4))
    # Somewhere at the mouth, at either face of the wall.
    work.box_x[2], work.box_y[2] = rng.uniform(-1.0, 1.0, 2) * SIDE + (0.0, work.box_y[wall])
    turn = rng.uniform(-np.pi, np.pi)
    work.box_c[2], work.box_s[2] = np.cos(turn), np.sin(turn)

    centre = np.array([work.box_x[2], work.box_y[2]])
    corner = centre + boxes.corner(work, 2, k)
    half_length, half = work.box_a[wall], work.box_b[wall]
    middle = np.array([work.box_x[wall], work.box_y[wall]])
    side = np.sign(centre[1] - middle[1])
    face = middle[1] + side * half
    before, behind = side * (centre[1] - face), side * (face - corner[1])
    expected = -1.0
    if before > 0.0 and behind > 0.0:
        crossing = np.interp(0.0, [-before, behind], [centre[0], corner[0]])
        if abs(crossing - middle[0]) <= half_length:
            expected = behind + case.radii(wall, 2)
    assert boxes.behind_face(model, work, wall, 2, k) == pytest.approx(expected, abs=1e-12)


@given(seed=seeds)
def test_every_touching_corner_becomes_a_row(seed):
    # A far-reaching touch, so that random chains have contacts.
    rng = np.random.default_rng(seed)
    case = Boxes(7)
    q = case.random_q(rng)
    case.place(q)
    rows = contact.collect_contacts(0, case.model, case.work, 0)
    found = {tuple(row[:3]) for row in case.work.row_id[:rows].tolist()}
    touch = contact.TOUCH * SIDE
    for i, j in pairs(case):
        overlapping = reference.separation(case.polygon(i, q), case.polygon(j, q)) <= 0.0
        if overlapping or case.gap(i, j, q) < 0.9 * touch:
            inside = [k for k in range(4) if (i, j, k) in found or (j, i, k) in found]
            assert inside or overlapping
        elif case.gap(i, j, q) > 1.1 * touch:
            assert not [row for row in found if set(row[:2]) == {i, j}]


@given(seed=seeds)
def test_squares_overlap_where_no_side_separates_them(seed):
    case = Boxes(6)
    q = case.random_q(np.random.default_rng(seed))
    case.place(q)
    overlapping = []
    for i, j in pairs(case):
        expected = reference.separation(case.polygon(i, q), case.polygon(j, q))
        assert boxes.separation(case.work, i, j) == pytest.approx(expected, abs=1e-12)
        if expected < 2.0 * RADIUS - boxes.OVERLAP * SIDE:
            overlapping.append((i, j))
    assert boxes.overlapping_pair(case.model, case.work) == (overlapping or [(-1, -1)])[0]


@given(seed=seeds, layout=layouts)
def test_gaps_are_those_of_corners_and_negative_inside(seed, layout):
    n, lo, tube = layout
    rng = np.random.default_rng(seed)
    case = Boxes(n, lo, tube=tube)
    q = case.random_q(rng)
    for i, j in pairs(case):
        for box, other in ((i, j), (j, i)):
            for k in range(4):
                expected = case.row_gap(box, other, k, q)
                found = boxes.corner_gap(case.model, case.work, box, other, k)
                assert found == pytest.approx(expected, abs=1e-12)


def row_of(case, box, other, k, q, v):
    """Jacobian and bias of a contact row at the coordinates and velocities."""
    case.place(q)
    work, model, lo = case.work, case.model, case.lo
    chain.centre_velocities(lo, model.bodies, work.pose, v, work.vx, work.vy)
    chain.centripetal(lo, model.bodies, work.pose, v, work.ax, work.ay)
    work.row_id[0, :3] = box, other, k
    contact.contact_row(lo, model, work.pose, work, 0, v)
    return work.jacobian[0].copy(), work.bias[0]


def turns_a_corner(case, box, other, k, q):
    case.place(q)
    return boxes.corner_offset(case.work, box, other, k)[3]


def region(case, box, other, k, q):
    """Whether the corner turns around one, and if it is inside the box, behind which side."""
    case.place(q)
    *normal, distance, turns = boxes.corner_offset(case.work, box, other, k)
    return turns, tuple(normal) if distance < 0.0 else None


@given(seed=seeds, layout=layouts)
def test_rows_are_the_gaps_derivatives(seed, layout):
    n, lo, tube = layout
    rng = np.random.default_rng(seed)
    case = Boxes(n, lo, tube=tube)
    q = case.random_q(rng)
    v = np.append(rng.normal(0.0, 5.0, n), rng.normal(0.0, 0.1, 2))
    v[:lo] = 0.0
    choices = list(pairs(case))
    i, j = choices[rng.integers(len(choices))]
    box, other = (i, j) if rng.random() < 0.5 else (j, i)
    k = int(rng.integers(4))
    step = 2e-5
    ends = [q + t * step * v for t in (-3, 0, 3)]
    # At the end of a face the curvature jumps, deep inside the normal.
    assume(len({region(case, box, other, k, end) for end in ends}) == 1)
    radii = case.radii(box, other)
    assume(all(abs(case.row_gap(box, other, k, end) + radii) > 1e-4 for end in ends))

    def gap(t):
        return case.row_gap(box, other, k, q + t * v)

    jacobian, bias = row_of(case, box, other, k, q, v)
    speed = max(np.abs(jacobian * v).max(), 1e-3)
    assert jacobian @ v == pytest.approx(reference.derivative(gap, step), abs=1e-8 * speed)
    bend = reference.second_derivative(gap, 40 * step)
    coarse = [region(case, box, other, k, q + t * 120 * step * v) for t in (-1, 1)]
    assume(set(coarse) == {region(case, box, other, k, q)})
    assert bias == pytest.approx(bend, rel=1e-4, abs=1e-4)
    assert not jacobian[:lo].any()


def test_normal_turns_continuously_past_the_end_of_a_face():
    # The corner of one square slides off the end of another's face.
    case = Boxes(5)
    v = np.ones(7)
    rng = np.random.default_rng(3)
    checked = 0
    while checked < 5:
        q, aim = case.random_q(rng), rng.normal(0.0, 1.0, 7)
        flags = [turns_a_corner(case, 0, 4, 0, q + t * aim) for t in (0.0, 0.01)]
        if flags[0] == flags[1] or case.row_gap(0, 4, 0, q) < 1e-3:
            continue
        low, high = 0.0, 0.01
        for _ in range(50):
            middle = (low + high) / 2
            same = turns_a_corner(case, 0, 4, 0, q + middle * aim) == flags[0]
            low, high = (middle, high) if same else (low, middle)
        before, _ = row_of(case, 0, 4, 0, q + low * aim, v)
        after, _ = row_of(case, 0, 4, 0, q + high * aim, v)
        np.testing.assert_allclose(before, after, rtol=0, atol=1e-10)
        checked += 1


def test_stop_row_is_the_joints_angle():
    case = Boxes(4)
    for sign in (-1, 1):
        contact.stop_row(0, case.model, case.work, 0, 2, sign)
        expected = np.zeros(6)
        expected[2], expected[1] = -sign, sign
        np.testing.assert_array_equal(case.work.jacobian[0], expected)
        assert case.work.bias[0] == 0.0


def test_magnets_do_not_move_the_boxes():
    with_magnets = pack(Scene(sequence=("NNNN",) * 2, magnets=Magnets()))
    assert (with_magnets.side, with_magnets.rounding) == (SIDE, RADIUS)
