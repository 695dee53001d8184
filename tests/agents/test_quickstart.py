import re
from pathlib import Path

import joblib
import numpy as np
import pytest

from agents.quickstart import CHAINS, FILMED, fold_unseen, main
from magfold_env.scoring.results import Results


@pytest.mark.train
def test_the_main_job_trains_and_compares(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joblib, "cpu_count", lambda: 1)
    main(minutes=0.01, draws=1, output=tmp_path, seed=0)
    results = Results.read(tmp_path / "results.json", "evaluation")
    assert list(results.rows) == ["PPO", "PPO, no motion", "random", "minimiser"]
    assert "reward" not in results.env
    for file in ("policy.safetensors", "report.html"):
        assert (tmp_path / file).is_file()
    assert len(list(tmp_path.glob("films/*.mp4"))) == FILMED


@pytest.mark.train
def test_a_seed_repeats_the_chains_and_seeing_helps(tmp_path, capsys):
    told: list[tuple[int, int]] = []
    for seed in (0, 0, 1, 2):
        fold_unseen(tmp_path, seed)
        found = re.search(r"folds (\d+) with its camera and (\d+) without", capsys.readouterr().out)
        assert found
        told.append((int(found[1]), int(found[2])))
    assert told[0] == told[1]
    seeing, unseeing = np.sum(told[1:], axis=0)
    assert unseeing < seeing <= 3 * CHAINS
