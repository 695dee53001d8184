"""Tests of fold words, outlines and similarity."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_env import shapes
from tests.words import reverse
from tests.words import words as all_words

words = st.text("LSR", max_size=9)
angle_lists = st.integers(0, 6).flatmap(
    lambda n: st.lists(st.floats(-1.57, 1.57), min_size=n, max_size=n)
)


@given(words)
def test_words_and_angles_round_trip(word: str) -> None:
    angles = shapes.word_to_angles(word)
    assert angles.shape == (len(word),)
    assert shapes.angles_to_word(angles) == word


@pytest.mark.parametrize(
    ("degrees", "letter"),
    [(45.1, "L"), (44.9, "S"), (-44.9, "S"), (-45.1, "R"), (359, "S"), (269, "R"), (-460, "R")],
)
def test_letters_change_at_45_degrees(degrees: float, letter: str) -> None:
    assert shapes.angles_to_word([np.deg2rad(degrees)]) == letter


def test_wrong_angles_are_refused() -> None:
    with pytest.raises(ValueError, match="must be finite"):
        shapes.angles_to_word([0.0, np.nan])
    with pytest.raises(ValueError, match=r"joint_angles_b: shape \(1,\) is not allowed"):
        shapes.similarity([0.0, 0.0], [0.0])


@given(words)
def test_symmetries_act_on_the_cells(word: str) -> None:
    assert shapes.overlaps(word) == shapes.overlaps(shapes.mirror(word))
    flipped = shapes.cells(word) * [1, -1]
    np.testing.assert_array_equal(shapes.cells(shapes.mirror(word)), flipped)
    assert shapes.outline(reverse(word)) == shapes.outline(word)


@given(words)
def test_cells_are_the_centres_in_half_diagonals(word: str) -> None:
    angles = shapes.headings(shapes.word_to_angles(word))
    place = shapes.centres(angles, side=np.sqrt(2.0))  # half a diagonal is 1
    np.testing.assert_allclose(shapes.cells(word), place - place[0], atol=1e-12)


@pytest.mark.parametrize("n", range(1, 8))
def test_overlap_agrees_with_the_papers_3_mm_filter(n: int) -> None:
    for word in map("".join, product("LSR", repeat=n - 1)):
        place = shapes.centres(shapes.headings(shapes.word_to_angles(word)), side=12.5)
        gap = np.linalg.norm(place[:, None] - place[None], axis=-1) + 1e3 * np.eye(n)
        assert shapes.overlaps(word) == bool(gap.min() < 3.0)


def test_the_papers_counts_at_six_components() -> None:
    folded = shapes.folded_words(6)
    assert len(all_words(6)) == 229
    assert len(folded) == 26
    assert folded == [w for w in all_words(6) if shapes.is_fully_folded(w)]
    outlines = [shapes.outline(word) for word in folded]
    assert len(set(outlines)) == 13
    assert all(outlines.count(outline) == 2 for outline in outlines)
    either_hand = {min(shapes.outline(w), shapes.outline(shapes.mirror(w))) for w in folded}
    assert len(either_hand) == 8
    assert shapes.outline("LRLLL") == shapes.outline("RRRLR")


@given(
    st.integers(0, 5).flatmap(
        lambda n: st.lists(st.text("LSR", min_size=n, max_size=n), min_size=2, max_size=2)
    )
)
def test_an_outline_is_the_same_cells_turned_and_moved(pair: list[str]) -> None:
    first, second = pair

    def seen(word: str, turns: int) -> set[complex]:
        points = shapes.cells(word) @ np.array([1, 1j]) * 1j**turns
        return {complex(p) - min(points.real) - 1j * min(points.imag) for p in points}

    same = any(seen(first, 0) == seen(second, turns) for turns in range(4))
    overlapping = shapes.overlaps(first) or shapes.overlaps(second)
    assert overlapping or (shapes.outline(first) == shapes.outline(second)) == same


@given(st.sampled_from(shapes.folded_words(6) + shapes.folded_words(7)), st.integers(0, 3))
def test_a_drawing_is_covered_by_the_words_of_its_outline(word: str, turns: int) -> None:
    x, y = shapes.cells(word).T
    squares = np.stack([x - y, x + y], axis=1) // 2
    squares = squares @ np.linalg.matrix_power([[0, 1], [-1, 0]], turns)
    squares -= squares.min(axis=0) - 1
    signs = np.full(squares.max(axis=0)[::-1] + 2, ".")
    signs[squares[:, 1], squares[:, 0]] = "#"
    drawing = "\n".join("".join(row) for row in signs[::-1])
    assert shapes.drawn_outline(drawing) == shapes.outline(word)
    covering = shapes.words_of_outline(shapes.drawn_outline(drawing))
    alike = [w for w in shapes.folded_words(len(x)) if shapes.outline(w) == shapes.outline(word)]
    assert list(covering) == alike


def test_no_folded_chain_covers_a_t() -> None:
    assert shapes.words_of_outline(shapes.drawn_outline("###\n.#.")) == ()
    assert shapes.words_of_outline(shapes.drawn_outline("#")) == ("",)


@pytest.mark.parametrize("covered", [
    (), ((0, 0), (0, 0)), ((0, 0), (1, 1), (1, 1)),
    shapes.drawn_outline("#.#"), shapes.drawn_outline("##.\n..#"), shapes.drawn_outline("##..##"),
])  # fmt: skip
def test_cells_that_no_edges_connect_are_refused(covered: shapes.Outline) -> None:
    with pytest.raises(ValueError, match="edges must connect all cells"):
        shapes.words_of_outline(covered)


@pytest.mark.parametrize("drawing", ["", "..\n..", "#x#", "#\t#"])
def test_what_is_no_drawing_is_refused(drawing: str) -> None:
    with pytest.raises(ValueError, match=r"drawing: .* is not allowed; must be lines of # for"):
        shapes.drawn_outline(drawing)


@given(angle_lists, st.floats(-4, 4), st.floats(-1, 1), st.floats(-1, 1))
def test_similarity_is_its_definition_wherever_the_folds_lie(angles, turn, x, y):
    other = np.array(angles)[::-1]
    n = len(angles) + 1

    def place(i: int, joints: np.ndarray, first: float, base: tuple[float, float]) -> np.ndarray:
        heads = shapes.headings(joints, first)
        away = shapes.centres(heads, base=base) - shapes.centres(heads, base=base)[i]
        spin = np.array(
            [[np.cos(heads[i]), np.sin(heads[i])], [-np.sin(heads[i]), np.cos(heads[i])]]
        )
        return away @ spin.T

    total = 0.0
    for i, j in product(range(n), repeat=2):
        if i != j:
            p = place(i, np.array(angles), turn, (x, y))[j]
            q = place(i, other, 0.0, (0.0, 0.0))[j]
            total += np.exp(-np.sum((p - q) ** 2))
    expected = total / (n * (n - 1)) if n > 1 else 1.0
    assert shapes.similarity(angles, other) == pytest.approx(expected, rel=1e-9)
