"""Tests of the magnets benchmark's exact reference, for equal and unequal faces."""

import numpy as np
import pytest

from magfold_bench.laws import exact_magnets
from magfold_bench.magnets.peers import Peer, installed
from magfold_bench.magnets.samples import sample_of
from tests.benchmarks.magnet_pairs import SIDE, alike, unequal
from tests.engine import reference as engine_reference

of_equal_and_unequal_faces = pytest.mark.parametrize("pair", [alike, unequal])


def akoun_yonnet(offset, width, height):
    """In-plane force (2,) between parallel rectangles of unit charge, without µ0/4π [1/m²].

    Akoun and Yonnet's closed form; `offset` is along the width and across the faces.
    """
    total = np.zeros(2)
    w = offset[1]
    for i, j, k, m in np.ndindex(2, 2, 2, 2):
        sign = (-1) ** (i + j + k + m)
        u = offset[0] + ((-1) ** j - (-1) ** i) * width / 2
        v = ((-1) ** m - (-1) ** k) * height / 2
        r = np.sqrt(u**2 + v**2 + w**2)
        angle = np.arctan(u * v / (r * w))
        total[0] += sign * (
            (v**2 - w**2) / 2 * np.log(r - u) + u * v * np.log(r - v) + v * w * angle + r * u / 2
        )
        total[1] += sign * (-u * w * np.log(r - u) - v * w * np.log(r - v) + u * v * angle - r * w)
    return total / (width * height) ** 2


@pytest.mark.parametrize("aside", [0.0, 0.0015, 0.009])
@pytest.mark.parametrize("gap", [0.001, 0.006, 0.02])
def test_two_parallel_faces_meet_the_closed_form(aside, gap):
    size = np.array([[0.006, 0.005]])
    offset = np.array([[aside, gap]])
    pull, _ = exact_magnets.rectangle_pull(
        offset, np.zeros(1), size, size, *exact_magnets.RULES[0][1:]
    )
    closed = akoun_yonnet(offset[0], *size[0])
    np.testing.assert_allclose(pull[0], closed, rtol=0, atol=1e-10 * np.abs(closed).max())


@of_equal_and_unequal_faces
@pytest.mark.parametrize("seed", range(12))
def test_more_nodes_do_not_change_the_reference(pair, seed, monkeypatch):
    scene, pose = pair(seed)
    before = exact_magnets.forces(scene, *pose)
    finer = tuple((start, 2 * m, 2 * k) for start, m, k in exact_magnets.RULES)
    monkeypatch.setattr(exact_magnets, "RULES", finer)
    after = exact_magnets.forces(scene, *pose)
    unit = exact_magnets.flush_force(scene)
    np.testing.assert_allclose(before[0], after[0], rtol=0, atol=1e-9 * unit)
    np.testing.assert_allclose(before[1], after[1], rtol=0, atol=1e-9 * unit * SIDE)


@of_equal_and_unequal_faces
@pytest.mark.parametrize("seed", range(6))
def test_the_reference_is_what_many_strips_converge_to(pair, seed):
    scene, (places, headings) = pair(seed)
    force, torque = exact_magnets.forces(scene, places, headings)
    summed, turning, _ = engine_reference.magnet_forces(places, headings, scene, 60)
    bound = 1e-9 * exact_magnets.flush_force(scene)
    np.testing.assert_allclose(force, summed, rtol=0, atol=bound)
    np.testing.assert_allclose(torque, turning, rtol=0, atol=bound * SIDE)


@pytest.mark.skipif(not installed(), reason="magpylib is not installed")
@of_equal_and_unequal_faces
@pytest.mark.parametrize("seed", range(3))
def test_magpylib_converges_to_the_reference(pair, seed):
    scene, pose = pair(seed)
    sample = sample_of([scene], [pose])
    peer = Peer(scene, *pose)
    coarse, fine = (sample.errors(peer.loads(mesh))[0] for mesh in ((2, 4, 4), (6, 12, 12)))
    # Cells are a third as wide: of second order the error is a ninth.
    assert fine < 0.16 * coarse
    assert fine < 5e-3


def test_the_flush_force_is_the_strongest_faces():
    scene, _ = unequal(4)
    assert scene.magnets is not None
    inset, width, height = (scene.magnets.by_face(name) for name in ("inset", "width", "height"))
    strongest = scene.magnets.charges(scene.n).max(axis=0)
    closed = [
        exact_magnets.COULOMB
        * strongest[f] ** 2
        * abs(akoun_yonnet(np.array([0.0, 2 * inset[f]]), width[f], height[f])[1])
        for f in range(4)
    ]
    assert exact_magnets.flush_force(scene) == pytest.approx(max(closed))


def test_empty_faces_are_not_there():
    scene, pose = unequal(3)
    none = scene.replace(sequence=("----", "NSNS"))
    force, torque = exact_magnets.forces(none, *pose)
    assert not force.any()
    assert not torque.any()
