import math
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from agents.commands import text_table
from agents.evaluation.episodes import Method, Outcome
from agents.evaluation.policies import OpenLoop
from agents.evaluation.report import (
    overall_rows,
    results_of,
    summarise,
    targets_rows,
)
from agents.settings import EnvSettings
from magfold_env.reporting.intervals import share
from magfold_env.scoring.results import Results
from magfold_env.shapes import word_to_angles


def outcome(target: str, success: bool, built: bool | None = None) -> Outcome:
    word = target if success else "SSSSS"
    return Outcome(
        target=target,
        word=word,
        status="folded" if success else "misfolded",
        seed=1,
        success=success,
        score=1.0 if success else 0.2,
        reward=0.3 if success else -0.5,
        joints=tuple(word_to_angles(word).tolist()),
        choice=OpenLoop(("NSNS",) * 6, (0.1,) * 6),
        scene=None,
        built=built,
    )


def run(*successes: bool, built: bool | None = None) -> list[Outcome]:
    words = ["LRLLL"] * (len(successes) - 1) + ["RRRLR"]
    return [outcome(word, each, built) for word, each in zip(words, successes, strict=True)]


RESULTS = {
    "minimiser": [run(False, False, False)],
    "good": [run(True, False, True), run(True, True, True)],
}
METHODS = [Method("minimiser", ("minimiser",)), Method("good", ("a.zip", "b.zip"))]


def test_all_runs_of_a_method_count() -> None:
    good = summarise(RESULTS)["good"]
    assert good.success.value == pytest.approx((0.75 + 1.0) / 2)
    assert good.score.value == pytest.approx(((0.6 + 1.0) / 2 + 1.0) / 2)
    assert good.targets["LRLLL"] == share(3, 4)
    assert good.ahead is not None
    assert good.ahead.value == pytest.approx(good.success.value)
    assert good.ends["target"] == 5
    assert good.ends["misfolded"] == 1
    assert good.joints["open"] == [1] * 5


def test_success_of_chains_built_beforehand_is_apart() -> None:
    results = {"one": [run(True, True, True, built=False)]}
    built = summarise(results)["one"].built
    assert built is not None
    assert (built.value, summarise(results)["one"].success.value) == (0.0, 1.0)
    assert summarise(RESULTS)["good"].built is None


def shown(table: object) -> dict[str, list[str]]:
    text = StringIO()
    Console(file=text, width=200).print(table)
    rows = [line.replace("│", " ").split() for line in text.getvalue().splitlines()]
    return {row[0]: row[1:] for row in rows if len(row) > 1}


def test_the_tables_count_by_target_and_overall() -> None:
    summaries = summarise(RESULTS)
    by_target = shown(text_table("", targets_rows(summaries)))
    assert by_target["LRLLL"] == ["0/2", "3/4"]
    assert by_target["RRRLR"] == ["0/1", "2/2"]
    overall = shown(text_table("", overall_rows(summaries)))
    assert overall["good"][:2] == str(summaries["good"].success).split()[:2]
    assert overall["minimiser"][-1] == "−0.500"
    assert overall["good"][-1] == "+0.200"


def test_the_file_holds_every_number_and_what_repeats_it(tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    summaries = summarise(RESULTS)
    results_of(EnvSettings(), METHODS, [7, 8], RESULTS, summaries).write(path)
    found = Results.read(path, "evaluation")
    good = found.rows["good"]
    assert good.success == pytest.approx([float(each) for each in summaries["good"].success])
    assert good.figures["targets"]["LRLLL"] == [3, 4]
    assert [each.success for each in good.runs] == ["101", "111"]
    assert good.runs[0].details["sequence"][0] == ["NSNS"] * 6
    assert good.runs[0].details["joints"][0][0] == pytest.approx(math.pi / 2)
    assert [each.name for each in good.files] == ["a.zip", "b.zip"]
    assert (found.id, found.seeds) == ("MagFold/TubeFeed-v0", (7, 8))
    assert found.tasks == ("LRLLL", "RRRLR")
    assert {"commit", "physics", "torch", "magfold_env", "command"} <= set(found.provenance)
