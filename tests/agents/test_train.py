from pathlib import Path

import pytest

from agents.evaluate import evaluate
from agents.evaluation.episodes import Method
from agents.training.run import train
from magfold_env.envs.tasks.draws import episode_seeds
from tests.agents.training import tiny

TARGETS = {"targets": ["LRLLL", "RLRRR"]}
SETTINGS = tiny(timesteps=96, envs=1, validate_every=48, validation_episodes=2, env=TARGETS)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    train(SETTINGS, folder)
    return folder


def test_a_run_leaves_policy_checkpoints_settings_and_logs(run: Path) -> None:
    assert (run / "policy.safetensors").is_file()
    assert (run / "settings.yaml").is_file()
    names = {file.name for file in (run / "checkpoints").iterdir()}
    assert names == {"policy-000000048.safetensors", "policy-000000096.safetensors"}
    assert list(run.glob("events.out.tfevents.*"))


def test_the_same_seed_trains_the_same_policy(run: Path, tmp_path: Path) -> None:
    again = train(SETTINGS, tmp_path)
    assert again.read_bytes() == (run / "policy.safetensors").read_bytes()


@pytest.mark.medium
def test_a_trained_policy_plays_the_same_in_any_number_of_processes(run: Path) -> None:
    method = Method("own", (str(run / "policy.safetensors"),))
    alone, shared = (evaluate([method], SETTINGS.env, 1, processes) for processes in (1, 2))
    assert alone == shared
    (seed,) = episode_seeds("evaluation", 1)
    assert [(each.target, each.seed) for each in alone["own"][0]] == [
        (target, seed) for target in ("LRLLL", "RLRRR")
    ]
