"""Typical rates: those of pendulums that the strongest force drives."""

import math

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.simulation.pack import pack
from magfold_env.simulation.pack_rates import SLOWEST, typical_rate

SCENE = mf.load_scene("paper/sequence-3").replace(mount="free")
MAGNETS = SCENE.magnets or mf.Magnets()
BLOCK = {"position": (0.1, 0.1), "width": 0.02, "height": 0.02, "thickness": 0.01}


def rate_of(scene, mass=0.0037):
    charge = 0.0 if scene.magnets is None else scene.magnets.charge
    return float(typical_rate(scene, np.full(1, charge), np.full(1, mass))[0])


def test_gravity_alone_gives_the_rate_of_a_pendulum():
    scene = SCENE.replace(magnets=None, gravity={"in_plane": (3.0, -4.0)})
    expected = math.sqrt(5.0 / scene.casing.diagonal)
    assert rate_of(scene) == pytest.approx(expected, rel=1e-12)
    assert rate_of(scene, mass=1e-6) == pytest.approx(expected, rel=1e-12)


def test_rates_go_with_the_charges_and_against_the_root_of_the_mass():
    assert rate_of(SCENE, mass=0.01) == pytest.approx(0.1 * rate_of(SCENE, mass=1e-4), rel=1e-12)
    stronger = SCENE.replace(magnets={"remanence": 1.2})
    weaker = SCENE.replace(magnets={"remanence": 0.6})
    assert rate_of(stronger) == pytest.approx(2.0 * rate_of(weaker), rel=1e-12)


def test_nothing_is_slower_than_the_slowest():
    assert rate_of(SCENE.replace(magnets=None)) == SLOWEST


def test_the_rate_is_of_the_order_that_touching_faces_make_of_a_component():
    angles = np.zeros(SCENE.n)
    angles[1:] = np.pi / 2.0
    push = np.abs(mf.forces(SCENE, angles)[0]).max() / SCENE.casing.mass
    assert 0.1 < rate_of(SCENE) / math.sqrt(push / SCENE.casing.diagonal) < 10.0


@pytest.mark.parametrize("field", [{"uniform": (0.3, 0.4)}, {"magnet": BLOCK}])
def test_fields_from_outside_make_it_faster_as_their_flux_density_does(field):
    # A flux density of 0.5 T on full charges; a block's is of the order of its remanence.
    scene = SCENE.replace(field=field)
    force = rate_of(scene) ** 2 * scene.casing.diagonal * 0.0037
    own = rate_of(SCENE) ** 2 * SCENE.casing.diagonal * 0.0037
    assert 0.01 < (force - own) / MAGNETS.charge < 0.6


def test_light_components_set_the_scale_of_times_and_the_mean_mass_that_of_errors():
    mass = [1e-5] + [0.01] * (SCENE.n - 1)
    model = pack(SCENE.replace(casing={"mass": mass}))
    assert model.light_rate == rate_of(SCENE, mass=1e-5)
    assert model.rate_scale == rate_of(SCENE, mass=float(np.mean(mass)))
    even = pack(SCENE)
    assert even.light_rate == pytest.approx(even.rate_scale, rel=1e-12)
