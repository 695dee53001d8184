"""How components of a tray lie, and how choices of them are written."""

import numpy as np
import pytest

from magfold_env.envs.spaces.actions import FACES, LYING, PATTERNS, PULL, TrayTable

CORNERS = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
"""Where front-left, back-left, back-right and front-right are: along the chain, and to the left."""


@pytest.mark.parametrize("lie", range(8))
def test_to_lie_otherwise_is_to_turn_and_to_turn_over(lie: int) -> None:
    moved = CORNERS * ([1, -1] if lie >= 4 else [1, 1])
    for _ in range(lie % 4):
        moved = moved @ [[0, 1], [-1, 0]]
    for place, face in enumerate(FACES[lie]):
        np.testing.assert_array_equal(moved[face], CORNERS[place])


def test_patterns_lie_as_their_faces_do() -> None:
    for pattern, faces in enumerate(PATTERNS):
        for lie, places in enumerate(FACES):
            assert PATTERNS[LYING[pattern, lie]] == "".join(faces[place] for place in places)


@pytest.mark.parametrize("kind", ["multidiscrete", "discrete"])
def test_actions_are_read_as_they_were_written(kind: str) -> None:
    table = TrayTable(9, 5, kind)  # pyright: ignore[reportArgumentType]
    table.space.seed(0)
    actions = np.array([table.space.sample() for _ in range(50)])
    for action in actions:
        (part,), (lie,), (speed,), (back,) = table.read_one(action)
        np.testing.assert_array_equal(table.encode(part, lie, speed, back=back), action)
    np.testing.assert_array_equal(table.write(table.read(actions, 50)), actions)


@pytest.mark.parametrize("kind", ["multidiscrete", "discrete"])
def test_masks_leave_out_what_cannot_be_done(kind: str) -> None:
    table = TrayTable(3, 2, kind)  # pyright: ignore[reportArgumentType]
    there = np.array([[True, False, True], [False, True, True]])
    masks = table.masks(there, np.array([False, True]))
    space = table.space
    if kind == "discrete":
        for mask, on, back in zip(masks, there, (False, True), strict=True):
            for number, allowed in enumerate(mask):
                part, _, _, wants = (each[0] for each in table.read_one(number))
                assert allowed == (back if wants else on[part])
        return
    assert masks.shape == (2, sum(table.sizes))
    space.seed(0)
    cuts = np.cumsum(table.sizes)[:-1]
    sampled = space.sample(mask=tuple(part.astype(np.int8) for part in np.split(masks[0], cuts)))
    assert sampled[0] != 1
    assert sampled[3] == 0


@pytest.mark.parametrize("kind", ["multidiscrete", "discrete"])
def test_an_anchor_can_always_be_pulled_at(kind: str) -> None:
    table = TrayTable(3, 2, kind, ways=3)  # pyright: ignore[reportArgumentType]
    assert table.read_one(table.pull)[3] == [PULL]
    mask = table.masks(np.array([[False, False, True]]), np.array([False]))[0]
    assert mask[table.pull if kind == "discrete" else -1]
    with pytest.raises(
        ValueError, match=r"must be (an integer, 0\.\.143|.* and 0, 1, .*, or 2, to p)"
    ):
        table.read_one(144 if kind == "discrete" else [0, 0, 0, 3])


def test_wrong_actions_and_options_are_named() -> None:
    with pytest.raises(ValueError, match=r"component 0\.\.8, orientation 0\.\.7"):
        TrayTable(9, 5).read_one([9, 0, 0, 0])
    with pytest.raises(ValueError, match=r"must be an integer, 0\.\.719"):
        TrayTable(9, 5, "discrete").read_one(720)
    with pytest.raises(ValueError, match="'box' is not allowed; must be one of multidiscrete, dis"):
        TrayTable(9, 5, "box")
