from itertools import product

import numpy as np
import pytest
from scipy import stats

from agents.evaluation.intervals import difference, estimate, interquartile_mean, mean, percent
from magfold_env.shapes import mirror

WORDS = [f"L{''.join(rest)}" for rest in product("LSR", repeat=3)]
"""Words without mirror images of each other."""
RNG = np.random.default_rng(0)


def by_scipy(values: np.ndarray) -> tuple[float, float]:
    found = stats.bootstrap(
        (values,), np.mean, method="percentile", n_resamples=20_000, rng=np.random.default_rng(1)
    )
    return found.confidence_interval.low, found.confidence_interval.high


def test_with_one_run_targets_are_drawn() -> None:
    scores = RNG.random((1, 26))
    found = estimate(scores, WORDS[:26])
    assert found.value == pytest.approx(scores.mean())
    np.testing.assert_allclose((found.low, found.high), by_scipy(scores[0]), atol=0.01)


def test_a_run_that_is_lucky_is_so_on_all_targets() -> None:
    # Drawing runs for each target on their own would make this interval far too narrow.
    runs = RNG.random(5)
    found = estimate(np.repeat(runs[:, None], 26, axis=1), WORDS[:26])
    np.testing.assert_allclose((found.low, found.high), by_scipy(runs), atol=0.02)


@pytest.mark.medium
def test_intervals_hold_the_truth_about_as_often_as_they_say() -> None:
    rng = np.random.default_rng(2)
    held = 0
    for k in range(200):
        scores = 0.1 * rng.normal(size=(8, 1)) + 0.2 * rng.normal(size=(1, 20))
        found = estimate(scores + 0.1 * rng.normal(size=(8, 20)), WORDS[:20], seed=k)
        held += bool(found.low <= 0.0 <= found.high)
    assert 0.88 <= held / 200 <= 1.0


def test_the_middle_half_leaves_out_the_best_and_the_worst_quarter() -> None:
    scores = np.array([[0.0, 0.0, 0.5, 0.7], [0.6, 0.8, 1.0, 1.0]])
    assert interquartile_mean(scores) == pytest.approx(np.mean([0.5, 0.6, 0.7, 0.8]))
    stacked = np.stack([scores, 1.0 - scores])
    np.testing.assert_allclose(
        interquartile_mean(stacked), [interquartile_mean(each) for each in stacked]
    )


def test_a_difference_is_paired() -> None:
    # What targets share cancels; what is left is the same everywhere.
    scores = RNG.random((1, 26))
    found = difference(scores, scores - 0.2, WORDS[:26])
    np.testing.assert_allclose(found, 0.2)
    wide = estimate(scores, WORDS[:26])
    assert wide.high - wide.low > 0.1


def test_the_same_seed_gives_the_same_interval_which_is_written_in_per_cent() -> None:
    scores = RNG.random((3, 7))
    assert estimate(scores, WORDS[:7], mean, seed=4) == estimate(scores, WORDS[:7], mean, seed=4)
    assert estimate(scores, WORDS[:7], mean, seed=4) != estimate(scores, WORDS[:7], mean, seed=5)
    assert str(estimate(np.ones((2, 3)), WORDS[:3])) == "100 % (100–100)"
    assert [percent(share, "+") for share in (-1.0, 0.0, 0.1234)] == ["−100", "+0.0", "+12.3"]


def test_a_word_and_its_mirror_image_are_drawn_together() -> None:
    # Both have the same score: a word is worth no more for being counted twice.
    scores = RNG.random((1, 13))
    words = [word for each in WORDS[1:14] for word in (each, mirror(each))]
    found = estimate(np.repeat(scores, 2, axis=1), words)
    np.testing.assert_allclose((found.low, found.high), by_scipy(scores[0]), atol=0.02)


def test_words_without_their_images_count_as_much() -> None:
    scores = np.append(np.zeros(20), np.ones(10))[None]
    words = [word for each in WORDS[1:11] for word in (each, mirror(each))] + WORDS[11:21]
    found = estimate(scores, words)
    assert found.value == pytest.approx(1 / 3)
    # Ten pairs at 0 and ten words alone at 1: the mean moves by 0.105.
    assert found.low == pytest.approx(1 / 3 - 0.19, abs=0.05)
    assert found.high == pytest.approx(1 / 3 + 0.22, abs=0.05)
