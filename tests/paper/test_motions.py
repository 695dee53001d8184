"""Tests of compared motions, and of how the paper's solver approaches this project's."""

import numpy as np
import pytest

from magfold_bench.paper import motions
from magfold_bench.paper.quoted import FRAME_RATE, SNAP


@pytest.fixture(scope="module")
def ours() -> motions.Motion:
    scene = motions.literal(motions.charges()[motions.WHOLE])
    return motions.follow(motions.exact(scene))


def test_joints_snap_at_81_degrees_and_contact_wins_no_energy_but_the_snap(ours):
    snaps = ours.snaps()
    assert list(snaps.values()) == sorted(snaps.values())
    for joint, at in snaps.items():
        angle = np.abs(ours.joints[:, joint - 1])
        assert (angle[ours.time < at] < SNAP).all()
        assert angle[ours.time == at] >= SNAP
    assert motions.before_snap(ours).sum() == round(min(snaps.values()) * FRAME_RATE)
    assert ours.gained <= 1e-9
    assert ours.freed > 0.0
    literal = motions.follow(motions.default_steps(motions.charges()[motions.WHOLE]))
    assert literal.gained > ours.freed


@pytest.mark.laws
def test_without_friction_both_solvers_near_each_other_like_the_time_step() -> None:
    scene = motions.literal(motions.charges()[motions.HALF]).replace(friction=0.0)
    reference = motions.follow(motions.exact(scene))
    errors: list[float] = []
    for count in (10, 40):
        found = motions.follow(motions.stepped(scene, count))
        early = motions.before_snap(found, reference)
        errors.append(float(np.sqrt(motions.squared_error(found, reference)[early].mean())))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
