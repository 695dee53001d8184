"""Motions: what is compared, and how the paper's solver nears this project's where it can."""

import numpy as np
import pytest

from magfold_bench.paper import motions
from magfold_bench.paper.quoted import FRAME_RATE, SNAP


@pytest.fixture(scope="module")
def ours() -> motions.Motion:
    scene = motions.literal(motions.charges()[motions.WHOLE])
    return motions.follow(motions.exact(scene))


def test_frames_go_on_where_a_chain_rests(ours: motions.Motion) -> None:
    assert ours.time[-1] == pytest.approx(motions.UNTIL)
    assert np.diff(ours.time) == pytest.approx(1.0 / FRAME_RATE)
    assert ours.angles.shape == (ours.time.size, ours.scene.n)
    rest = ours.time > ours.end + 1.0 / FRAME_RATE
    assert rest.any()
    assert (ours.angles[rest] == ours.angles[-1]).all()


def test_a_motion_is_nowhere_from_itself(ours: motions.Motion) -> None:
    assert (motions.squared_error(ours, ours) == 0.0).all()
    assert (motions.displacement(ours, ours) == 0.0).all()


def test_turning_the_whole_chain_moves_centres_and_no_joint(ours: motions.Motion) -> None:
    turned = motions.Motion(**{**vars(ours), "angles": ours.angles + np.pi})
    assert motions.squared_error(ours, turned) == pytest.approx(0.0, abs=1e-25)
    first = 6 * ours.scene.casing.diagonal  # twice the mean distance from the pin
    assert motions.displacement(ours, turned)[0] == pytest.approx(first)


def test_snaps_are_when_joints_first_pass_81_degrees(ours: motions.Motion) -> None:
    snaps = ours.snaps()
    assert list(snaps.values()) == sorted(snaps.values())
    for joint, at in snaps.items():
        angle = np.abs(ours.joints[:, joint - 1])
        assert (angle[ours.time < at] < SNAP).all()
        assert angle[ours.time == at] >= SNAP
    assert motions.before_snap(ours).sum() == round(min(snaps.values()) * FRAME_RATE)


def test_contact_wins_no_energy_but_the_snap_does(ours: motions.Motion) -> None:
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
