import json
from pathlib import Path

import joblib
import pytest

from agents.quickstart import main


@pytest.mark.train
def test_the_main_job_trains_and_compares(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joblib, "cpu_count", lambda: 1)
    main(minutes=0.01, draws=1, output=tmp_path)
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert list(results["methods"]) == ["PPO", "PPO, no motion", "random", "minimiser"]
    assert results["env"]["reward"] is None
    for file in ("policy.safetensors", "report.html", "folds.gif"):
        assert (tmp_path / file).is_file()
