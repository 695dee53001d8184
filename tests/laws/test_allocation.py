"""Tests that the step loop allocates no memory: many steps allocate as much as none."""

import importlib
from collections.abc import Iterator

import numba
import numpy as np
import pytest
from numba.core.runtime.nrt import rtsys

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import feed
from magfold_env.engine.stepping import integrator
from magfold_env.scene import load_scene
from magfold_env.simulation.session import Session

pytestmark = pytest.mark.laws

# Switches the counting on and off; numba has no public name for it.
memory = importlib.import_module("numba.core.runtime._nrt_python")


@pytest.fixture(autouse=True)
def _counted() -> Iterator[None]:
    memory.memsys_enable_stats()
    yield
    memory.memsys_disable_stats()


def advance(session: Session, until: float) -> tuple[int, int]:
    """Integrate; return the numbers of steps and of allocations, by numba and for it."""
    model, state = session._model, session._state
    steps, before = int(state.counter[ix.STEPS]), rtsys.get_allocation_stats()
    integrator.advance(model, state, session._work, session._chains.frames.record, until, 10**9)
    after = rtsys.get_allocation_stats()
    made = after.alloc - before.alloc + after.mi_alloc - before.mi_alloc
    return int(state.counter[ix.STEPS]) - steps, made


def prepared(friction: float, mount: str, frame_rate: float | None = None) -> Session:
    """Return a session that only has to integrate; in a tube, half of the chain is out."""
    scene = load_scene("paper/sequence-3").replace(friction=friction, mount=mount)
    scene = scene.replace(feed={"speed": 0.1})
    session = Session(scene.draw(np.random.default_rng(1)), frame_rate)
    if mount == "tube":
        for _ in range(3):
            session.feed_one()
        feed.begin(session._model, session._state, session._work)
    return session


@pytest.mark.parametrize("frame_rate", [None, 240.0])
@pytest.mark.parametrize("mount", ["free", "pinned", "tube"])
@pytest.mark.parametrize("friction", [0.0, 0.35])
def test_steps_allocate_nothing(friction, mount, frame_rate):
    advance(prepared(friction, mount, frame_rate), 1e-3)  # compiles, or loads what is compiled
    session = prepared(friction, mount, frame_rate)
    now = session.time
    # The arrays that go in and out of a compiled call are counted too, so a call is not free.
    none, for_a_call = advance(session, now)
    until = now + 0.2
    if mount == "tube":
        until = float(session._state.clock[ix.MARK])
        assert session._state.counter[ix.N_HELD] > 0
    some, for_steps = advance(session, until)
    assert none == 0
    assert some > 5
    assert session._state.clock[ix.TIME] > now
    assert for_steps == for_a_call


def test_the_count_sees_what_a_kernel_allocates():
    @numba.njit
    def allocating(times):
        total = 0.0
        for k in range(times):
            total += np.ones(8 + k).sum()
        return total

    allocating(1)
    before = rtsys.get_allocation_stats().alloc
    allocating(5)
    assert rtsys.get_allocation_stats().alloc - before == 5
