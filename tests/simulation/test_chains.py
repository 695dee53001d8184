"""Tests that simultaneous chains move exactly like single sessions."""

from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.engine import indices as ix
from magfold_env.engine.outcomes import REACHED, RESTED
from magfold_env.simulation.chains import Chains
from magfold_env.simulation.pack import pack
from magfold_env.simulation.session import Session
from tests.folds import lying

FED: Any = {"direction": "backward", "loading": "at_mouth"}


def tube(n: int, seed: int, direction: str = "backward") -> mf.Scene:
    """Return a scene of a chain in a tube, with its magnets in order from the held end."""
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
        assert chains.typical_rate[k] == session._model.typical_rate
        assert chains.fastest_rate[k] == session._model.fastest_rate
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
        assert chains.counters[k, ix.EVALUATIONS] == session.evaluations


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


def held_folds(count: int) -> tuple[mf.Scene, Chains, Any]:
    """Return chains whose last component the tube holds, and the rows of folded chains."""
    scene = mf.load_scene("reprogram")
    scene = scene.replace(
        sequence=scene.sequence[:4], spreads={}, start_angles=(0.0,) * 3, feed=FED
    )
    model, rng, rows = pack(scene), np.random.default_rng(0), np.arange(count)
    chains = Chains([model], count)
    chains.clear(rows)
    signs = rng.choice([-1.0, 1.0], (count, 4, 4))
    chains.waiting[:], chains.charge[:] = signs * np.abs(model.charge), 0.0
    chains.start(rows, rng.uniform(-1e-4, 1e-4, (count, 5)))
    for speed, seconds in ((0.1, 3.95 * scene.casing.diagonal / 0.1), (0.0, 0.5)):
        chains.speeds[:] = speed
        chains.push(rows, seconds)
    joints = np.abs(np.diff(chains.q[:, :4], axis=1))
    return scene, chains, rows[(np.abs(joints - 0.5 * np.pi) < 1e-3).all(axis=1)]


def held(scene: mf.Scene, chains: Chains, row: int, force: Any) -> mf.Fold:
    """Return a held chain as a fold at rest, on which a force [N] acts like gravity."""
    angles, hinge = chains.q[row, :4], chains.q[row, 4:]
    signs = np.sign(chains.waiting[row])
    scene = scene.replace(
        sequence=["".join("NS"[int(sign < 0.0)] for sign in faces) for faces in signs],
        gravity={"in_plane": tuple((force / float(np.sum(scene.masses[1:]))).tolist())},
    )
    base = hinge - scene.casing.diagonal * np.array([np.cos(angles[0]), np.sin(angles[0])])
    ends = {"status": mf.FoldStatus.HELD, "in_tube": 1}
    return lying(scene, "SSS", angles=angles.copy(), base=base, **ends)


@pytest.mark.parametrize("direction", [0.0, 2.0, 4.5])
def test_a_pull_opens_a_fold_where_no_forces_balance_it_any_more(direction: float) -> None:
    scene, chains, rows = held_folds(40)
    unit, begun, looked_at = np.array([np.cos(direction), np.sin(direction)]), chains.get_state(), 0
    for row in rows.tolist():
        pose, least, most = chains.q[row, :4].copy(), 0.01, 5.0
        while most > 1.02 * least:
            force = np.sqrt(least * most)
            chains.pull(np.array([row]), force * unit[None], 0.3)
            opened = np.abs(chains.q[row, :4] - pose).max() > 0.01
            least, most = (least, force) if opened else (force, most)
            chains.set_state(begun)
        if least > 0.01 and most < 5.0:
            looked_at += 1
            mf.holding(held(scene, chains, row, 0.98 * least * unit))
            with pytest.raises(mf.SceneError, match="unbalanced"):
                mf.holding(held(scene, chains, row, 1.02 * most * unit))
    assert looked_at >= 3
