"""Tests of the meaning of actions, and of how they are encoded."""

from typing import Any

import numpy as np
import pytest

from magfold_env.envs.baselines.baseline import CANDIDATE_SPEEDS
from magfold_env.envs.spaces.actions import (
    DEAD_BAND,
    FACES,
    FASTEST,
    LYING,
    PATTERNS,
    PULL,
    SIGNS,
    SLOWEST,
    ActionKind,
    ActionTable,
    SpeedTable,
    TrayTable,
    read_catalogue,
    scaled_speeds,
    speeds_at,
)

KINDS: tuple[ActionKind, ...] = ("multidiscrete", "discrete", "box")
every_kind = pytest.mark.parametrize("kind", KINDS)
whole_kind = pytest.mark.parametrize("kind", KINDS[:2])


def test_patterns_are_the_sixteen_and_read_as_bits() -> None:
    assert len(set(PATTERNS)) == 16
    for index, faces in enumerate(PATTERNS):
        bits = int("".join("1" if face == "S" else "0" for face in faces), 2)
        assert bits == index
        np.testing.assert_array_equal(SIGNS[index], [1 if face == "N" else -1 for face in faces])


def test_speeds_are_log_spaced_between_the_limits() -> None:
    for levels in (2, 5, 9):
        speeds = ActionTable(levels).speeds
        np.testing.assert_allclose(speeds[[0, -1]], [SLOWEST, FASTEST])
        ratios = speeds[1:] / speeds[:-1]
        np.testing.assert_allclose(ratios, ratios[0])
    scaled = np.linspace(-1, 1, 11)
    np.testing.assert_allclose(scaled_speeds(speeds_at(scaled)), scaled, atol=1e-9)
    np.testing.assert_allclose(ActionTable(9).speeds[::2], CANDIDATE_SPEEDS)


@every_kind
@pytest.mark.parametrize("components", [1, 3])
def test_choices_are_written_and_read_back(kind: ActionKind, components: int) -> None:
    table = ActionTable(9, components, kind)
    for k, faces in enumerate(PATTERNS):
        for speed in table.speeds.tolist():
            sequence = [faces, PATTERNS[k - 5], PATTERNS[k - 3]][:components]
            action = table.encode(sequence, speed)
            assert action in table.space
            read, at = table.decode(action)
            assert read == tuple(sequence)
            assert at == pytest.approx(speed, rel=1e-6)
    table.space.seed(0)
    for _ in range(100):
        sequence, speed = table.decode(table.space.sample())
        assert len(sequence) == components
        assert SLOWEST * (1 - 1e-9) <= speed <= FASTEST * (1 + 1e-9)


PAIR = r"two integers, pattern 0\.\.15 and speed level 0\.\.8"
TRAY = r"four integers, component 0\.\.8, orientation 0\.\.7, speed level 0\.\.4 and 0 or 1"
PULLED = r"four integers, .* and 0, 1, to draw back, or 2, to pull"
WRONG: list[tuple[Any, str, tuple[Any, ...]]] = [
    (ActionTable(9), PAIR, ([16, 0], [0, 9], [-1, 0], [0], [0] * 3, 3, [0.5, 1.0], "NS", None)),
    (ActionTable(9, kind="discrete"), r"an integer, 0\.\.143", (144, -1, 0.5, [1], None)),
    (ActionTable(9, kind="box"), "5 numbers from -1 to 1", ([0] * 4, [2.0] * 5, [np.nan] * 5, 1)),
    (SpeedTable(5), "one number from -1 to 1", (11, [2.0], {"speed": [0.5]}, None, "fast")),
    (SpeedTable(5, "discrete"), r"an integer, 0\.\.10", (11, -1, [2.0], None, "fast")),
    (SpeedTable(5, "multidiscrete"), r"a list of an integer, 0\.\.10", (11, [11], [2.0], None)),
    (TrayTable(9, 5), TRAY, ([9, 0, 0, 0], [0, 8, 0, 0], [0, 0, 0, 2], [0] * 3)),
    (TrayTable(9, 5, "discrete"), r"an integer, 0\.\.719", (720, -1)),
    (TrayTable(3, 2, ways=3), PULLED, ([0, 0, 0, 3],)),
    (TrayTable(3, 2, "discrete", ways=3), r"an integer, 0\.\.143", (144,)),
]


