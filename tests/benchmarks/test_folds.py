"""`bench dynamics --only folds`: which folds are timed, and what is said of them."""

import numpy as np
import pytest

from magfold_bench import folds
from magfold_bench.folds import DEFAULT, Effort
from magfold_bench.runs import CLOSE, KINDS
from magfold_env.fold import FoldStatus


def row(kind, tolerance, error, time=1.0):
    return {
        "kind": kind,
        "tolerance [rad]": tolerance,
        "final error [rad]": error,
        "time [ms]": time,
        "evaluations": 10,
        "steps": 2,
    }


@pytest.mark.parametrize("kind", KINDS)
def test_scenes_are_what_their_kinds_say_and_reproducible(kind):
    scene = folds.scene_of(kind, 1)
    assert scene == folds.scene_of(kind, 1)
    assert scene.is_concrete
    assert scene.n == folds.COMPONENTS
    assert ("tube" in kind) == (scene.mount == "tube")
    assert ("no friction" in kind) == (scene.friction == 0.0)


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


def test_a_tolerance_counts_only_if_every_fold_ends_close():
    rows = [row("k", 1e-2, 0.0, 1.0), row("k", 1e-2, 2 * CLOSE, 1.0)]
    rows += [row("k", DEFAULT, 0.0, 5.0), row("k", DEFAULT, 0.5 * CLOSE, 7.0)]
    finding = folds.finding("k", rows)
    assert f"6 ms at tolerance {DEFAULT:g} (all 2 folds)" in finding
    assert "1 ms" not in finding


@pytest.mark.slow
def test_later_uses_load_what_the_first_compiles() -> None:
    part = folds.first_use(True, lambda share, what: None)
    first, later = (float(row["processor time [s]"]) for row in part.rows)
    assert [row["process"] for row in part.rows] == ["first use", "later use"]
    assert later < first / 3
