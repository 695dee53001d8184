"""Tests of floor friction: its rows, the sliding law, and sticking."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_env.engine.chain import articulated
from magfold_env.engine.chain.tube import place_all
from magfold_env.engine.friction import law
from magfold_env.engine.friction.sticking import first_accelerations
from magfold_env.engine.stepping.dynamics import accelerations
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.scene import Gravity, Scene
from magfold_env.simulation.pack import pack
from tests.engine import reference
from tests.engine.friction.test_solver import assert_coulomb

SIDE = 0.0125
MU, G = 0.35, 9.8
seeds = st.integers(0, 2**32 - 1)


class Floor:
    """A chain without magnets, lying bent on the floor and pushed along it by gravity."""

    def __init__(self, rng, n, pull=0.0, mount="free"):
        bearing = rng.uniform(-np.pi, np.pi)
        self.pull = pull * np.array([np.cos(bearing), np.sin(bearing)])
        self.scene = Scene(
            sequence=("NNNN",) * n, magnets=None, friction=MU,
            gravity=Gravity(normal=G, in_plane=(float(self.pull[0]), float(self.pull[1]))),
        ).replace(mount=mount)  # fmt: skip
        self.model = pack(self.scene)
        headings = np.cumsum(rng.uniform(-1.4, 1.4, n))
        self.state, self.work = new_state(self.model, headings), new_work(self.model)
        self.n = n

    def move(self, v):
        """Set the chain's velocities and fill the scratch space with values derived from them."""
        bodies, work = self.model.bodies, self.work
        self.state.v[:] = v
        place_all(0, self.model, self.state.q, work.pose)
        articulated.centre_motion(0, bodies, work.pose, v, work.centres)

    def accelerations(self):
        out = np.zeros(self.n + 2)
        assert first_accelerations(self.model, self.state, self.work, out)
        return out

    def ellipsoid(self):
        """Return the Jacobian (n, 3, n + 2) of (vx, vy, c ω)."""
        rows = np.zeros((self.n, 3, self.n + 2))
        rows[:, :2] = reference.velocity_map(self.state.q, SIDE)
        rows[np.arange(self.n), 2, np.arange(self.n)] = self.model.friction_radius
        return rows


def random_velocity(rng, n):
    return np.append(rng.normal(0.0, 5.0, n), rng.normal(0.0, 0.1, 2))


def test_arm_is_the_mean_distance_from_the_centre_of_a_square():
    x = (np.arange(2000) + 0.5) / 2000 - 0.5
    mean = np.hypot(x[:, None], x[None, :]).mean()
    model = pack(Scene(sequence=("NNNN",)))
    assert model.friction_radius / SIDE == pytest.approx(mean, abs=1e-4)


@given(seed=seeds, n=st.integers(1, 8))
def test_rows_are_the_velocities_of_the_component(seed, n):
    rng = np.random.default_rng(seed)
    floor = Floor(rng, n)
    v = random_velocity(rng, n)
    floor.move(v)
    bend = reference.velocity_accelerations(floor.state.q, v, SIDE)
    for i in range(n):
        law.friction_rows(0, floor.model, floor.work.pose, floor.work, 0, i)
        np.testing.assert_allclose(floor.work.rows.jacobian[:3], floor.ellipsoid()[i], atol=1e-15)
        np.testing.assert_allclose(floor.work.rows.bias[:2], bend[i], rtol=1e-12, atol=1e-12)
        assert floor.work.rows.bias[2] == 0.0


@pytest.mark.laws
@given(seed=seeds, n=st.integers(1, 8))
def test_sliding_friction_takes_its_grip_times_the_speed(seed, n):
    rng = np.random.default_rng(seed)
    floor = Floor(rng, n)
    v = random_velocity(rng, n)
    floor.move(v)
    work = floor.work
    law.add_sliding(0, floor.model, v, work)
    speeds = floor.ellipsoid() @ v
    size = np.linalg.norm(speeds, axis=1)
    power = (
        work.loads.fx * work.centres.vx
        + work.loads.fy * work.centres.vy
        + work.loads.torque * v[:n]
    )
    np.testing.assert_allclose(power, -MU * floor.scene.masses * G * size, rtol=1e-12)
    force = np.stack(
        [work.loads.fx, work.loads.fy, work.loads.torque / floor.model.friction_radius], axis=1
    )
    # Associated law: of all forces in the ellipsoid it takes the most, straight against (v, c ω).
    expected = -MU * floor.scene.masses[:, None] * G * speeds / size[:, None]
    np.testing.assert_allclose(force, expected, rtol=1e-10, atol=1e-15)


@given(seed=seeds, n=st.integers(1, 8), share=st.floats(0.0, 0.99))
def test_a_push_below_the_grip_moves_nothing(seed, n, share):
    floor = Floor(np.random.default_rng(seed), n, pull=share * MU * G)
    out = floor.accelerations()
    np.testing.assert_allclose(out, 0.0, atol=1e-6)
    assert floor.state.stuck.all()


@given(seed=seeds, n=st.integers(1, 8), share=st.floats(0.0, 0.99))
def test_rounding_does_not_make_slide_what_is_held(seed, n, share):
    rng = np.random.default_rng(seed)
    floor = Floor(rng, n, pull=share * MU * G)
    out = floor.accelerations()
    at_rest = floor.work.chain.force.copy()
    drift = 1e-9 * random_velocity(rng, n)
    assert accelerations(floor.model, floor.state, floor.state.q, drift, floor.work, out)
    scale = [
        *[floor.model.friction_limit[0] * SIDE] * n,
        floor.model.friction_limit[0],
        floor.model.friction_limit[0],
    ]
    np.testing.assert_allclose((floor.work.chain.force - at_rest) / scale, 0.0, rtol=0, atol=1e-6)


@given(seed=seeds, n=st.integers(1, 8), share=st.floats(1.01, 5.0))
def test_a_push_above_the_grip_moves_the_chain_as_one(seed, n, share):
    # Every component alike: no hinge carries a force.
    floor = Floor(np.random.default_rng(seed), n, pull=share * MU * G)
    out = floor.accelerations()
    expected = floor.pull * (1.0 - 1.0 / share)
    np.testing.assert_allclose(out[n:], expected, rtol=0, atol=1e-5 * G)
    assert not floor.state.stuck.any()


@pytest.mark.laws
@given(seed=seeds, n=st.integers(2, 6), pull=st.floats(0.5, 20.0))
def test_chain_at_rest_starts_as_the_convex_problem_says(seed, n, pull):
    # Some components stick, others start to slide: friction is the force of each one's ball that
    # leaves the least kinetic rate, checked by its optimality conditions.
    floor = Floor(np.random.default_rng(seed), n, pull=pull, mount="pinned")
    out = floor.accelerations()
    masses, inertias = floor.scene.masses, floor.scene.inertias
    mass = reference.mass_matrix(floor.state.q, SIDE, masses, inertias)[:n, :n]
    rows = floor.ellipsoid()[:, :, :n]
    driving = np.einsum("idk,i,d->k", rows[:, :2], masses, floor.pull)
    force = floor.work.rows.multiplier[: 3 * n].reshape(n, 3)
    caused = driving + np.einsum("idk,id->k", rows, force)
    np.testing.assert_allclose(mass @ out[:n], caused, rtol=0, atol=1e-9 * np.abs(driving).max())
    assert_coulomb(force, rows @ out[:n], MU * masses * G, 1e-7 * pull)
