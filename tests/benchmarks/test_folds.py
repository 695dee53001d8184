"""Tests of the benchmark of whole folds: its scenes, and a limit on their evaluations."""

import numpy as np
import pytest

from magfold_bench import folds
from magfold_bench.folds import DEFAULT, Effort, scene_of
from magfold_bench.runs import KINDS, ended
from magfold_env.fold import FoldStatus

SEEDS = range(4)
KNOWN = {"free, no friction": 1833, "free, friction 0.35": 2448, "tube, 0.1 m/s": 5104}
"""Total number of evaluations of the folds of these seeds at the default tolerance."""


def test_folds_that_are_timed_end_where_the_reference_does(monkeypatch):
    monkeypatch.setattr(folds, "QUICK", Effort(2, 1, (DEFAULT,)))
    shares = []
    part = folds.folds(True, lambda share, _: shares.append(share))
    assert shares == sorted(shares)
    assert {r["kind"] for r in part.rows} == set(KINDS)
    for r in part.rows:
        assert r["status"] == FoldStatus.FOLDED.value
        assert float(r["final error [rad]"]) < 1e-3
        assert float(r["evaluations"]) > float(r["steps"]) > 0.0
        assert 0.0 < float(r["time [ms]"]) < np.inf
    assert len(part.tables) == len(part.findings) == len(KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_folds_need_no_more_evaluations(kind: str) -> None:
    assert sum(ended(scene_of(kind, seed)).evaluations for seed in SEEDS) < 1.2 * KNOWN[kind]
