"""Tests of Coulomb's law against closed forms, and of sticking without creep."""

import math

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.simulation.session import Session

pytestmark = pytest.mark.laws


def block(**changes) -> Session:
    """Two casings in line, free on the floor, no magnets: pushed evenly, they move as one block.

    (A single casing has no joint and so is at rest by definition.)
    """
    scene = mf.Scene(sequence=("NNNN", "NNNN"), magnets=None, start_angle_spread=0.0)
    return Session(scene.replace(**changes).draw(np.random.default_rng(0)))


@pytest.mark.parametrize(
    ("friction", "velocity"),
    [(0.1, (0.3, 0.4)), (0.35, (0.3, 0.4)), (2.0, (0.3, 0.4)), ((0.1, 0.4), (0.5, 0.0))],
)
def test_a_sliding_block_stops_where_coulomb_says(friction, velocity):
    """Each casing has its own friction, and the forces of casings in line add up."""
    session = block(friction=friction)
    session._state.v[2:] = velocity
    session.settle()
    slowing = np.mean(friction) * 9.8
    # What would slide on by less than a share of the tolerance is stopped at once.
    assert session.time == pytest.approx(0.5 / slowing, rel=5e-3)
    way = np.array(velocity) * 0.5 / (2 * slowing)
    assert session.base == pytest.approx(way, rel=1e-3, abs=1e-9)
    assert (session.rates == 0.0).all()


def test_a_pinned_block_stops_spinning_after_the_time_its_torque_takes():
    scene = mf.Scene(sequence=("NNNN",), magnets=None, mount="pinned", start_angle_spread=0.0)
    session = Session(scene.draw(np.random.default_rng(0)))
    session._state.v[0] = 40.0
    session.settle()
    side = scene.casing.side
    reach2 = side**2 / 2
    # Along the ellipsoid the centre's speed and the spin add up to one slip.
    torque = 0.35 * 9.8 * np.sqrt(reach2 + (0.3826 * side) ** 2)
    slowing = torque / (reach2 + side**2 / 6)
    assert session.angles[0] == pytest.approx(40.0**2 / (2 * slowing), rel=2e-3)
    assert session.time == pytest.approx(40.0 / slowing, rel=2e-3)


def slope(kind, share):
    """Return friction and gravity of a floor on which gravity is a share of the friction limit."""
    if kind == "pull":
        return 0.35, mf.Gravity(in_plane=(share * 0.35 * 9.8, 0.0))
    normal, along = mf.Spreads(tilt=1.0).tilted(mf.Gravity(), np.array([1.0, 0.25]))
    angle = math.radians(1.0)
    assert normal == pytest.approx(9.8 * math.cos(angle))
    assert along == pytest.approx([9.8 * math.sin(angle) / math.sqrt(2.0)] * 2)
    gravity = mf.Gravity(normal=float(normal), in_plane=(float(along[0]), float(along[1])))
    return math.tan(angle) / share, gravity


@pytest.mark.parametrize("kind", ["pull", "tilt"])
@pytest.mark.parametrize("share", [0.5, 0.999, 1.001, 3.0])
def test_a_block_on_a_slope_holds_exactly_below_the_threshold(kind, share):
    (friction, gravity), until = slope(kind, share), 0.1
    session = block(friction=friction, gravity=gravity, duration=until)
    session.settle()
    if share < 1:
        assert session.status is mf.FoldStatus.MISFOLDED
        assert (session.base == 0.0).all()
    else:
        assert session.status is mf.FoldStatus.UNSETTLED
        way = 0.5 * (1 - 1 / share) * np.array(gravity.in_plane) * until**2
        assert session.base == pytest.approx(way, rel=1e-5, abs=1e-12)


@pytest.mark.parametrize("mount", ["free", "tube"])
def test_one_number_for_the_floor_is_as_many_alike(mount):
    scene = mf.load_scene("paper/sequence-1").replace(mount=mount, duration=0.5)
    one, each = (
        mf.simulate(scene.replace(friction=friction), 3) for friction in (0.2, (0.2,) * scene.n)
    )
    assert (one.angles == each.angles).all()
    kept = "status", "time", "steps", "energy"
    assert [getattr(one, name) for name in kept] == [getattr(each, name) for name in kept]


@pytest.mark.parametrize("smooth", [0, 1])
@pytest.mark.parametrize("share", [0.999, 1.001])
def test_a_component_without_friction_leaves_all_of_the_pull_to_its_neighbour(smooth, share):
    friction, pull = np.roll([0.0, 0.35], smooth), share * 0.5 * 0.35 * 9.8
    session = block(friction=friction, gravity={"in_plane": (pull, 0.0)}, duration=0.1)
    session.settle()
    way = 0.5 * max(pull - 0.5 * 0.35 * 9.8, 0.0) * 0.1**2
    assert session.base == pytest.approx([way, 0.0], rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_a_misfold_put_down_again_stays_put(seed):
    scene = mf.load_scene("paper/sequence-1").replace(duration=1000.0)
    fold = mf.simulate(scene, seed)
    assert fold.status is mf.FoldStatus.MISFOLDED
    joints = np.clip(fold.joint_angles, -np.pi / 2, np.pi / 2)
    again = mf.simulate(fold.scene.replace(start_angles=joints))
    assert again.joint_angles == pytest.approx(fold.joint_angles, abs=1e-12)
    assert (again.base == 0.0).all()
