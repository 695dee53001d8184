from typing import Any

import numpy as np
import pytest

from magfold_env.envs.baselines.baseline import CANDIDATE_SPEEDS
from magfold_env.envs.spaces.actions import (
    DEAD_BAND,
    FASTEST,
    PATTERNS,
    SIGNS,
    SLOWEST,
    ActionKind,
    ActionTable,
    SpeedTable,
    read_catalogue,
    scaled_speeds,
    speeds_at,
)

KINDS: tuple[ActionKind, ...] = ("multidiscrete", "discrete", "box")


def test_patterns_are_the_sixteen_and_read_as_bits() -> None:
    assert len(set(PATTERNS)) == 16
    for index, faces in enumerate(PATTERNS):
        bits = int("".join("1" if face == "S" else "0" for face in faces), 2)
        assert bits == index
        np.testing.assert_array_equal(SIGNS[index], [1 if face == "N" else -1 for face in faces])


@pytest.mark.parametrize("levels", [2, 5, 9])
def test_speeds_are_log_spaced_between_the_limits(levels: int) -> None:
    speeds = ActionTable(levels).speeds
    assert speeds[0] == pytest.approx(SLOWEST)
    assert speeds[-1] == pytest.approx(FASTEST)
    ratios = speeds[1:] / speeds[:-1]
    np.testing.assert_allclose(ratios, ratios[0])


