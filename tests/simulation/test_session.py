"""Tests of Session: how a chain starts, is fed step by step, and ends."""

import contextlib
import math
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws.outcomes import hinge_offsets
from magfold_env.engine import outcomes
from magfold_env.simulation import frames
from magfold_env.simulation.endings import ending
from magfold_env.simulation.session import Session


def session_of(direction, **feeding):
    scene = mf.load_scene("paper/sequence-3").replace(
        mount="tube", feed={"direction": direction, "speed": 0.1, **feeding}
    )
    return Session(scene.draw(np.random.default_rng(4)))


@pytest.mark.parametrize(("direction", "heading"), [("forward", np.pi), ("backward", 0.0)])
def test_headings_in_the_tube_stay(direction, heading):
    session = session_of(direction)
    start = session.angles
    assert start == pytest.approx(np.full(6, heading), abs=0.1)
    order = range(6) if direction == "forward" else range(5, -1, -1)
    for done, component in enumerate(order):
        session.feed_one()
        assert session.released == done + 1
        held = [k for k in order if k not in list(order)[: done + 1]]
        assert (session.angles[held] == start[held]).all()
        assert session.rates[component] == 0.0
        assert (session.rates[held] == 0.0).all()


@pytest.mark.parametrize(("direction", "first"), [("forward", 0), ("backward", 5)])
def test_each_component_is_fed_at_its_own_speed(direction, first):
    speeds = np.full(6, 0.1)
    speeds[first] = 0.2
    fed, pushed = session_of(direction, speed=tuple(speeds)), session_of(direction)
    fed.feed_one()
    assert fed.time == pytest.approx(fed.scene.casing.diagonal / 0.2, rel=1e-2)
    pushed.push(speeds, 0.01)
    assert pushed.advance == pytest.approx(0.2 * 0.01)


def test_recording_in_pieces_changes_nothing(monkeypatch):
    monkeypatch.setattr(frames, "ROOM", 4)
    scene = session_of("backward", loading="at_mouth").scene
    plain, recorded = Session(scene), Session(scene, 2000.0)
    for session in (plain, recorded):
        session.settle()
    assert recorded.steps == plain.steps
    assert (recorded.angles == plain.angles).all()
    path: Any = recorded.fold().trajectory
    assert len(path) == int(plain.time * 2000.0) + 2  # and the end
    assert (np.diff(path.time) > 0.0).all()


@pytest.mark.parametrize("speeds", [1e9, -21.0, np.nan, [0.1] * 5 + [30.0]])
def test_no_session_is_fed_faster_than_a_drive_can(speeds):
    with pytest.raises(mf.SceneError, match=r"^speeds: .* must be numbers from -20 to 20 m/s$"):
        session_of("forward").push(speeds, 0.1)


def test_numbers_that_break_down_are_said_to():
    session = session_of("forward")
    for _ in range(6):
        session.feed_one()
    session._state.q[3] = np.nan
    session.settle()
    fold = session.fold()
    assert fold.status is mf.FoldStatus.FAILED
    assert "not finite" in fold.message
    assert fold.word == ""


def test_a_session_needs_a_drawn_scene_and_an_end_to_have_a_fold() -> None:
    with pytest.raises(ValueError, match="draw it first"):
        Session(mf.load_scene("paper/sequence-1"))
    session = session_of("forward")
    with pytest.raises(ValueError, match="has not ended"):
        session.fold()
    for _ in range(6):
        session.feed_one()
    with pytest.raises(ValueError, match="no component is left"):
        session.feed_one()
    session.settle()
    assert session.fold().status is session.status


def test_scratch_space_remembers_nothing_of_other_runs():
    scene = mf.load_scene("paper/sequence-1").replace(mount="tube", feed={"speed": 0.3})
    others = [
        scene.replace(sequence=scene.sequence[::-1]),
        scene.replace(magnets={"remanence": 0.9}, friction=0.1),
        scene.replace(mount="free"),
    ]
    alone = mf.simulate(scene, 0)
    for other in others:
        rooms = [mf.simulate(other, seed) for seed in range(3)]
        again = mf.simulate(scene, 0)
        assert again.angles.tobytes() == alone.angles.tobytes()
        assert again.evaluations == alone.evaluations
        assert rooms[0].word


