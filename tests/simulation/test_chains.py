"""Chains side by side go exactly as sessions do, one by one."""

from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.engine import entries as at
from magfold_env.engine.outcomes import REACHED, RESTED
from magfold_env.simulation.chains import Chains
from magfold_env.simulation.pack import pack
from magfold_env.simulation.session import Session


def tube(n: int, seed: int, direction: str = "backward") -> mf.Scene:
    """A chain in the tube whose magnets are in order from the held end."""
    rng = np.random.default_rng(seed)
    sequence = tuple("".join(rng.choice(list("NS"), 4)) for _ in range(n))
    feed: Any = {"direction": direction, "loading": "at_mouth", "speed": (0.3,) * n}
    return mf.Scene(sequence=sequence, mount="tube", feed=feed, start_angle_spread=0.02).draw(rng)


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("all_of_it", [False, True])
def test_chains_go_as_sessions_do(threads: int, all_of_it: bool) -> None:
    scenes = [tube(4, seed) for seed in range(5)]
    sessions = [Session(scene) for scene in scenes]
    chains = Chains([pack(scenes[0])], 5, threads)
    rows = np.arange(5)
    chains.clear(rows)
    chains.charge[:] = 0.0
    chains.start(rows, np.array([scene.start_offsets for scene in scenes]))
    for k, (scene, session) in enumerate(zip(scenes, sessions, strict=True)):
        chains.waiting[k], chains.speeds[k] = pack(scene).charge, 0.3
        assert chains.rate_scale[k] == session._model.rate_scale
        assert chains.light_rate[k] == session._model.light_rate
    for step in range(1 if all_of_it else 4):
        chains.feed(rows, whole=all_of_it)
        for k, session in enumerate(sessions):
            for _ in range(4 if all_of_it else 1):
                session.feed_one()
            if session.released == 4:
                session.settle()
            np.testing.assert_array_equal(chains.q[k], session._state.q)
            np.testing.assert_array_equal(chains.v[k], session._state.v)
            assert (chains.outcomes[k] == REACHED) == (session.status is None)
            assert chains.released[k] == session.released
        assert step == 3 or all_of_it or (chains.outcomes == REACHED).all()
    assert (chains.outcomes == RESTED).all()
    for k, session in enumerate(sessions):
        assert chains.energies[k] == session.energy()
        assert chains.times[k] == session.time
        assert chains.steps[k] == session.steps
        assert chains.counters[k, at.EVALUATIONS] == session.evaluations


def test_a_chain_begins_again_as_if_new() -> None:
    scene = tube(4, 7)
    model, offsets = pack(scene), np.array(scene.start_offsets)
    chains = Chains([model], 2)
    ends = []
    for rows in (np.array([0, 1]), np.array([1])):
        chains.clear(rows)
        chains.waiting[rows], chains.speeds[rows] = model.charge, 0.3
        chains.charge[rows] = 0.0
        chains.start(rows, np.repeat(offsets[None], len(rows), axis=0))
        chains.feed(rows, whole=True)
        ends.append(chains.q.copy())
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_array_equal(ends[0][0], ends[0][1])


def test_a_pull_acts_as_gravity_on_what_is_outside() -> None:
    scene = tube(5, 3).replace(friction=0.05)
    model, force, found = pack(scene), np.array([[0.01, -0.02]]), []
    for pulled in (True, False):
        chains, row = Chains([model], 1), np.zeros(1, dtype=np.int64)
        chains.clear(row)
        chains.waiting[:], chains.charge[:], chains.speeds[:] = model.charge, 0.0, 0.3
        chains.start(row, np.array(scene.start_offsets)[None])
        for _ in range(3):
            chains.feed(row)
        chains.speeds[:] = 0.0
        if pulled:
            chains.pull(row, force, 0.05)
        else:
            for gravity, each in zip(chains.gravity, force[0], strict=True):
                gravity[:] = each / scene.masses[2:].sum()
            chains.push(row, 0.05)
        found.append(chains.q.copy())
    np.testing.assert_allclose(found[0], found[1], rtol=1e-12, atol=1e-15)
    assert np.abs(chains.v).max() > 0.0
