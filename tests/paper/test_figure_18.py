"""Tests of statements about outcomes in Figure 18, and of the least movement to a shape."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws.experiment import paper_scene
from magfold_bench.paper import figure_18
from magfold_bench.tables import Row
from magfold_env.minimiser import Mode
from magfold_env.reporting.intervals import share
from magfold_env.shapes import centres, headings, word_to_angles
from tests.paper.measured import FITTING, Ends, outcomes

SAID = (
    "1 free", "1 forward", "2 free", "2 forward", "split 1", "split 2", "named", "3 free",
    "3 forward", "3 backward", "misfolds", "modes",
)  # fmt: skip


def judged(every: dict[int, Ends]) -> dict[str, str]:
    rows: list[Row] = []
    for sequence, ends in every.items():
        for mode, counts in ends.items():
            for word, count in counts.items():
                found = share(count, sum(counts.values()))
                row: Row = {"sequence": sequence, "mode": mode, "word": word}
                row |= {"status": "misfolded" if "S" in word else "folded"}
                rows.append(row | {"probability": found.rate, "low": found.low, "high": found.high})
    return dict(zip(SAID, outcomes(figure_18.judge(rows, "")), strict=True))


def test_the_papers_words_agree_with_themselves() -> None:
    assert judged(FITTING) == dict.fromkeys(SAID, "agrees")


@pytest.mark.parametrize(("number", "mode", "counts", "claim"), [
    (1, "free", {"LRLLL": 60, "LRLLR": 40}, "1 free"),
    (1, "forward", {"LRSLR": 100}, "1 forward"),
    (2, "forward", {"LRRLL": 90, "LRLRL": 10}, "2 forward"),
    (1, "backward", {"LRLLL": 90, "LRLLR": 10}, "split 1"),
    (1, "backward", {"RRLLL": 50, "RRLLR": 50}, "named"),
    (2, "backward", {"LRLLL": 100}, "split 2"),
    (3, "backward", {"RRLLL": 100}, "3 backward"),
    (3, "backward", {"LRLLL": 40, "LRLSS": 60}, "3 backward"),
])  # fmt: skip
def test_other_shares_disagree(number: int, mode: Mode, counts: dict[str, int], claim: str) -> None:
    ends = {**FITTING, number: {**FITTING[number], mode: counts}}
    assert judged(ends)[claim] == "disagrees"


def test_no_turn_makes_the_movement_less() -> None:
    word = "LRRLS"
    straight, there = centres(np.zeros(6)), centres(headings(word_to_angles(word)))
    straight, there = (places - places.mean(axis=0) for places in (straight, there))
    tried: list[float] = []
    for turn in np.linspace(0.0, 2.0 * np.pi, 721):
        c, s = np.cos(turn), np.sin(turn)
        apart = there @ np.array([[c, s], [-s, c]]) - straight
        tried.append(float(np.sqrt((apart**2).sum(axis=1).mean())))
    assert figure_18.movement(word) == pytest.approx(min(tried), rel=1e-4)
    assert figure_18.movement(word) <= min(tried) + 1e-12
    assert figure_18.least_moved(2) == ["LRLRL"]
    assert "LRLLL" not in figure_18.least_moved(1)


@pytest.mark.parametrize(("number", "mode"), [(1, "free"), (2, "forward"), (3, "backward")])
def test_only_friction_over_remanence_squared_and_speed_over_remanence_count(number, mode):
    scene = paper_scene(number, mode).replace(friction=0.35)
    scene = scene.replace(magnets={"remanence": 0.6}, feed={"speed": 0.05})
    twice = scene.replace(magnets={"remanence": 1.2}, friction=1.4, feed={"speed": 0.1})
    one, other = (mf.ensemble(each, runs=8, workers=1) for each in (scene, twice))
    assert one.word.tolist() == other.word.tolist()
    assert one.status.tolist() == other.status.tolist()
    # The tolerances of the solver are the same for both, so that not all bits are.
    np.testing.assert_allclose(one.time, 2.0 * other.time, rtol=0.05)
    np.testing.assert_allclose(4.0 * one.energy, other.energy, rtol=1e-3)
