"""Tests that statements about Table 1 and Figures 7 and 19 follow from the energies."""

from pathlib import Path

import pytest

from magfold_bench.paper import states
from magfold_bench.paper.energies import FIGURE_7, FIGURE_19, TABLE_1
from magfold_bench.paper.reproduction import Measured
from magfold_env.minimiser import minimise
from magfold_env.reporting.page import PNG_START
from tests.paper.measured import changed, outcomes


def nothing(share: float, what: str) -> None:
    assert 0.0 <= share <= 1.0


@pytest.fixture(scope="module")
def ends() -> Measured:
    return TABLE_1.measure(True, nothing)


@pytest.fixture(scope="module")
def folds() -> Measured:
    return FIGURE_7.measure(True, nothing)


def test_table_1_is_the_papers(ends: Measured) -> None:
    expected = {
        (1, "forward"): "S1A", (1, "backward"): "S1C", (2, "forward"): "S2B",
        (2, "backward"): "S2B", (3, "forward"): "S3A", (3, "backward"): "S3A",
    }  # fmt: skip
    rows = ends["ends"]
    assert len(rows) == 2 * len(expected)
    for row in rows:
        assert row["state"] == row["in the paper"]
        assert row["state"] == expected[int(row["sequence"]), str(row["direction"])]
    assert outcomes(TABLE_1.claims(ends)) == ["agrees by construction"] * 2


def test_another_end_disagrees_for_its_model_alone(ends: Measured) -> None:
    where = {"sequence": 1, "direction": "backward", "magnets": "device"}
    other = changed(ends, "ends", where, state="S1A")
    literal, device = TABLE_1.claims(other)
    assert literal.outcome == "agrees by construction"
    assert device.outcome == "disagrees"
    assert "5 of 6" in device.found
    assert "sequence 1 backward ends in S1A" in device.found


@pytest.mark.medium
def test_figure_6_decides_one_joint_at_a_time(ends: Measured, tmp_path: Path) -> None:
    every = minimise(states.scene_of(1, "literal"), top=300).states
    scores = {state.word: state.coulomb_score for state in every}
    ends_of = {"forward": "LRLLL", "backward": "LRLLR"}
    for direction, end in ends_of.items():
        rows = [row for row in ends["decisions"] if row["direction"] == direction]
        joints = [1, 2, 3, 4, 5] if direction == "forward" else [5, 4, 3, 2, 1]
        assert [row["joint"] for row in rows] == joints
        for step, row in enumerate(rows, start=1):
            decided = set(joints[:step])
            word = "".join(x if k in decided else "S" for k, x in enumerate(end, start=1))
            assert row["word"] == word
            assert row["score [mJ]"] == pytest.approx(1e3 * scores[word])
    plots = TABLE_1.plots(ends)
    assert [plot.name for plot in plots] == ["figure-6-forward", "figure-6-backward"]
    plots[0].save(tmp_path / "figure.png")
    assert (tmp_path / "figure.png").read_bytes().startswith(PNG_START)


SAID = ["stable", "outlines", "below S1C", "S2A", "positive", "S2A's", "S2C's", "compact"]


@pytest.mark.parametrize(("where", "change", "claim"), [
    ({"sequence": 2, "stable": "yes"}, {"stable": "no"}, "stable"),
    ({"state": "S3A"}, {"score [mJ]": -26.6765}, "outlines"),
    ({"state": "S1E"}, {"conflicts": "2-3"}, "below S1C"),
    ({"state": "S2A"}, {"rank": 2}, "S2A"),
    ({"state": "S2A"}, {"contacts": 5}, "S2A"),
    ({"state": "S2B"}, {"word": "LRRRL"}, "S2A"),
    ({"state": "S2A"}, {"score [mJ]": -0.1}, "positive"),
    ({"state": "S1A"}, {"contacts": 1}, "compact"),
])  # fmt: skip
def test_figure_7_disagrees_with_other_numbers(folds, where, change, claim):
    before = dict(zip(SAID, outcomes(FIGURE_7.claims(folds)), strict=True))
    after = outcomes(FIGURE_7.claims(changed(folds, "states", {**where}, **change)))
    assert before[claim].startswith("agrees")
    assert dict(zip(SAID, after, strict=True))[claim] == "disagrees"


def of_figure_19(a: float, b: float, share: float) -> Measured:
    states_of = [
        {"state": name, "word": states.word_of(name), "score [mJ]": score}
        for name, score in (("S1A", a), ("S1B", b))
    ]
    releases = {"mode": "free", "releases": 9, "state": "S1B", "share": share}
    releases |= {"low": share / 2, "high": 2 * share}
    return {"states": states_of, "releases": [releases]}


def test_figure_19_agrees_with_the_printed_numbers_and_with_no_others() -> None:
    fitting = of_figure_19(-25.8098, -25.6527, 0.0)
    assert outcomes(FIGURE_19.claims(fitting)) == ["agrees by construction", *["agrees"] * 3]
    other = of_figure_19(-25.0, -26.0, 0.1)
    assert outcomes(FIGURE_19.claims(other)) == ["disagrees"] * 4
