import numpy as np
import pytest

from magfold_env.envs.reward import SUCCESS_TOLERANCE, is_success, potential, score
from magfold_env.fold import FoldStatus
from magfold_env.shapes import folded_words, mirror, similarity, word_to_angles

TARGET = "LRLLL"


def test_a_settled_target_scores_one() -> None:
    angles = word_to_angles(TARGET) + SUCCESS_TOLERANCE * np.array([0.9, -0.9, 0, 0.5, -0.5])
    assert is_success(FoldStatus.FOLDED, angles, TARGET)
    assert score(FoldStatus.FOLDED, angles, TARGET) == 1.0


@pytest.mark.parametrize("joint", range(5))
def test_one_joint_beyond_the_tolerance_is_no_success(joint: int) -> None:
    angles = word_to_angles(TARGET)
    angles[joint] += 1.1 * SUCCESS_TOLERANCE
    assert not is_success(FoldStatus.FOLDED, angles, TARGET)
    assert score(FoldStatus.FOLDED, angles, TARGET) < 0.5


@pytest.mark.parametrize("status", [FoldStatus.MISFOLDED, FoldStatus.UNSETTLED, None])
def test_the_right_angles_without_rest_score_half(status: FoldStatus | None) -> None:
    assert score(status, word_to_angles(TARGET), TARGET) == pytest.approx(0.5)


def test_a_failure_scores_nothing_even_with_angles_that_are_no_numbers() -> None:
    assert score(FoldStatus.FAILED, np.full(5, np.nan), TARGET) == 0.0


def test_another_fold_scores_half_its_similarity() -> None:
    for word in folded_words(6):
        if word != TARGET:
            angles = word_to_angles(word)
            expected = 0.5 * similarity(angles, word_to_angles(TARGET))
            assert score(FoldStatus.FOLDED, angles, TARGET) == pytest.approx(expected)
            assert expected < 0.5


def test_the_mirror_image_is_not_the_target() -> None:
    assert not is_success(FoldStatus.FOLDED, word_to_angles(mirror(TARGET)), TARGET)


def test_the_potential_is_largest_at_the_target() -> None:
    at_target = potential(word_to_angles(TARGET), TARGET)
    rng = np.random.default_rng(0)
    others = [potential(rng.uniform(-1.5, 1.5, 5), TARGET) for _ in range(100)]
    assert at_target == pytest.approx(0.5)
    assert max(others) < at_target
