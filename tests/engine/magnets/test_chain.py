"""Tests of magnets of a chain, from tables, sums and caches, against sums over all nodes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import magfold_env as mf
from magfold_bench.laws import exact_magnets
from magfold_env.engine.chain import articulated as chain
from magfold_env.engine.chain import tube
from magfold_env.engine.magnets.chain import add_chain_forces, chain_energy
from magfold_env.engine.state import Loads
from magfold_env.engine.workspace import new_work
from magfold_env.shapes import word_to_angles
from magfold_env.simulation.pack import pack
from tests.engine import reference
from tests.engine.magnets.test_pairs import MODELS, Casings, random_sequence
from tests.reference import touching_faces

SIDE = 0.0125
BOUNDS = [1e-2, 1e-3, 1e-4, 1e-5]
seeds = st.integers(0, 2**32 - 1)


class Chain:
    """A chain that the kernels of the dynamics evaluate."""

    def __init__(self, scene):
        self.model = pack(scene)
        self.work = new_work(self.model)

    def forces(self, joints, lo=0):
        """Return generalised forces (n + 2,) for the first heading and the joint angles, (n,)."""
        model, work = self.model, self.work
        q = np.append(np.cumsum(joints), [0.0, 0.0])
        first = tube.place_all(lo, model, q, work.pose)
        loads = Loads(*np.zeros((3, model.n)))
        add_chain_forces(first, lo, model, q, work.pose, work.nodes, work.rigid, loads)
        out = np.zeros(model.n + 2)
        chain.generalise(lo, model.bodies, work.pose, loads, out)
        return out

    def energy(self, joints):
        q = np.append(np.cumsum(joints), [0.0, 0.0])
        tube.place_all(0, self.model, q, self.work.pose)
        return chain_energy(0, self.model, q, self.work.pose, self.work.nodes)


def open_joints(rng, n):
    """Draw joint angles within the stops, some close to them."""
    joints = rng.uniform(-1.5, 1.5, n)
    near = rng.random(n) < 0.4
    return np.where(near, rng.choice([-1.0, 1.0], n) * (np.pi / 2 - 0.05 * rng.random(n)), joints)


def worst_error(scene, joints):
    """Return the largest error of joint torques against fine sums, in flush forces times sides."""
    q = np.append(np.cumsum(joints), [0.0, 0.0])
    casings = Casings(scene.replace(magnets={"accuracy": 1e-7}))
    force, torque = casings.forces(reference.centres(q, SIDE), q[:-2])
    jacobian = reference.velocity_map(q, SIDE)[:, :, :-2]
    wanted = np.einsum("idk,id->k", jacobian, force) + torque
    # A joint's torque is the sum of the headings' beyond it.
    error = np.cumsum((Chain(scene).forces(joints)[:-2] - wanted)[::-1])
    return np.abs(error).max() / SIDE / touching_faces.flush_force(scene)


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("share", [1.0, 1.0 - 1e-6, 0.999, 0.97, 0.6])
@pytest.mark.parametrize("inset", [0.0, 1e-4, 5e-4])
def test_torques_of_folded_chains_keep_the_bound(inset, share, bound):
    rng = np.random.default_rng(66)
    for word in ("LLLRRR", "LLSRRL", "RRRSLL"):
        magnets = mf.Magnets(inset=inset, accuracy=bound)
        scene = mf.Scene(sequence=random_sequence(rng, 7), magnets=magnets)
        # Errors of the components' forces add up over the chain's length.
        assert worst_error(scene, np.append(0.3, share * word_to_angles(word))) <= 3 * bound


@pytest.mark.parametrize("model", [name for name in MODELS if name.startswith("unequal")])
def test_torques_of_unequal_magnets_keep_the_bound(model):
    rng = np.random.default_rng(64)
    for _ in range(5):
        sequence = tuple("".join(rng.choice(list("NS-"), 4, p=[0.4, 0.4, 0.2])) for _ in range(5))
        scene = mf.Scene(sequence=sequence, magnets=MODELS[model])
        assert pack(scene).magnets.tables.end > 0.0
        assert worst_error(scene, open_joints(rng, 5)) <= 3e-3


@pytest.mark.laws
@pytest.mark.parametrize("bound", BOUNDS)
def test_generalised_forces_are_the_energys_gradient(bound):
    rng = np.random.default_rng(34)
    checked = 0
    while checked < 8:
        scene = mf.Scene(sequence=random_sequence(rng, 5), magnets=mf.Magnets(accuracy=bound))
        joints = open_joints(rng, 5)
        # In headings: a step turns one component.
        turns = 1e-4 * (np.eye(5) - np.eye(5, k=1))
        if any(crosses(scene, joints - 3 * turn, joints + 3 * turn) for turn in turns):
            continue
        found = Chain(scene).forces(joints)[:5]
        expected = [-slope(Chain(scene), joints, turn) / 1e-4 for turn in turns]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * np.abs(found).max())
        checked += 1


def slope(chain, joints, turn):
    return reference.derivative(lambda t: chain.energy(joints + t * turn), 1.0)


def crosses(scene, before, after):
    """Return whether a blend begins or ends between two shapes."""
    casings = Casings(scene)
    headings = [np.cumsum(joints) for joints in (before, after)]
    places = [reference.centres(np.append(turned, [0.0, 0.0]), SIDE) for turned in headings]
    return casings.crosses_an_edge(*zip(places, headings, strict=True))


def test_what_is_kept_depends_on_charges_and_not_on_what_came_before() -> None:
    rng = np.random.default_rng(36)
    scene = mf.Scene(sequence=random_sequence(rng, 6))
    used = Chain(scene)
    for word in ["LLLRR", "LRLLL", "LLLRL", "RRRLL", "LLLRR"]:
        for slack in (0.0, 5e-10, 0.2):
            joints = np.append(rng.normal(), (1 - slack) * word_to_angles(word))
            fresh = Chain(scene).forces(joints)
            assert (used.forces(joints) == fresh).all()
            assert (used.forces(joints) == fresh).all()
    rng = np.random.default_rng(37)
    used = Chain(mf.Scene(sequence=random_sequence(rng, 6)))
    for word in ["LLLRR", "SSLRL"]:
        joints = np.append(0.2, word_to_angles(word))
        used.forces(joints)
        fresh = Chain(mf.Scene(sequence=random_sequence(rng, 6)))
        fresh.model.charge[rng.integers(6)] = 0.0
        used.model.charge[:] = fresh.model.charge
        assert (used.forces(joints) == fresh.forces(joints)).all()


@given(seed=seeds, lo=st.integers(1, 5))
def test_held_components_act_on_those_outside(seed, lo):
    rng = np.random.default_rng(seed)
    scene = mf.Scene(sequence=random_sequence(rng, 6), mount="tube")
    joints = open_joints(rng, 6)
    joints[: lo + 1] *= 1e-3
    jointed = Chain(scene)
    np.testing.assert_allclose(
        # Where poles almost coincide, forces are so large that rounding exceeds the absolute limit.
        jointed.forces(joints, lo)[lo:6], jointed.forces(joints)[lo:6], rtol=1e-12,
        atol=1e-9 * exact_magnets.flush_force(scene) * SIDE,
    )  # fmt: skip


@pytest.mark.parametrize("change", [
    {"contact": False, "friction": 0.0},
    {"magnets": {"nodes": 5}},
    {"magnets": mf.Magnets(model="points", pole_charge=8.6)},
    {"magnets": {"accuracy": 1e-8}},
])  # fmt: skip
def test_chains_that_splines_do_not_fit_are_summed(change):
    rng = np.random.default_rng(38)
    scene = mf.Scene(sequence=random_sequence(rng, 4)).replace(**change)
    assert pack(scene).magnets.tables.end == 0.0
    joints = open_joints(rng, 4) / 2
    force, torque = mf.forces(scene, np.cumsum(joints))
    jacobian = reference.velocity_map(np.append(np.cumsum(joints), [0.0, 0.0]), SIDE)[:, :, :4]
    expected = np.einsum("idk,id->k", jacobian, force) + torque
    found = Chain(scene).forces(joints)[:4]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
