import json
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from agents.episodes import Outcome
from agents.report import results_table, write_results
from agents.settings import EnvSettings
from magfold_env.statistics import share


def outcome(target: str, success: bool) -> Outcome:
    return Outcome(
        target=target,
        word=target if success else "SSSSS",
        status="folded" if success else "misfolded",
        seed=1,
        success=success,
        score=1.0 if success else 0.2,
        reward=0.3 if success else -0.5,
        scene=None,
    )


RESULTS = {
    "random": [outcome("LRLLL", False), outcome("LRLLL", False), outcome("RRRLR", False)],
    "good": [outcome("LRLLL", True), outcome("LRLLL", False), outcome("RRRLR", True)],
}


def test_the_table_counts_by_target_and_overall() -> None:
    text = StringIO()
    Console(file=text, width=100).print(results_table(RESULTS))
    rows = [line.split() for line in text.getvalue().splitlines()]
    cells = {row[1]: [cell for cell in row[2:] if cell != "│"] for row in rows if len(row) > 2}
    assert cells["LRLLL"] == ["0/2", "1/2"]
    assert cells["RRRLR"] == ["0/1", "1/1"]
    assert str(share(2, 3)) in text.getvalue()
    assert "-0.500" in text.getvalue()


def test_the_file_holds_every_number(tmp_path: Path) -> None:
    write_results(tmp_path / "results.json", EnvSettings(), RESULTS)
    content = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    good = content["policies"]["good"]
    assert good["success"]["rate"] == pytest.approx(2 / 3)
    assert good["success"]["low"] == pytest.approx(share(2, 3).low)
    assert good["targets"]["LRLLL"]["successes"] == 1
    assert good["mean_score"] == pytest.approx(2.2 / 3)
    assert len(good["episodes"]) == 3
    assert content["env"]["id"] == "MagFold/TubeFeed-v0"
