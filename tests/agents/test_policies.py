from pathlib import Path
from typing import Any

import pytest
import sb3_contrib
import stable_baselines3
from stable_baselines3.common.base_class import BaseAlgorithm

from agents.evaluation.episodes import play
from agents.evaluation.policies import (
    ChoiceFile,
    Chosen,
    at_random,
    make_policy,
)
from agents.training import policy_files
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.envs.tube_feed_goal import TubeFeedGoalEnv

TARGET = "LRL"
QUASI: dict[str, Any] = {"components": 4, "fidelity": "quasistatic"}

CASES: dict[str, tuple[type[BaseAlgorithm], Any, dict[str, Any]]] = {
    "PPO": (stable_baselines3.PPO, TubeFeedEnv, {}),
    "MaskablePPO": (sb3_contrib.MaskablePPO, TubeFeedEnv, {"catalogue": ["NSNS", "NNSS"]}),
    "SAC": (stable_baselines3.SAC, TubeFeedEnv, {"actions": "box"}),
    "TQC": (sb3_contrib.TQC, TubeFeedGoalEnv, {"actions": "box"}),
}


@pytest.fixture(params=CASES, scope="module")
def trained(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory):
    algorithm, env_class, options = CASES[request.param]
    env = env_class(**QUASI, **options)
    kind = "MultiInputPolicy" if env_class is TubeFeedGoalEnv else "MlpPolicy"
    buffer: dict[str, Any] = {} if "PPO" in request.param else {"buffer_size": 10}
    small: dict[str, Any] = {"policy_kwargs": {"net_arch": [8]}, "device": "cpu", "seed": 0}
    path = tmp_path_factory.mktemp("policy") / f"{request.param}.safetensors"
    policy_files.save(algorithm(kind, env, **small, **buffer), path)
    return algorithm, env, path


def test_a_policy_of_any_algorithm_is_loaded_and_plays(trained: Any) -> None:
    algorithm, env, path = trained
    policy = make_policy(str(path))
    outcomes = [play(policy, env, TARGET, 0) for _ in range(2)]
    assert outcomes[0] == outcomes[1]
    if algorithm is sb3_contrib.MaskablePPO:
        assert outcomes[0].choice is not None
        assert set(outcomes[0].choice.sequence) <= {"NSNS", "NNSS"}


def test_random_actions_lie_in_any_space() -> None:
    for kind in ("multidiscrete", "discrete", "box", "dict"):
        env = TubeFeedEnv(**QUASI, actions=kind)
        outcomes = [play(at_random, env, TARGET, seed) for seed in (1, 2, 1)]
        assert outcomes[0] == outcomes[2]


def test_files_that_are_no_policies_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="nothing: no such file; must be random, minimiser"):
        make_policy("nothing")
    path = tmp_path / "policy.safetensors"
    path.write_bytes(b"no policy")
    with pytest.raises(ValueError, match=r"policy\.safetensors: is not a policy, or is damaged"):
        make_policy(str(path))


def test_choices_are_a_policy(tmp_path: Path) -> None:
    path = tmp_path / "choices.json"
    ChoiceFile(path, {}).add(TARGET, Chosen(("NSNS",) * 4, (0.2,) * 4, 1, 0, 1))
    policy = make_policy(str(path))
    outcome = play(policy, TubeFeedEnv(**QUASI), TARGET, 0)
    assert outcome.choice is not None
    assert outcome.choice.sequence == ("NSNS",) * 4
