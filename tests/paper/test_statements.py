"""Tests of when the paper's statements about releases hold."""

import pytest

from magfold_bench.paper.statements import HOLDS, RELEASES, Released
from magfold_env.ensembles.releases import Ensemble, Run
from magfold_env.scene import load_scene
from tests.paper.measured import FITTING, Ends

SCENE = load_scene("paper/sequence-1")
NAMES = {
    1: {"S1A": "LRLLL", "S1B": "RRLLL", "S1C": "LRLLR", "S1E": "LRRRL"},
    2: {"S2A": "LRLLL", "S2B": "LRLRL", "S2C": "LRRLL"},
    3: {"S3A": "LRLLL"},
}


def made_of(counts: dict[str, int]) -> Ensemble:
    words = [word for word, count in counts.items() for _ in range(count)]
    runs = [
        Run(k, word, "misfolded" if "S" in word else "folded", 0.0, 0.0, (0.0,) * SCENE.n)
        for k, word in enumerate(words)
    ]
    return Ensemble.of(SCENE, 0, runs)


def holding(number: int, ends: Ends) -> dict[str, bool]:
    stable = frozenset(word for name, word in NAMES[number].items() if name != "S1E")
    made = Released(NAMES[number], stable, {mode: made_of(each) for mode, each in ends.items()})
    return {each.name: each.degree(made) > HOLDS for each in RELEASES[number]}


@pytest.mark.parametrize("number", NAMES)
def test_what_the_text_says_meets_all(number: int) -> None:
    assert all(holding(number, FITTING[number]).values())


@pytest.mark.parametrize(("number", "mode", "counts", "broken"), [
    (1, "free", {"LRLLL": 60, "LRLLR": 40}, {"1 free"}),
    (1, "free", {"LRSLR": 100}, {"1 free"}),
    (1, "forward", {"RRLLL": 60, "LRLLR": 40}, {"1 forward"}),
    (1, "forward", {"LRLLR": 100}, {"1 S1B"}),
    (1, "backward", {"LRLLL": 80, "LRLLR": 20}, {"1 backward"}),
    (1, "free", {"LRLLR": 60, "LLRLL": 40}, {"1 folds"}),
    (2, "forward", {"LRRLL": 90, "LRLRL": 10}, {"2 forward"}),
    (2, "backward", {"LRLLL": 100}, {"2 backward"}),
    (3, "forward", {"LLLSL": 100}, {"3 forward", "3 misfolds"}),
    (3, "backward", {"LRLLL": 55, "LRLSL": 45}, {"3 modes"}),
])  # fmt: skip
def test_other_ends_break_what_they_contradict(number, mode, counts, broken):
    held = holding(number, {**FITTING[number], mode: counts})
    assert {name for name, holds in held.items() if not holds} == broken
