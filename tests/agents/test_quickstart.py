from pathlib import Path

import joblib
import pytest

from agents.quickstart import main
from magfold_env.scoring.results import Results


@pytest.mark.train
def test_the_main_job_trains_and_compares(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joblib, "cpu_count", lambda: 1)
    main(minutes=0.01, draws=1, output=tmp_path)
    results = Results.read(tmp_path / "results.json", "evaluation")
    assert list(results.rows) == ["PPO", "PPO, no motion", "random", "minimiser"]
    assert "reward" not in results.env
    for file in ("policy.safetensors", "report.html"):
        assert (tmp_path / file).is_file()
