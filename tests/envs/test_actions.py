import numpy as np
import pytest

from magfold_env.envs.actions import FASTEST, PATTERNS, SLOWEST, ActionTable
from magfold_env.envs.baseline import CANDIDATE_SPEEDS


def test_patterns_are_the_sixteen_and_read_as_bits() -> None:
    assert len(set(PATTERNS)) == 16
    for index, faces in enumerate(PATTERNS):
        bits = int("".join("1" if face == "S" else "0" for face in faces), 2)
        assert bits == index


@pytest.mark.parametrize("levels", [2, 5, 9])
def test_speeds_are_log_spaced_between_the_limits(levels: int) -> None:
    speeds = ActionTable(levels).speeds
    assert speeds[0] == pytest.approx(SLOWEST)
    assert speeds[-1] == pytest.approx(FASTEST)
    ratios = speeds[1:] / speeds[:-1]
    np.testing.assert_allclose(ratios, ratios[0])


def test_every_action_decodes_and_encodes_back() -> None:
    table = ActionTable(5)
    for pattern in range(16):
        for level in range(5):
            choice = table.decode([pattern, level])
            assert choice.faces == PATTERNS[pattern]
            again = table.encode(choice.faces, choice.speed)
            np.testing.assert_array_equal(again, [pattern, level])


def test_default_levels_offer_the_speeds_of_the_baseline() -> None:
    np.testing.assert_allclose(ActionTable(9).speeds[::2], CANDIDATE_SPEEDS)


@pytest.mark.parametrize(
    "action", [[16, 0], [0, 9], [-1, 0], [0], [0, 0, 0], 3, [0.5, 1.0], "NS", None]
)
def test_a_wrong_action_is_an_error_that_says_what_is_allowed(action: object) -> None:
    with pytest.raises(ValueError, match=r"action: .* not allowed; .*0\.\.15.*0\.\.8"):
        ActionTable(9).decode(action)


def test_an_action_table_needs_two_levels() -> None:
    with pytest.raises(ValueError, match="speeds: 1 is not allowed"):
        ActionTable(1)
