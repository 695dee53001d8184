"""Tests of methods, the policies that they name, and the outcomes of their episodes."""

import math
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from agents.commands import text_table
from agents.evaluation.episodes import Method, Outcome, parse_methods, play
from agents.evaluation.policies import OpenLoop, at_random
from agents.evaluation.report import (
    ENDS,
    by_target,
    ends,
    overall_rows,
    results_of,
    summarise,
    targets_rows,
)
from agents.settings import EnvSettings
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.reporting.intervals import share
from magfold_env.scoring.results import Results
from magfold_env.shapes import word_to_angles

TARGET = "LRL"
QUASI: dict[str, Any] = {"components": 4, "fidelity": "quasistatic"}


def test_random_actions_lie_in_any_space() -> None:
    for kind in ("multidiscrete", "discrete", "box"):
        env = TubeFeedEnv(**QUASI, actions=kind)
        outcomes = [play(at_random, env, TARGET, seed) for seed in (1, 2, 1)]
        assert outcomes[0] == outcomes[2] != outcomes[1]


def outcome(target: str, status: str, success: bool = False) -> Outcome:
    return Outcome(target, "?", status, 1, success, score=0.0, reward=0.0)


@pytest.mark.parametrize(("text", "name", "policies"), [
    ("random", "random", ("random",)),
    ("runs/robust.json", "robust", ("runs/robust.json",)),
    ("runs/ppo/policy.safetensors", "ppo", ("runs/ppo/policy.safetensors",)),
    ("policy.safetensors", "policy", ("policy.safetensors",)),
    ("PPO=a/p.safetensors,b/p.safetensors", "PPO", ("a/p.safetensors", "b/p.safetensors")),
])  # fmt: skip
def test_a_method_has_a_name_and_a_policy_a_seed(text, name, policies):
    assert Method.parse(text) == Method(name, policies)


@pytest.mark.parametrize("text", ["", "PPO=", "=a.zip", "PPO=a.zip,", "PPO=a.zip,a.zip"])
def test_a_wrong_method_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is not allowed; must be random, minimiser, a path"):
        Method.parse(text)


def test_two_methods_of_one_name_are_refused() -> None:
    with pytest.raises(ValueError, match="policy: two methods have this name"):
        parse_methods(["policy.safetensors", "policy=other.zip"])


def test_scores_are_put_in_a_table_of_runs_and_targets_and_every_episode_comes_to_one_end() -> None:
    one, two = (outcome("LL", "folded", success=True), outcome("LL", "misfolded"))
    other = outcome("RR", "folded", success=True)
    runs = [[one, two, other], [two, two, other]]
    np.testing.assert_array_equal(by_target(runs), [[0.5, 1.0], [0.0, 1.0]])
    assert ends(runs) == dict.fromkeys(ENDS, 0) | {"target": 3, "misfolded": 3}
    each = [outcome("LL", status) for status in ("folded", "misfolded", "unsettled", "failed")]
    assert ends([[one, *each]]) == dict.fromkeys(ENDS, 1)


def ended(target: str, success: bool, built: bool | None = None) -> Outcome:
    word = target if success else "SSSSS"
    return Outcome(
        target=target, word=word, status="folded" if success else "misfolded", seed=1,
        success=success, score=1.0 if success else 0.2, reward=0.3 if success else -0.5,
        joints=tuple(word_to_angles(word).tolist()), choice=OpenLoop(("NSNS",) * 6, (0.1,) * 6),
        scene=None, built=built,
    )  # fmt: skip


def run(*successes: bool, built: bool | None = None) -> list[Outcome]:
    words = ["LRLLL"] * (len(successes) - 1) + ["RRRLR"]
    return [ended(word, each, built) for word, each in zip(words, successes, strict=True)]


RESULTS = {
    "minimiser": [run(False, False, False)],
    "good": [run(True, False, True), run(True, True, True)],
}
METHODS = [Method("minimiser", ("minimiser",)), Method("good", ("a.zip", "b.zip"))]


def test_all_runs_of_a_method_count() -> None:
    good: Any = summarise(RESULTS)["good"]
    assert good.success.value == pytest.approx((0.75 + 1.0) / 2)
    assert good.score.value == pytest.approx(((0.6 + 1.0) / 2 + 1.0) / 2)
    assert good.targets["LRLLL"] == share(3, 4)
    assert good.ahead.value == pytest.approx(good.success.value)
    assert good.ends["target"] == 5
    assert good.ends["misfolded"] == 1
    built: Any = summarise({"one": [run(True, True, True, built=False)]})["one"].built
    assert (built.value, summarise(RESULTS)["good"].built) == (0.0, None)


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
