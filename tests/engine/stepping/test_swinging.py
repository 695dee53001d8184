"""A chain on which only gravity acts takes the shortest recursion, and others do not."""

import numpy as np
import pytest

from magfold_env.engine.friction import held
from magfold_env.engine.stepping import dynamics, integrator
from magfold_env.engine.workspace import NO_NEWTON, NO_NODES, NO_RIGID, new_state, new_work
from magfold_env.scene import Gravity, Scene
from magfold_env.simulation.pack import pack
from magfold_env.simulation.session import Session

SWINGING = Scene(
    sequence=("----",) * 5,
    magnets=None,
    friction=0.0,
    contact=False,
    mount="pinned",
    gravity=Gravity(in_plane=(0.5, -3.0)),
    duration=0.3,
).draw(np.random.default_rng(1))
MORE = {
    "magnets": {"magnets": {}, "sequence": ("NSNS",) * 5},
    "friction": {"friction": 0.2},
    "contact": {"contact": True},
    "free base": {"mount": "free"},
    "tube": {"mount": "tube"},
}


def moving(scene: Scene):
    """A chain that moves, and its scratch space."""
    rng = np.random.default_rng(2)
    model = pack(scene)
    state, work = new_state(model, rng.uniform(-0.3, 0.3, scene.n)), new_work(model)
    state.counter[:] = 0
    state.v[: scene.n] = rng.normal(0.0, 10.0, scene.n)
    return model, state, work


def swept(scene: Scene) -> bool:
    """Whether the shortest recursion finds the accelerations."""
    model, state, work = moving(scene)
    assert held.first_accelerations(model, state, work, np.zeros(scene.n + 2))
    # The other way leaves articulated inertias behind.
    assert work.chain.sweep.any() != work.chain.articulated.any()
    return bool(work.chain.sweep.any())


def test_a_chain_on_which_only_gravity_acts_takes_the_shortest_way() -> None:
    assert swept(SWINGING)


@pytest.mark.parametrize("feature", MORE)
def test_others_do_not(feature: str) -> None:
    assert not swept(SWINGING.replace(**MORE[feature]))


def test_both_ways_agree() -> None:
    model, state, work = moving(SWINGING)
    short, general = np.ones(SWINGING.n + 2), np.zeros(SWINGING.n + 2)
    assert held.first_accelerations(model, state, work, short)
    assert dynamics.constrained(model, state, state.q, state.v, work, general)
    np.testing.assert_allclose(short, general, rtol=1e-11)
    assert (short[-2:] == 0.0).all()


def test_whole_runs_agree() -> None:
    # Friction too weak to be felt, but there.
    general = SWINGING.replace(friction=1e-12)
    runs = [Session(scene) for scene in (SWINGING, general)]
    for run in runs:
        run.settle()
    assert runs[0].evaluations == runs[1].evaluations
    assert runs[0].angles == pytest.approx(runs[1].angles, abs=1e-8)


def test_what_a_scene_lacks_has_no_scratch_space() -> None:
    work = new_work(pack(SWINGING))
    assert work.nodes is NO_NODES
    assert work.rigid is NO_RIGID
    assert work.friction.newton is NO_NEWTON
    rubbing = new_work(pack(SWINGING.replace(friction=0.2)))
    assert rubbing.nodes is NO_NODES
    assert rubbing.friction.newton is not NO_NEWTON


def test_a_run_by_address_is_one_by_name() -> None:
    by_address, by_name = Session(SWINGING), Session(SWINGING)
    by_address.settle()
    chain = by_name._model, by_name._state, by_name._work, by_name._chains.frames.record
    integrator.advance(*chain, SWINGING.duration, 10**9)
    assert by_name.time == by_address.time == SWINGING.duration
    assert (by_name.angles == by_address.angles).all()
    assert (by_name.rates == by_address.rates).all()
