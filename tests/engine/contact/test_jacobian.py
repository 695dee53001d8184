"""Tests of rows of contacts and stops: which exist, and that they are derivatives of gaps."""

import numpy as np
import pytest
from hypothesis import assume, given

from magfold_env.engine.chain import articulated
from magfold_env.engine.contact import boxes
from magfold_env.engine.contact import jacobian as contact
from tests.engine import reference
from tests.engine.contact.box_case import SIDE, Boxes, layouts, pairs, seeds


@given(seed=seeds)
def test_every_touching_corner_becomes_a_row(seed):
    # A far-reaching touch, so that random chains have contacts.
    rng = np.random.default_rng(seed)
    case = Boxes(7)
    q = case.random_q(rng)
    case.place(q)
    touch = contact.TOUCH * SIDE
    rows = contact.collect_contacts(0, case.model, case.work, 0, touch)
    found = {tuple(row[:3]) for row in case.work.rows.id[:rows].tolist()}
    for i, j in pairs(case):
        overlapping = reference.separation(case.polygon(i, q), case.polygon(j, q)) <= 0.0
        if overlapping or case.gap(i, j, q) < 0.9 * touch:
            inside = [k for k in range(4) if (i, j, k) in found or (j, i, k) in found]
            assert inside or overlapping
        elif case.gap(i, j, q) > 1.1 * touch:
            assert not [row for row in found if set(row[:2]) == {i, j}]


def row_of(case, box, other, k, q, v):
    """Return the Jacobian and bias of a contact row at the coordinates and velocities."""
    case.place(q)
    work, model, lo = case.work, case.model, case.lo
    articulated.centre_motion(lo, model.bodies, work.pose, v, work.centres)
    work.rows.id[0, :3] = box, other, k
    contact.contact_row(lo, model, work.pose, work, 0, v)
    return work.rows.jacobian[0].copy(), work.rows.bias[0]


def turns_a_corner(case, box, other, k, q):
    case.place(q)
    return boxes.corner_offset(case.work, box, other, k)[3]


def region(case, box, other, k, q):
    """Return whether the box's nearest point is a corner, and the normal if `other` is inside."""
    case.place(q)
    *normal, distance, turns = boxes.corner_offset(case.work, box, other, k)
    return turns, tuple(normal) if distance < 0.0 else None


@given(seed=seeds, layout=layouts)
def test_rows_are_the_gaps_derivatives(seed, layout):
    rng = np.random.default_rng(seed)
    case = Boxes(**layout)
    q = case.random_q(rng)
    v = np.append(rng.normal(0.0, 5.0, case.n), rng.normal(0.0, 0.1, 2))
    v[: case.lo] = 0.0
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
    assert not jacobian[: case.lo].any()


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
