import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_env.envs.tasks.goals import SUCCESS_TOLERANCE, goal_of
from magfold_env.fold import FoldStatus
from magfold_env.shapes import folded_words, mirror, outline, similarity, word_to_angles

TARGET = "LRLLL"
GOAL = goal_of(TARGET, "word")

angles = st.lists(st.floats(-np.pi, np.pi), min_size=5, max_size=5).map(np.array)


def test_a_settled_target_scores_one() -> None:
    joints = word_to_angles(TARGET) + SUCCESS_TOLERANCE * np.array([0.9, -0.9, 0, 0.5, -0.5])
    assert GOAL.judged(FoldStatus.FOLDED, joints).is_reached
    assert GOAL.judged(FoldStatus.FOLDED, joints).score == 1.0


@pytest.mark.parametrize("joint", range(5))
def test_one_joint_beyond_the_tolerance_is_no_success(joint: int) -> None:
    joints = word_to_angles(TARGET)
    joints[joint] += 1.1 * SUCCESS_TOLERANCE
    assert not GOAL.judged(FoldStatus.FOLDED, joints).is_reached
    assert GOAL.judged(FoldStatus.FOLDED, joints).score < 0.5


@pytest.mark.parametrize("status", [FoldStatus.MISFOLDED, FoldStatus.UNSETTLED, None])
def test_the_right_angles_without_rest_score_half(status: FoldStatus | None) -> None:
    assert GOAL.judged(status, word_to_angles(TARGET)).score == pytest.approx(0.5)


@pytest.mark.parametrize("joints", [np.full(5, np.nan), word_to_angles(TARGET)])
def test_a_failure_scores_nothing_whatever_its_angles(joints: np.ndarray) -> None:
    assert GOAL.judged(FoldStatus.FAILED, joints).score == 0.0


def test_another_fold_scores_half_its_similarity() -> None:
    for word in folded_words(6):
        if word != TARGET:
            joints = word_to_angles(word)
            expected = 0.5 * similarity(joints, word_to_angles(TARGET))
            assert GOAL.judged(FoldStatus.FOLDED, joints).score == pytest.approx(expected)
            assert expected < 0.5


def test_the_mirror_image_is_not_the_target() -> None:
    assert not GOAL.judged(FoldStatus.FOLDED, word_to_angles(mirror(TARGET))).is_reached


@given(angles)
def test_the_potential_is_half_the_similarity(joints: np.ndarray) -> None:
    expected = 0.5 * similarity(joints, word_to_angles(TARGET))
    assert GOAL.judged(None, joints).potential == pytest.approx(expected, abs=1e-12)


@given(angles)
def test_an_outlines_potential_is_that_of_the_likest_word(joints: np.ndarray) -> None:
    goal = goal_of("LLRRL", "outline")
    expected = max(0.5 * similarity(joints, word_to_angles(word)) for word in goal.words)
    assert goal.judged(None, joints).potential == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("n", [2, 5, 7, pytest.param(8, marks=pytest.mark.slow)])
def test_an_outline_is_reached_by_exactly_the_words_that_cover_it(n: int) -> None:
    words = folded_words(n)
    for target in words:
        goal = goal_of(target, "outline")
        assert goal.words[0] == target
        same = {word for word in words if outline(word) == outline(target)}
        assert set(goal.words) == same
        for word in words:
            assert goal.judged(FoldStatus.FOLDED, word_to_angles(word)).is_reached == (word in same)
