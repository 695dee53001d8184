import json
from pathlib import Path

import pytest
import typer
from stable_baselines3 import PPO
from typer.testing import CliRunner

from agents.evaluation.episodes import make_env, play
from agents.evaluation.policies import FrozenPolicy, TrainedPolicy
from agents.evaluation.report import Method
from agents.sample_cost import main, measure, success
from agents.settings import EnvSettings
from agents.training import policy_files
from magfold_env.envs.tasks.draws import evaluation_seeds

SETTINGS = EnvSettings(targets=("LRLLL",))
BUDGETS = (0, 1, 4)


@pytest.fixture(scope="module")
def policy(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("policy") / "ppo.safetensors"
    model = PPO("MlpPolicy", make_env(SETTINGS), policy_kwargs={"net_arch": [8]}, seed=0)
    policy_files.save(model, path)
    return str(path)


@pytest.mark.parametrize("kind", ["cross-entropy", "policy"])
def test_choices_are_scored_on_fresh_draws(kind: str, policy: str) -> None:
    name = policy if kind == "policy" else kind
    curves = measure([Method("one", (name,))], SETTINGS, BUDGETS, draws=3)
    points = curves["one"][0]
    assert [point.budget for point in points] == list(BUDGETS)
    env = make_env(SETTINGS)
    for point in points:
        if point.chosen is None:
            assert (kind, point.budget) == ("policy", 0)
            played = TrainedPolicy.load(policy)
        else:
            assert point.chosen.calls == point.budget
            played = FrozenPolicy({"LRLLL": point.chosen.choice})
        wins = [play(played, env, "LRLLL", seed).success for seed in evaluation_seeds(3)]
        assert point.success == sum(wins) / 3
    assert [float(each.value) for each in success(curves, BUDGETS)["one"]] == [
        point.success for point in points
    ]


def test_the_command_writes_numbers_and_a_picture(tmp_path: Path, policy: str) -> None:
    app = typer.Typer()
    app.command()(main)
    arguments = [f"PPO={policy}", "cross-entropy", "--env", "targets=[LRLLL]", "--calls", "1,0"]
    arguments += ["--draws", "2", "--processes", "1", "--output", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    content = json.loads((tmp_path / "sample-cost.json").read_text(encoding="utf-8"))
    assert content["calls"] == [0, 1]
    assert content["methods"]["PPO"]["training calls"] == [0]
    assert content["methods"]["cross-entropy"]["training calls"] is None
    assert (tmp_path / "sample-cost.png").is_file()


def test_wrong_calls_are_named() -> None:
    app = typer.Typer()
    app.command()(main)
    result = CliRunner().invoke(app, ["cross-entropy", "--calls", "1,few"])
    assert result.exit_code == 2
    assert "--calls: '1,few' is not allowed; must be numbers" in result.output
