import numpy as np
import pytest

from agents.evaluation.episodes import Method, Outcome, parse_methods
from agents.evaluation.report import (
    ENDS,
    by_target,
    end_of,
    ends,
    joints_in_the_way,
    pooled,
)

QUARTER = 0.5 * np.pi


def outcome(target: str, status: str, *joints: float, success: bool = False) -> Outcome:
    word = "?" * len(target)
    return Outcome(target, word, status, 1, success, score=0.0, reward=0.0, joints=joints)


@pytest.mark.parametrize(
    ("text", "name", "policies"),
    [
        ("random", "random", ("random",)),
        ("runs/robust.json", "robust", ("runs/robust.json",)),
        ("runs/ppo/policy.safetensors", "ppo", ("runs/ppo/policy.safetensors",)),
        ("policy.safetensors", "policy", ("policy.safetensors",)),
        (
            "PPO=a/p.safetensors,b/p.safetensors",
            "PPO",
            ("a/p.safetensors", "b/p.safetensors"),
        ),
    ],
)
def test_a_method_has_a_name_and_a_policy_a_seed(
    text: str, name: str, policies: tuple[str, ...]
) -> None:
    assert Method.parse(text) == Method(name, policies)


@pytest.mark.parametrize("text", ["", "PPO=", "=a.zip", "PPO=a.zip,", "PPO=a.zip,a.zip"])
def test_a_wrong_method_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is not allowed; must be random, minimiser, a path"):
        Method.parse(text)


def test_two_methods_of_one_name_are_refused() -> None:
    with pytest.raises(ValueError, match="policy: two methods have this name"):
        parse_methods(["policy.safetensors", "policy=other.zip"])


def test_scores_are_put_in_a_table_of_runs_and_targets() -> None:
    one, two = (outcome("LL", "folded", success=True), outcome("LL", "misfolded"))
    other = outcome("RR", "folded", success=True)
    runs = [[one, two, other], [two, two, other]]
    np.testing.assert_array_equal(by_target(runs), [[0.5, 1.0], [0.0, 1.0]])
    assert len(pooled(runs)) == 6
    assert pooled(runs, "RR") == [other, other]


def test_every_episode_comes_to_one_end() -> None:
    outcomes = [
        outcome("LL", "folded", success=True),
        outcome("LL", "folded"),
        *(outcome("LL", status) for status in ("misfolded", "unsettled", "failed")),
    ]
    assert [end_of(each) for each in outcomes] == list(ENDS)
    assert ends(outcomes[1:]) == dict.fromkeys(ENDS, 1) | {"target": 0}


def test_joints_that_were_in_the_way_are_counted() -> None:
    outcomes = [
        outcome("LRL", "misfolded", QUARTER, -0.3, QUARTER),  # joint 2 stayed open
        outcome("LRL", "folded", -QUARTER, -QUARTER, QUARTER - 0.01),  # joint 1 is an R
        outcome("LRL", "folded", QUARTER, -QUARTER, QUARTER, success=True),
        outcome("LRL", "failed", 0.0, 0.0, 0.0),
    ]
    assert joints_in_the_way(outcomes) == {"open": [0, 1, 0], "wrong": [1, 0, 0]}
