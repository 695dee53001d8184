"""Folds evaluate their accelerations no more often than they did, on any machine."""

import pytest

from magfold_bench.folds import scene_of
from magfold_bench.runs import KINDS, ended

SEEDS = range(4)
KNOWN = {"free, no friction": 1833, "free, friction 0.35": 2448, "tube, 0.1 m/s": 5104}
"""Evaluations at the default tolerance, of the folds of these seeds together."""


@pytest.mark.parametrize("kind", KINDS)
def test_folds_need_no_more_evaluations(kind: str) -> None:
    assert sum(ended(scene_of(kind, seed)).evaluations for seed in SEEDS) < 1.2 * KNOWN[kind]
