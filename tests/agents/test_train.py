from pathlib import Path

import pytest
from gymnasium.error import ResetNeeded
from stable_baselines3 import PPO

from agents.evaluate import evaluate
from agents.evaluation.episodes import Method, make_env, warm_up
from agents.settings import TrainSettings
from agents.training import policy_files
from agents.training.run import train
from magfold_env.envs.tasks.draws import episode_seeds

SETTINGS = TrainSettings.model_validate(
    {
        "name": "tiny",
        "timesteps": 96,
        "envs": 1,
        "checkpoint_every": 48,
        "validate_every": 48,
        "validation_episodes": 2,
        "env": {"targets": ["LRLLL", "RLRRR"]},
        "learner": {
            "algorithm": "ppo",
            "n_steps": 48,
            "batch_size": 24,
            "n_epochs": 2,
            "hidden": [16],
        },
    }
)


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


def test_an_interrupted_save_leaves_the_old_policy(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "policy.safetensors"
    path.write_bytes((run / "policy.safetensors").read_bytes())
    before = path.read_bytes()

    def broken(target: Path, content: bytes) -> None:
        target.write_text("half")
        raise OSError("no space left")

    model = PPO("MlpPolicy", make_env(SETTINGS.env), device="cpu")
    monkeypatch.setattr(Path, "write_bytes", broken)
    with pytest.raises(OSError, match="no space"):
        policy_files.save(model, path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_the_engine_is_ready_before_training_begins(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    # Compiling takes minutes: it must neither count as training nor be left to every process.
    order: list[str] = []

    class BegunError(Exception):
        pass

    def begin(_settings: TrainSettings, _phase: int) -> None:
        order.append("training")
        raise BegunError

    monkeypatch.setattr("agents.training.run.warm_up", lambda _settings: order.append("ready"))
    monkeypatch.setattr("agents.training.run.make_training_envs", begin)
    with pytest.raises(BegunError):
        train(SETTINGS, tmp_path)
    assert order == ["ready", "training"]


def test_warming_up_plays_a_whole_episode(monkeypatch: pytest.MonkeyPatch) -> None:
    env = make_env(SETTINGS.env)
    monkeypatch.setattr("agents.evaluation.episodes.make_env", lambda _settings: env)
    warm_up(SETTINGS.env)
    with pytest.raises(ResetNeeded, match="the episode is over"):
        env.step(env.action_space.sample())
