"""How fast gaps may close."""

import pytest

from magfold_env.engine.contact.constraints import GENTLE, PUSH_OUT, allowance
from magfold_env.scene import Scene
from magfold_env.simulation.pack import pack

MODEL = pack(Scene(sequence=("NNSS",) * 4))
SIDE = MODEL.side


@pytest.mark.parametrize("time", [1e-9, 1e-5, 1e-2])
def test_a_gap_may_close_within_the_time_and_no_further(time):
    assert allowance(MODEL, 1e-6, time, SIDE) == pytest.approx(1e-6 / time)
    assert allowance(MODEL, 0.0, time, SIDE) == 0.0


def test_overlaps_open_slowly_and_no_faster_than_errors_of_rates_allow():
    slow = GENTLE * MODEL.tolerance * MODEL.rate_scale
    assert allowance(MODEL, -1e-12, 1e-2, SIDE) == pytest.approx(-PUSH_OUT * 1e-10)
    for time in (1e-9, 1e-5):
        assert allowance(MODEL, -1e-5, time, SIDE) == pytest.approx(-slow * SIDE)
        assert allowance(MODEL, -1e-5, time, 1.0) == pytest.approx(max(-slow, -2e-6 / time))
