"""Session: the tube's feed step by step."""

import contextlib

import numpy as np
import pytest

from magfold_env.engine import entries as at
from magfold_env.engine import outcomes
from magfold_env.engine.chain import feed
from magfold_env.fold import FoldStatus
from magfold_env.scene import SceneError, load_scene
from magfold_env.simulation import frames
from magfold_env.simulation.session import Session
from magfold_env.simulation.simulate import simulate


def session_of(direction, **feeding):
    scene = load_scene("paper/sequence-3").replace(
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


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_a_release_changes_no_velocity(direction):
    session = session_of(direction)
    model, state = session._model, session._state
    for _ in range(3):
        session.feed_one()
    lo = int(state.counter[at.LO])
    before, base = state.v.copy(), session.base
    state.q[model.n] = feed.next_mark(model, state)
    moved = session.base
    feed.release(model, state)
    assert (state.v == before).all()
    assert state.counter[at.LO] == lo - 1
    assert session.base == pytest.approx(moved, abs=1e-15)
    assert moved[0] > base[0]


def test_magnets_act_from_the_mouth_on():
    session = session_of("forward", loading="at_mouth", speed=(0.2, 0.1, 0.1, 0.1, 0.1, 0.1))
    model = session._model
    assert not model.charge.any()
    session.feed_one()
    assert session.time == pytest.approx(0.0125 * np.sqrt(2) / 0.2, rel=1e-2)
    assert model.charge[5].all()
    assert not model.charge[:5].any()
    session.settle()
    assert model.charge.all()


def test_recording_in_pieces_changes_nothing(monkeypatch):
    monkeypatch.setattr(frames, "ROOM", 4)
    scene = session_of("backward", loading="at_mouth").scene
    plain, recorded = Session(scene), Session(scene, 2000.0)
    for session in (plain, recorded):
        session.settle()
    assert recorded.steps == plain.steps
    assert (recorded.angles == plain.angles).all()
    path = recorded.fold().trajectory
    assert path is not None
    assert len(path) == int(plain.time * 2000.0) + 2  # and the end
    assert (np.diff(path.time) > 0.0).all()


def test_pushed_for_a_time_a_chain_goes_as_it_is_fed():
    fed, pushed = session_of("forward"), session_of("forward")
    for _ in range(6):
        fed.feed_one()
    pushed.push(np.full(6, 0.1), fed.time)
    assert pushed.time == fed.time
    assert pushed.released == 6
    np.testing.assert_allclose(pushed.angles, fed.angles, atol=1e-9)
    still = session_of("forward")
    still.push(np.zeros(6), 0.1)
    assert (still.time, still.released) == (0.1, 0)


@pytest.mark.parametrize("speeds", [1e9, -21.0, np.nan, [0.1] * 5 + [30.0]])
def test_no_session_is_fed_faster_than_a_drive_can(speeds):
    with pytest.raises(SceneError, match=r"^speeds: .* must be numbers from -20 to 20 m/s$"):
        session_of("forward").push(speeds, 0.1)


def test_an_unfinished_session_has_no_fold():
    session = session_of("forward")
    with pytest.raises(ValueError, match="has not ended"):
        session.fold()
    for _ in range(6):
        session.feed_one()
    with pytest.raises(ValueError, match="no component is left"):
        session.feed_one()
    session.settle()
    assert session.fold().status is session.status


def test_numbers_that_break_down_are_said_to():
    session = session_of("forward")
    for _ in range(6):
        session.feed_one()
    session._state.q[3] = np.nan
    session.settle()
    fold = session.fold()
    assert fold.status is FoldStatus.FAILED
    assert "not finite" in fold.message
    assert fold.word == ""


def test_a_scene_left_to_chance_must_be_drawn_first():
    with pytest.raises(ValueError, match="draw it first"):
        Session(load_scene("paper/sequence-1"))


def test_scratch_space_remembers_nothing_of_other_runs():
    scene = load_scene("paper/sequence-1").replace(mount="tube", feed={"speed": 0.3})
    others = [
        scene.replace(sequence=scene.sequence[::-1]),
        scene.replace(magnets={"remanence": 0.9}, friction=0.1),
        scene.replace(mount="free"),
    ]
    alone = simulate(scene, 0)
    for other in others:
        rooms = [simulate(other, seed) for seed in range(3)]
        again = simulate(scene, 0)
        assert again.angles.tobytes() == alone.angles.tobytes()
        assert again.evaluations == alone.evaluations
        assert rooms[0].word


@pytest.mark.parametrize("loading", ["preloaded", "at_mouth"])
def test_energies_grow_by_all_the_work(loading):
    scene = load_scene("paper/sequence-3").replace(
        mount="tube",
        friction=0.0,
        feed={"speed": 0.1, "loading": loading},
        solver={"tolerance": 1e-8},
    )
    session = Session(scene.draw(np.random.default_rng(4)))
    before = session.potential()
    for _ in range(4):
        session.feed_one()
        model, state = session._model, session._state
        kinetic, _ = feed.kinetic(int(state.counter[at.LO]), model, state, session._probe)
        done = session.account
        grown = kinetic + session.potential() - before
        work = done.feed + done.loading - done.impacts
        assert grown == pytest.approx(work, abs=1e-6 * (abs(done.feed) + abs(done.loading)))
    assert (session.account.loading != 0.0) == (loading == "at_mouth")


@pytest.mark.parametrize("method", ["adaptive", "paper"])
def test_a_run_that_was_stopped_goes_on_as_if_it_had_not(method):
    scene = load_scene("paper/sequence-3").replace(
        mount="pinned" if method == "paper" else "tube",
        feed={"speed": 0.002},
        solver={"method": method, "time_step": 1e-5},
        start_angles=[0.01, -0.02, 0.02, 0.01, -0.01] if method == "paper" else None,
    )
    drawn = scene.draw(np.random.default_rng(0))
    whole, seen = simulate(drawn), []

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
    assert session.status is FoldStatus.HELD
    assert session.time < 0.8 + advance / 0.05 + session.scene.duration
    assert session.advance == pytest.approx(0.0 if last < 0.0 else advance, abs=1e-12)
    assert session.fold().in_tube == session.n - session.released > 0
