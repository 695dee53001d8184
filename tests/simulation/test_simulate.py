"""`simulate`: where the paper's sequences settle, repeatability, recording."""

from collections import Counter

import numpy as np
import pytest

from magfold_env.fold import Fold, FoldStatus
from magfold_env.scene import SceneError, load_scene
from magfold_env.simulation.session import Session
from magfold_env.simulation.simulate import accelerations, energy, forces, simulate

TUBE = {"mount": "tube", "feed": {"direction": "backward", "speed": 0.05}}
FORWARD = {"mount": "tube", "feed": {"direction": "forward", "speed": 0.05}}


def same(a: Fold, b: Fold) -> bool:
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
    scene = load_scene(f"paper/sequence-{number}").replace(**changes)
    folds = [simulate(scene, seed) for seed in range(20)]
    counts = Counter((fold.word, fold.status) for fold in folds)
    assert counts[word, FoldStatus.FOLDED] > 10, counts


@pytest.mark.parametrize("changes", [{}, TUBE, FORWARD], ids=["free", "backward", "forward"])
@pytest.mark.parametrize("number", [1, 2, 3])
def test_one_seed_is_one_fold_recorded_or_not_and_by_session_too(number, changes):
    scene = load_scene(f"paper/sequence-{number}").replace(**changes)
    fold = simulate(scene, 7)
    assert same(fold, simulate(scene, 7))
    assert same(fold, simulate(fold.scene, 8))
    recorded = simulate(scene, 7, frame_rate=1000.0)
    assert same(fold, recorded)
    assert recorded.trajectory is not None
    session = Session(scene.draw(np.random.default_rng(7)))
    while session.released < session.n:
        session.feed_one()
    session.settle()
    assert same(fold, session.fold())


@pytest.mark.parametrize("changes", [{}, TUBE], ids=["free", "backward"])
def test_a_trajectory_has_even_frames_and_ends_at_the_fold(changes):
    fold = simulate(load_scene("paper/sequence-3").replace(**changes), frame_rate=500.0)
    run = fold.trajectory
    assert run is not None
    assert run.time == pytest.approx(np.arange(len(run)) / 500.0, abs=1e-9)
    assert fold.time - run.time[-1] < 1.0 / 500.0 + 1e-9
    assert run.angles[-1] == pytest.approx(fold.angles, abs=1e-3)
    # What the chain still slides within a frame.
    assert run.base[-1] == pytest.approx(fold.base, abs=2e-5)
    assert (np.diff(run.released) >= 0).all()
    assert run.released[-1] == 6


@pytest.mark.parametrize("function", [forces, energy, lambda s, a: accelerations(s, a, [0.0] * 6)])
@pytest.mark.parametrize("angles", [[0.0] * 5, [0.0] * 5 + [np.nan]])
def test_wrong_angles_are_an_error_that_names_them(function, angles):
    with pytest.raises(SceneError, match="angles"):
        function(load_scene("paper/sequence-1"), angles)
