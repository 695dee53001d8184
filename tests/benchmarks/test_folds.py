"""`bench dynamics --only folds`: which folds are timed, and what is said of them."""

import numpy as np

from magfold_bench import folds
from magfold_bench.folds import DEFAULT, Effort
from magfold_bench.runs import KINDS
from magfold_env.fold import FoldStatus


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