@pytest.mark.parametrize(("table", "allowed", "actions"), WRONG)
def test_a_wrong_action_is_named(table: Any, allowed: str, actions: tuple[Any, ...]) -> None:
    for action in actions:
        with pytest.raises(ValueError, match=rf"action: .* is not allowed; must be {allowed}"):
            table.read_one(action)


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
    with pytest.raises(ValueError, match="'box' is not allowed; must be one of multidiscrete, dis"):
        TrayTable(9, 5, "box")


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


@every_kind
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
    """Return the speed that an action requests."""
    return float(table.read_one(action)[0][0])


@every_kind
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
    for speed in table.speeds.tolist():
        assert speed_of(table, table.encode(speed)) == pytest.approx(speed, rel=1e-6)
    np.testing.assert_array_equal(table.speeds, -table.speeds[::-1])
    read = table.read(table.write((table.speeds,)), len(table.speeds))
    np.testing.assert_allclose(read, (table.speeds,), rtol=1e-6)


def test_numbers_request_speeds_by_their_squares() -> None:
    table = SpeedTable(5)
    for number, speed in ((0.25, 0.0375), (-0.4, -0.096), (0.7, 0.294), (0.2, 0.0)):
        assert speed_of(table, [number]) == pytest.approx(speed)
    assert table.encode(0.12) == pytest.approx([0.447], abs=5e-4)
    assert table.encode(-0.096) == pytest.approx([-0.4])


def test_a_feed_that_hardly_moves_stands_still() -> None:
    table = SpeedTable(5)
    edge = np.sqrt(DEAD_BAND / FASTEST)
    for sign in (-1.0, 1.0):
        assert speed_of(table, [sign * (edge - 1e-6)]) == 0.0
        assert speed_of(table, [sign * (edge + 1e-6)]) == pytest.approx(sign * DEAD_BAND, rel=1e-4)


CORNERS = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
"""Directions of the four faces: along the chain, and to the left."""


@pytest.mark.parametrize("lie", range(8))
def test_to_lie_otherwise_is_to_turn_and_to_turn_over(lie: int) -> None:
    moved = CORNERS * ([1, -1] if lie >= 4 else [1, 1])
    for _ in range(lie % 4):
        moved = moved @ [[0, 1], [-1, 0]]
    for place, face in enumerate(FACES[lie]):
        np.testing.assert_array_equal(moved[face], CORNERS[place])
    for pattern, faces in enumerate(PATTERNS):
        assert PATTERNS[LYING[pattern, lie]] == "".join(faces[place] for place in FACES[lie])


@whole_kind
def test_choices_from_a_tray_are_read_as_they_were_written(kind: ActionKind) -> None:
    table = TrayTable(9, 5, kind)
    table.space.seed(0)
    actions = np.array([table.space.sample() for _ in range(50)])
    for action in actions:
        (part,), (lie,), (speed,), (back,) = table.read_one(action)
        np.testing.assert_array_equal(table.encode(part, lie, speed, back=back), action)
    np.testing.assert_array_equal(table.write(table.read(actions, 50)), actions)


@whole_kind
def test_masks_leave_out_what_cannot_be_done(kind: ActionKind) -> None:
    table = TrayTable(3, 2, kind)
    there = np.array([[True, False, True], [False, True, True]])
    masks = table.masks(there, np.array([False, True]))
    if kind == "discrete":
        for mask, on, back in zip(masks, there, (False, True), strict=True):
            for number, allowed in enumerate(mask):
                part, _, _, wants = (each[0] for each in table.read_one(number))
                assert allowed == (back if wants else on[part])
        return
    np.testing.assert_array_equal(masks[:, :3], there)
    assert masks[:, 3:-1].all()
    assert masks[:, -1].tolist() == [False, True]


@whole_kind
def test_an_anchor_can_always_be_pulled_at(kind: ActionKind) -> None:
    table = TrayTable(3, 2, kind, ways=3)
    assert table.read_one(table.pull)[3] == [PULL]
    mask = table.masks(np.array([[False, False, True]]), np.array([False]))[0]
    assert mask[table.pull if kind == "discrete" else -1]
