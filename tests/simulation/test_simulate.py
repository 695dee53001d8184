"""Tests of `simulate`: folds of the paper's sequences, repeatability, recording."""

from collections import Counter
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.simulation.session import Session

TUBE = {"mount": "tube", "feed": {"direction": "backward", "speed": 0.05}}
PAPER = {"mount": "pinned", "solver": {"method": "paper", "time_step": 1e-4}, "duration": 0.05}
FORWARD = {"mount": "tube", "feed": {"direction": "forward", "speed": 0.05}}


def same(a: mf.Fold, b: mf.Fold) -> bool:
    return (
        a.angles.tobytes() == b.angles.tobytes()
        and a.base.tobytes() == b.base.tobytes()
        and (a.status, a.word, a.time, a.energy, a.steps, a.evaluations)
        == (b.status, b.word, b.time, b.energy, b.steps, b.evaluations)
    )


@pytest.mark.parametrize(
    ("number", "changes", "word"),
    [(3, {}, "LRLLL"), (3, TUBE, "LRLLL"), (2, {}, "LRLRL")],
    ids=["3-free", "3-backward", "2-free"],
)
def test_the_papers_sequences_settle_where_the_paper_says(number, changes, word):
    scene = mf.load_scene(f"paper/sequence-{number}").replace(**changes)
    folds = [mf.simulate(scene, seed) for seed in range(20)]
    counts = Counter((fold.word, fold.status) for fold in folds)
    assert counts[word, mf.FoldStatus.FOLDED] > 10, counts


@pytest.mark.parametrize("changes", [{}, TUBE, FORWARD], ids=["free", "backward", "forward"])
@pytest.mark.parametrize("number", [1, 2, 3])
def test_one_seed_is_one_fold_recorded_or_not_and_by_session_too(number, changes):
    scene = mf.load_scene(f"paper/sequence-{number}").replace(**changes)
    fold = mf.simulate(scene, 7)
    assert same(fold, mf.simulate(scene, 7))
    assert same(fold, mf.simulate(fold.scene, 8))
    recorded: Any = mf.simulate(scene, 7, frame_rate=1000.0)
    assert same(fold, recorded)
    session = Session(scene.draw(np.random.default_rng(7)))
    while session.released < session.n:
        session.feed_one()
    session.settle()
    assert same(fold, session.fold())


@pytest.mark.parametrize("changes", [{}, TUBE], ids=["free", "backward"])
def test_a_trajectory_has_even_frames_and_ends_at_the_fold(changes):
    fold = mf.simulate(mf.load_scene("paper/sequence-3").replace(**changes), frame_rate=500.0)
    run: Any = fold.trajectory
    assert run.time[:-1] == pytest.approx(np.arange(len(run) - 1) / 500.0, abs=1e-9)
    assert 0.0 < np.diff(run.time)[-1] < 1.0 / 500.0 + 1e-9
    assert run.base[-1] == pytest.approx(fold.base, abs=1e-12)
    assert (np.diff(run.released) >= 0).all()
    assert run.released[-1] == 6


@pytest.mark.parametrize("frame_rate", [1e-9, 7.0, 24.0, 240.0])
@pytest.mark.parametrize("changes", [{}, TUBE, {"duration": 0.125}, PAPER], ids=str)
def test_the_last_frame_is_the_end(changes, frame_rate):
    scene = mf.load_scene("paper/sequence-2").replace(**changes)
    for seed in range(3):
        fold = mf.simulate(scene, seed, frame_rate=frame_rate)
        run: Any = fold.trajectory
        assert (run.time[0], run.time[-1]) == (0.0, fold.time)
        assert (np.diff(run.time) > 0.0).all()
        assert (np.diff(run.angles[-1]) == fold.joint_angles).all()
        assert (run.angles[0] == Session(fold.scene).angles).all()


@pytest.mark.parametrize("scene", [
    mf.Scene(sequence=("----",) * 30, magnets=None, start_angle_spread=0.0),
    mf.load_scene("paper/sequence-3").replace(start_angles=(np.pi / 2,) * 5),  # overlaps
])  # fmt: skip
def test_a_chain_that_rests_at_once_has_one_frame(scene):
    fold: Any = mf.simulate(scene, frame_rate=24.0)
    assert fold.trajectory.time.tolist() == [fold.time] == [0.0]
    assert (fold.trajectory.angles == fold.angles).all()


def test_a_chain_on_which_only_gravity_acts_moves_as_others_do():
    # A recursion of its own finds its accelerations; friction too weak to be felt keeps it off.
    swinging = mf.load_scene("pendulum-3").replace(
        sequence=("----",) * 5, gravity={"in_plane": (0.5, -3.0)}, duration=0.3
    )
    short, general = mf.simulate(swinging), mf.simulate(swinging.replace(friction=1e-12))
    assert short.evaluations == general.evaluations
    assert short.angles == pytest.approx(general.angles, abs=1e-8)


@pytest.mark.parametrize("wrong", [[10**400] * 3, [1j] * 3, ["0.1"] * 3, [[0.1], [0.1, 0.2]]])
def test_what_are_no_headings_is_refused(wrong: Any) -> None:
    with pytest.raises(mf.SceneError, match=r"^angles: \[.* is not allowed; must be 3 numbers$"):
        mf.energy(mf.load_scene("pendulum-3"), wrong)