def test_the_log_scale_goes_from_the_slowest_to_the_fastest_and_back() -> None:
    scaled = np.linspace(-1, 1, 11)
    speeds = speeds_at(scaled)
    np.testing.assert_allclose(speeds[[0, -1]], [SLOWEST, FASTEST])
    assert (np.diff(speeds) > 0.0).all()
    np.testing.assert_allclose(scaled_speeds(speeds), scaled, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_every_choice_is_written_and_read_back(kind: ActionKind) -> None:
    table = ActionTable(5, kind=kind)
    for faces in PATTERNS:
        for speed in table.speeds.tolist():
            action = table.encode([faces], speed)
            assert action in table.space
            read, at = table.decode(action)
            assert read == (faces,)
            assert at == pytest.approx(speed, rel=1e-6)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("components", [1, 3])
def test_every_action_of_the_space_can_be_read(kind: ActionKind, components: int) -> None:
    table = ActionTable(9, components, kind)
    table.space.seed(0)
    for _ in range(100):
        sequence, speed = table.decode(table.space.sample())
        assert len(sequence) == components
        assert SLOWEST * (1 - 1e-9) <= speed <= FASTEST * (1 + 1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_a_sequence_is_written_and_read_back(kind: ActionKind) -> None:
    table = ActionTable(9, 3, kind)
    sequence = ("NSNN", "SSSS", "NNSN")
    assert table.decode(table.encode(sequence, 0.6))[0] == sequence


def test_default_levels_offer_the_speeds_of_the_baseline() -> None:
    np.testing.assert_allclose(ActionTable(9).speeds[::2], CANDIDATE_SPEEDS)


@pytest.mark.parametrize(
    ("kind", "action", "allowed"),
    [
        *(
            ("multidiscrete", action, r"two integers, pattern 0\.\.15 and speed level 0\.\.8")
            for action in ([16, 0], [0, 9], [-1, 0], [0], [0, 0, 0], 3, [0.5, 1.0], "NS", None)
        ),
        *(("discrete", action, r"an integer, 0\.\.143") for action in (144, -1, 0.5, [1], None)),
        *(
            ("box", action, "5 numbers from -1 to 1")
            for action in ([0] * 4, [2.0] * 5, [np.nan] * 5, 1)
        ),
    ],
)
def test_a_wrong_action_is_an_error_that_says_what_is_allowed(
    kind: ActionKind, action: object, allowed: str
) -> None:
    with pytest.raises(ValueError, match=rf"action: .* is not allowed; must be {allowed}"):
        ActionTable(9, kind=kind).decode(action)


@pytest.mark.parametrize("bound", [-1.0, 1.0])
def test_numbers_that_miss_a_bound_by_rounding_are_the_bound(bound: float) -> None:
    for table in (ActionTable(9, kind="box"), SpeedTable(5)):
        size = table.space.shape[0]  # pyright: ignore[reportOptionalSubscript]
        near = np.full(size, np.nextafter(np.float32(bound), np.float32(2.0 * bound)))
        read, expected = table.read_one(near), table.read_one(np.full(size, bound))
        np.testing.assert_equal(read, expected)
        with pytest.raises(ValueError, match=r"is not allowed; must be .*from -1 to 1"):
            table.read_one(near + 2e-6 * bound)


def test_wrong_tables_are_refused() -> None:
    with pytest.raises(ValueError, match="speeds: 1 is not allowed"):
        ActionTable(1)
    for table in (ActionTable, SpeedTable):
        with pytest.raises(ValueError, match="actions: 'dict' is not allowed; must be one of mult"):
            table(9, kind="dict")  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="actions: 'discrete' is not allowed for 6 components"):
        ActionTable(9, 6, "discrete")


def test_masks_leave_out_what_cannot_be_built_and_nothing_else() -> None:
    catalogue = read_catalogue(["NSNS", "NNNN", "SSNN"])
    single = ActionTable(3, kind="discrete", catalogue=catalogue)
    mask = single.masks()
    assert mask.shape == (48,)
    for action in range(48):
        faces, _ = ActionTable(3, kind="discrete").decode(action)
        assert mask[action] == (PATTERNS.index(faces[0]) in catalogue)
    several = ActionTable(3, 2, catalogue=catalogue)
    parts = np.split(several.masks(), [16, 32])
    for part in parts[:2]:
        assert tuple(np.flatnonzero(part)) == catalogue
    assert parts[2].all()
    with pytest.raises(ValueError, match="actions: 'box' is not allowed with masks"):
        ActionTable(3, kind="box").masks()


@pytest.mark.parametrize("kind", KINDS)
def test_what_cannot_be_built_becomes_the_nearest_that_can(kind: ActionKind) -> None:
    built = ["NSNS", "NNNN", "SSNN"]
    table = ActionTable(3, kind=kind, catalogue=read_catalogue(built))
    for faces in PATTERNS:
        ((chosen,), _) = table.decode(table.encode([faces], 0.1))
        apart = {other: sum(a != b for a, b in zip(faces, other, strict=True)) for other in built}
        assert apart[chosen] == min(apart.values())


@pytest.mark.parametrize("catalogue", [[], ["NSN"], ["NS-N"], "NSNS", ["NSNS", "nsns"]])
def test_a_wrong_catalogue_is_named(catalogue: list[str]) -> None:
    with pytest.raises(ValueError, match=r"catalogue: .* is not allowed; must be a list"):
        read_catalogue(catalogue)


def speed_of(table: SpeedTable, action: Any) -> float:
    """Return the speed that an action asks for."""
    return float(table.read_one(action)[0][0])


@pytest.mark.parametrize("kind", KINDS)
def test_the_feed_speed_reaches_as_far_back_as_ahead(kind: ActionKind) -> None:
    table = SpeedTable(5, kind)
    lowest = {"discrete": 0, "multidiscrete": [0], "box": [-1.0]}[kind]
    highest = {"discrete": 10, "multidiscrete": [10], "box": [1.0]}[kind]
    assert speed_of(table, lowest) == -FASTEST
    assert speed_of(table, highest) == FASTEST
    table.space.seed(0)
    for _ in range(50):
        speed = abs(speed_of(table, table.space.sample()))
        assert speed == 0.0 or DEAD_BAND <= speed <= FASTEST
    for wrong in (11, -1, [2.0], {"speed": [0.5]}, None, "fast"):
        with pytest.raises(ValueError, match=r"action: .* is not allowed; must be"):
            speed_of(table, wrong)


@pytest.mark.parametrize("kind", KINDS)
def test_speeds_of_the_table_are_what_their_actions_ask_for(kind: ActionKind) -> None:
    table = SpeedTable(4, kind)
    for speed in table.speeds.tolist():
        assert speed_of(table, table.encode(speed)) == pytest.approx(speed, rel=1e-6)
    np.testing.assert_array_equal(table.speeds, -table.speeds[::-1])
    read = table.read(table.write((table.speeds,)), len(table.speeds))
    np.testing.assert_allclose(read, (table.speeds,), rtol=1e-6)


def test_a_feed_that_hardly_moves_stands_still() -> None:
    table = SpeedTable(5)
    edge = np.sqrt(DEAD_BAND / FASTEST)
    for sign in (-1.0, 1.0):
        assert speed_of(table, [sign * (edge - 1e-6)]) == 0.0
        assert speed_of(table, [sign * (edge + 1e-6)]) == pytest.approx(sign * DEAD_BAND, rel=1e-4)
