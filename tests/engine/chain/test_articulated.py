"""Tests of the O(n) recursion against dense matrices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import magfold_env as mf
from magfold_bench.laws.mechanics import pinned_accelerations
from magfold_env.engine.chain import articulated
from magfold_env.engine.state import Loads
from magfold_env.engine.stepping.dynamics import smooth_accelerations
from magfold_env.engine.workspace import new_work
from magfold_env.simulation.pack import pack
from tests.engine import reference

SIDE = 0.0125


def random_scene(rng, n, magnets=True, gravity=(0.0, 0.0)):
    """Return a chain whose masses and inertias vary by a factor of up to ten."""
    masses = 0.0037 * 10 ** rng.uniform(-0.5, 0.5, n)
    inertias = 0.0037 * SIDE**2 / 6 * 10 ** rng.uniform(-0.5, 0.5, n)
    return mf.Scene(
        sequence=tuple("".join(rng.choice(["N", "S"], 4)) for _ in range(n)),
        casing=mf.Casing(side=SIDE, mass=tuple(masses.tolist()), inertia=tuple(inertias.tolist())),
        magnets=mf.Magnets(nodes=2) if magnets else None,
        gravity=mf.Gravity(in_plane=(float(gravity[0]), float(gravity[1]))),
    )


def random_state(rng, n):
    """Return headings of a chain bent within its stops, and random rates."""
    joints = rng.uniform(-np.pi / 2, np.pi / 2, n)
    return np.cumsum(joints), rng.normal(0.0, 30.0, n)


def assert_agree(found, expected, rates):
    """Check agreement to 1e-12 of the largest value, or to rounding if all vanish (n = 1)."""
    slack = 1e-12 * np.abs(expected).max() + 1e-16 * np.square(rates).max()
    np.testing.assert_allclose(found, expected, rtol=0, atol=slack)


def in_steps(scene, angles, rates):
    """Return accelerations by the kernels that a step calls."""
    model = pack(scene.replace(mount="pinned"))._replace(contact=False, frictional=False)
    out, still = np.zeros(scene.n + 2), [0.0, 0.0]
    q, v = np.append(angles, still), np.append(rates, still)
    smooth_accelerations(0, model, q, v, new_work(model), out)
    return out[: scene.n]


@pytest.mark.parametrize("gravity", [(0.0, 0.0), (3.0, -9.8)])
@pytest.mark.parametrize("magnets", [False, True])
@pytest.mark.parametrize(
    "lengths", [(1, 2, 3, 5, 8, 16, 33, 60), pytest.param(range(1, 61), marks=pytest.mark.slow)]
)
def test_accelerations_solve_equation_39(lengths, magnets, gravity):
    rng = np.random.default_rng(39)
    for n in lengths:
        scene = random_scene(rng, n, magnets, gravity)
        angles, rates = zip(random_state(rng, n), random_state(rng, n), strict=True)
        found = mf.accelerations(scene, np.array(angles), np.array(rates))
        for q, v, stacked in zip(angles, rates, found, strict=True):
            expected = pinned_accelerations(scene, q, v, *mf.forces(scene, q))
            assert_agree(stacked, expected, v)
            assert_agree(in_steps(scene, q, v), expected, v)


def in_engine(rng, n):
    """Return model, scratch space and random coordinates (n + 2,) of a chain with its pose set."""
    scene = random_scene(rng, n, magnets=False)
    model = pack(scene)._replace(contact=False, frictional=False)
    work = new_work(model)
    q = np.append(random_state(rng, n)[0], rng.normal(0.0, 0.05, 2))
    articulated.place(0, model.bodies, q, work.pose)
    return scene, model, work, q


def solved(rng, model, work, lock, base):
    """Return random generalised forces (n + 2,) and the accelerations that they cause."""
    force = rng.normal(0.0, 1.0, model.n + 2) * np.append(np.full(model.n, SIDE), [1.0, 1.0])
    out = np.empty(model.n + 2)
    articulated.factor(0, model.bodies, work.pose, lock, work.chain)
    articulated.solve(0, model.bodies, work.pose, lock, base, force, out, work.chain)
    return force, out


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 60))
def test_free_chain_solves_the_dense_mass_matrix(seed, n):
    rng = np.random.default_rng(seed)
    scene, model, work, q = in_engine(rng, n)
    force, out = solved(rng, model, work, work.chain.unlocked, articulated.FREE)
    matrix = reference.mass_matrix(q, SIDE, scene.masses, scene.inertias)
    expected = np.linalg.solve(matrix, force)
    scale = np.append(np.full(n, 1.0), [SIDE, SIDE])
    np.testing.assert_allclose(
        out / scale, expected / scale, rtol=0, atol=1e-11 * np.abs(expected / scale).max()
    )


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 12))
def test_kinematics_are_the_derivatives_of_the_centres(seed, n):
    rng = np.random.default_rng(seed)
    _, model, work, q = in_engine(rng, n)
    v = np.append(rng.normal(0.0, 5.0, n), rng.normal(0.0, 0.1, 2))
    articulated.centre_motion(0, model.bodies, work.pose, v, work.centres)

    def path(t):
        return reference.centres(q + t * v, SIDE)

    np.testing.assert_allclose(np.stack([work.pose.x, work.pose.y], axis=1), path(0.0), atol=1e-15)
    speed = reference.derivative(path, 1e-3)
    bend = reference.second_derivative(path, 3e-3)
    moves = work.centres
    np.testing.assert_allclose(np.stack([moves.vx, moves.vy], axis=1), speed, atol=1e-9)
    np.testing.assert_allclose(np.stack([moves.ax, moves.ay], axis=1), bend, atol=1e-6)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 60))
def test_generalised_forces_do_the_work_of_the_forces(seed, n):
    rng = np.random.default_rng(seed)
    _, model, work, q = in_engine(rng, n)
    force, torque = rng.normal(0.0, 1.0, (n, 2)), rng.normal(0.0, SIDE, n)
    out = np.empty(n + 2)
    loads = Loads(force[:, 0].copy(), force[:, 1].copy(), torque)
    articulated.generalise(0, model.bodies, work.pose, loads, out)
    expected = np.einsum("idk,id->k", reference.velocity_map(q, SIDE), force)
    expected[:n] += torque
    np.testing.assert_allclose(out, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(2, 20), held=st.booleans())
def test_locked_joints_move_as_the_constrained_mass_matrix_says(seed, n, held):
    # M a = Q + Jᵀτ with one row a locked joint, J a = 0; if held, component 0 may lock to the base.
    rng = np.random.default_rng(seed)
    scene, model, work, q = in_engine(rng, n)
    lock = rng.integers(-1, 2, n)
    lock[0] = 1 if held and rng.integers(2) else 0
    base = articulated.DRIVEN if held else articulated.FREE
    force, out = solved(rng, model, work, lock, base)
    matrix = reference.mass_matrix(q, SIDE, scene.masses, scene.inertias)
    relative = np.eye(n, n + 2) - np.eye(n, n + 2, -1)
    rows = relative[lock != 0]
    if held:
        rows = np.concatenate([rows, np.eye(n + 2)[n:]])
    size = len(rows)
    scale = np.append(np.full(n, SIDE), [1.0, 1.0])  # torques and forces of one size
    system = np.block([[matrix / scale[:, None], rows.T], [rows, np.zeros((size, size))]])
    solution = np.linalg.solve(system, np.append(force / scale, np.zeros(size)))
    np.testing.assert_allclose(
        out * scale, solution[: n + 2] * scale, rtol=0, atol=1e-10 * np.abs(solution).max()
    )
    assert not np.diff(out[:n])[lock[1:] != 0].any()
    assert not work.chain.hold[lock == 0].any()
    # What holds the joints does no net work and makes up for the rest of the equation.
    torque = matrix @ out - force
    torque[:n] += np.append(work.chain.hold[1:], 0.0) - work.chain.hold
    kept = slice(0, n) if held else slice(None)
    np.testing.assert_allclose(
        torque[kept] / scale[kept], 0.0, atol=1e-9 * np.abs(force / scale).max()
    )
