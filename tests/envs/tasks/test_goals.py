import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_env.envs.chains.arrays import STATUSES
from magfold_env.envs.tasks.goals import SUCCESS_TOLERANCE, Goals, Match, goal_words
from magfold_env.fold import FoldStatus
from magfold_env.shapes import folded_words, headings, mirror, outline, similarity, word_to_angles

TARGET = "LRLLL"
ROW = np.array([0])

angles = st.lists(st.floats(-np.pi, np.pi), min_size=5, max_size=5).map(np.array)


def judged(
    status: FoldStatus | None, joints: np.ndarray, target: str = TARGET, match: Match = "word"
) -> list[float]:
    """Return potential, score and success of a chain with these joint angles [rad]."""
    goals = Goals((target,), match, 1)
    goals.want(ROW, ROW)
    return goals.judge(ROW, np.array([STATUSES.index(status)]), headings(joints)[None])[
        :, 0
    ].tolist()


def test_a_settled_target_scores_one_and_its_mirror_image_is_none() -> None:
    joints = word_to_angles(TARGET) + SUCCESS_TOLERANCE * np.array([0.9, -0.9, 0, 0.5, -0.5])
    assert judged(FoldStatus.FOLDED, joints)[1:] == [1.0, 1.0]
    assert not judged(FoldStatus.FOLDED, word_to_angles(mirror(TARGET)))[2]


@pytest.mark.parametrize("joint", range(5))
def test_one_joint_beyond_the_tolerance_is_no_success(joint: int) -> None:
    joints = word_to_angles(TARGET)
    joints[joint] += 1.1 * SUCCESS_TOLERANCE
    _, score, reached = judged(FoldStatus.FOLDED, joints)
    assert score < 0.5
    assert not reached


@pytest.mark.parametrize("status", [FoldStatus.MISFOLDED, FoldStatus.UNSETTLED, None])
def test_the_right_angles_without_rest_score_half(status: FoldStatus | None) -> None:
    assert judged(status, word_to_angles(TARGET))[1] == pytest.approx(0.5)


@pytest.mark.parametrize("joints", [np.full(5, np.nan), word_to_angles(TARGET)])
def test_a_failure_scores_nothing_whatever_its_angles(joints: np.ndarray) -> None:
    assert judged(FoldStatus.FAILED, joints)[1] == 0.0


def test_another_fold_scores_half_its_similarity() -> None:
    for word in folded_words(6):
        if word != TARGET:
            joints = word_to_angles(word)
            expected = 0.5 * similarity(joints, word_to_angles(TARGET))
            assert judged(FoldStatus.FOLDED, joints)[1] == pytest.approx(expected)
            assert expected < 0.5


@given(angles)
def test_the_potential_is_half_the_similarity(joints: np.ndarray) -> None:
    expected = 0.5 * similarity(joints, word_to_angles(TARGET))
    assert judged(None, joints)[0] == pytest.approx(expected, abs=1e-12)


@given(angles)
def test_an_outlines_potential_is_that_of_the_likest_word(joints: np.ndarray) -> None:
    words = goal_words("LLRRL", "outline")
    expected = max(0.5 * similarity(joints, word_to_angles(word)) for word in words)
    found = judged(None, joints, "LLRRL", "outline")[0]
    assert found == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("n", [2, 5, 7, pytest.param(8, marks=pytest.mark.slow)])
def test_an_outline_is_reached_by_exactly_the_words_that_cover_it(n: int) -> None:
    words = folded_words(n)
    for target in words:
        found = goal_words(target, "outline")
        assert found[0] == target
        same = {word for word in words if outline(word) == outline(target)}
        assert set(found) == same
        for word in words:
            joints = word_to_angles(word)
            assert judged(FoldStatus.FOLDED, joints, target, "outline")[2] == (word in same)
