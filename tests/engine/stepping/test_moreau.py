"""Velocities that keep gaps open: the nearest ones, and never boundless."""

import math

import numpy as np
import pytest

from magfold_env.engine.chain import articulated, feed
from magfold_env.engine.stepping import dynamics, moreau
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.scene import Scene
from magfold_env.shapes import word_to_angles
from magfold_env.simulation.pack import pack

STEP = 1e-4  # [s]


def chain_at(headings):
    """A free chain with these headings [rad], at rest."""
    model = pack(Scene(sequence=("NNNN",) * len(headings), magnets=None))
    return model, new_state(model, np.asarray(headings)), new_work(model)


def place(model, state, work):
    """Find what `constrain` needs of a state."""
    feed.place_all(0, model, state.q, work.pose)
    articulated.centre_velocities(
        0, model.bodies, work.pose, state.v, work.centres.vx, work.centres.vy
    )
    articulated.factor(0, model.bodies, work.pose, work.chain.unlocked, work.chain)
    work.friction.slow[:] = 0


def energy(model, work, v):
    """Kinetic energy [J]."""
    vx, vy = np.zeros(model.n), np.zeros(model.n)
    articulated.centre_velocities(0, model.bodies, work.pose, v, vx, vy)
    return 0.5 * (model.bodies.mass @ (vx**2 + vy**2) + model.bodies.inertia @ v[: model.n] ** 2)


@pytest.mark.parametrize("word", ["LLL", "LRLLL", "LLRRRLRRL"])
def test_to_keep_gaps_open_takes_energy(word):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        # Joints at their stops, and so no squares that overlap.
        model, state, work = chain_at(np.cumsum([0.0, *word_to_angles(word)]))
        state.v[:] = rng.normal(0.0, 5.0, model.n + 2) * [*[1.0] * model.n, 0.01, 0.01]
        place(model, state, work)
        assert moreau.constrain(
            model, state, state.q, np.zeros(model.n + 2), work, STEP, STEP, moreau.NEAR_STOP
        )
        assert energy(model, work, work.stages.new_v) <= energy(model, work, state.v) * (1.0 + 1e-9)


def test_squares_that_overlap_on_all_sides_are_not_flung_about():
    # Four squares around one corner, in a chain of ten, each pushed into the next: found in a fold.
    joints = [-1.0, 0.9999472, 0.9998982, -0.9978523, 0.9996206, 1.0, 0.9994570, -1.0, -1.0]
    rates = [-2.971, -2.971, -16.693, -12.762, 14.314, 0.571, 0.571, -9.174, -2.971, -2.971]
    headings = 1.195383329 + np.cumsum([0.0, *(0.5 * math.pi * np.array(joints))])
    model, state, work = chain_at(headings)
    model = model._replace(rate_scale=110.0)
    state.v[:] = [*rates, -0.028, 0.108]
    place(model, state, work)
    assert moreau.constrain(model, state, state.q, np.zeros(12), work, STEP, STEP, moreau.NEAR_STOP)
    assert energy(model, work, work.stages.new_v) < moreau.VIOLENT * energy(model, work, state.v)


@pytest.mark.parametrize("step", [4e-4, 2e-4, 1e-4])
def test_friction_holds_the_far_end_while_the_near_one_turns(step):
    # Base and joints move, and what rests does so in every pose that the step passes.
    rate = 10.0
    scene = Scene(sequence=("NNNN",) * 2, magnets=None, friction=0.35)
    model = pack(scene)
    state, work = new_state(model, np.array([0.0, 0.8])), new_work(model)
    state.v[:] = [rate, 0.0, 0.0, -rate * model.bodies.length[0]]
    place(model, state, work)
    np.testing.assert_allclose([work.centres.vx[1], work.centres.vy[1]], 0.0, atol=1e-15)
    work.friction.slow[1] = 1
    dynamics.smooth_forces(0, model, state.q, state.v, work)
    dynamics.unconstrained(0, model, work, work.moreau.smooth)
    assert moreau.velocity_after(model, state, work, step, 0.75, moreau.NEAR_STOP)
    end = work.stages.q + 0.5 * step * work.stages.new_v
    feed.place_all(0, model, end, work.pose)
    articulated.centre_velocities(
        0, model.bodies, work.pose, work.stages.new_v, work.centres.vx, work.centres.vy
    )
    slipped = max(
        abs(work.centres.vx[1]), abs(work.centres.vy[1]), abs(model.arm * work.stages.new_v[1])
    )
    assert slipped < 10.0 * rate**3 * model.side * step**2
