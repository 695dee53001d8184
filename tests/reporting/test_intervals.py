import math

import pytest

from magfold_env.reporting.intervals import share

Z = 1.959963984540054


@pytest.mark.parametrize(("successes", "trials"), [(0, 10), (10, 10), (3, 7), (200, 520)])
def test_the_interval_is_wilsons(successes: int, trials: int) -> None:
    result = share(successes, trials)
    # The ends solve (p - rate)² = z² p (1 - p) / trials.
    for p in (result.low, result.high):
        assert (p - result.rate) ** 2 == pytest.approx(Z**2 * p * (1 - p) / trials, abs=1e-12)
    assert 0 <= result.low <= result.rate <= result.high <= 1
    assert not math.isclose(result.low, result.high)


def test_a_share_in_a_dictionary_tells_its_interval() -> None:
    assert repr({"LRLLL": share(3, 4)}) == "{'LRLLL': <Share 3 of 4: 75 % (30–95)>}"