@pytest.mark.parametrize("method", ["adaptive", "paper"])
def test_a_run_that_was_stopped_goes_on_as_if_it_had_not(method):
    scene = mf.load_scene("paper/sequence-3").replace(
        mount="pinned" if method == "paper" else "tube",
        feed={"speed": 0.002},
        solver={"method": method, "time_step": 1e-5},
        start_angles=[0.01, -0.02, 0.02, 0.01, -0.01] if method == "paper" else None,
    )
    drawn = scene.draw(np.random.default_rng(0))
    whole, seen = mf.simulate(drawn), []

    def stop(time, released):
        seen.append((time, released))
        raise KeyboardInterrupt

    session = Session(drawn)
    session.progress = stop
    while session.status is None:
        with contextlib.suppress(KeyboardInterrupt):
            session.settle()
    fold = session.fold()
    assert (fold.angles == whole.angles).all()
    assert (fold.message, fold.evaluations) == (whole.message, whole.evaluations)
    assert len(seen) > 2
    assert seen == sorted(seen)
    # Each turn makes at most TURN/n² evaluations, and then completes its step.
    assert len(seen) >= whole.evaluations // (outcomes.TURN // scene.n**2 + 400)


@pytest.mark.parametrize("limit", [None, 20.0])
@pytest.mark.parametrize("last", [0.0, -0.05])
def test_after_a_pull_or_at_rest_a_run_ends_as_held(last, limit):
    session = session_of("forward", force_limit=limit)
    session.push(0.05, 0.6)
    session.push(last, 0.2)
    advance = session.advance
    session.settle()
    assert session.status is mf.FoldStatus.HELD
    assert session.time < 0.8 + advance / 0.05 + session.scene.duration
    assert session.advance == pytest.approx(0.0 if last < 0.0 else advance, abs=1e-12)
    assert session.fold().in_tube == session.n - session.released > 0


SEQUENCE = ("NSNN", "NSSN", "SNSS", "SSNN")


def tube(**changes: Any) -> mf.Scene:
    """Return a scene of a chain in a tube."""
    return mf.Scene(sequence=SEQUENCE).replace(mount="tube", **changes)


def hinges(session: Session) -> np.ndarray:
    """Return distances of the hinges from the axis [m], beginning with component 1's outer one."""
    rises = session.scene.casing.diagonal * np.sin(session.angles)
    return session.base[1] + np.concatenate([[0.0], np.cumsum(rises)])


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_hinges_are_where_the_scene_puts_them_and_given_angles_are_kept(direction: str) -> None:
    offsets = (1e-4, -2e-4, 4e-4, 0.0, -3e-4)
    scene = tube(start_offsets=offsets, feed={"direction": direction})
    session = Session(scene)
    np.testing.assert_allclose(hinges(session), offsets, atol=1e-16)
    heading = np.pi if direction == "forward" else 0.0
    assert np.abs(session.angles - heading).max() < 0.04
    joints = (0.03, -0.02, 0.01)
    scene = tube(start_angles=joints, feed={"direction": direction})
    session = Session(scene)
    np.testing.assert_allclose(np.diff(session.angles), joints, atol=1e-12)
    across = hinges(session)
    np.testing.assert_allclose(across, hinge_offsets(scene), atol=1e-17)
    assert across.max() == pytest.approx(-across.min())
    assert across.max() < scene.play


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("off", [-0.051, -0.049, 0.0, 0.049, 0.051])
def test_a_fold_has_every_joint_within_a_twentieth_of_a_right_angle(sign, off):
    joints = [math.pi / 2, sign * (math.pi / 2 + off), -math.pi / 2]
    status, words = ending(outcomes.RESTED, 0.5, joints, "")
    assert (status == mf.FoldStatus.FOLDED) == (abs(off) < 0.05)
    assert status == mf.FoldStatus.FOLDED or words == "at rest at t = 0.5 s with joint 2 open"
