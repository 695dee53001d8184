from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents.training import policy_files
from agents.training.envs import make_training_envs
from agents.training.models import make_model
from tests.agents.training import call, tiny

minari: Any = pytest.importorskip("minari", reason="needs the extra minari")


@pytest.fixture(autouse=True)
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    return tmp_path


QUICK = ("--env", "fidelity=quasistatic", "--env", "components=3")


def each(value: Any, step: int) -> Any:
    """Return the entries of a step in an array, or in each of several arrays."""
    if isinstance(value, dict):
        return {key: each(part, step) for key, part in value.items()}
    return value[step]


@pytest.mark.medium
@pytest.mark.parametrize(("env_id", "options"), [
    ("MagFold/TubeFeed-v0", QUICK),
    ("MagFold/TubeFeedGoal-v0", (*QUICK, "--env", "actions=box")),
    ("MagFold/UnknownFloor-v0", ()),
])  # fmt: skip
def test_a_dataset_is_loaded_and_its_episodes_repeat(env_id: str, options: tuple[str]) -> None:
    call("record", env_id, *options, "--episodes", "4", "--dataset", "my/own-v3", code=0)
    dataset = minari.load_dataset("my/own-v3")
    assert dataset.total_episodes == 4
    env = dataset.recover_environment()
    told = list(dataset.storage.get_episode_metadata(range(4)))
    for episode, end in zip(dataset.iterate_episodes(), told, strict=True):
        seen, info = env.reset(seed=end["seed"])
        np.testing.assert_equal(each(episode.observations, 0), seen)
        for step, reward in enumerate(episode.rewards):
            seen, again, terminated, truncated, info = env.step(each(episode.actions, step))
            np.testing.assert_equal(each(episode.observations, step + 1), seen)
            assert again == reward
            assert terminated == episode.terminations[step]
            assert truncated == episode.truncations[step]
        assert episode.terminations[-1] or episode.truncations[-1]
        assert all(info[key] == end[key] for key in ("target", "is_success", "score"))


def test_a_trained_policy_is_recorded(tmp_path: Path) -> None:
    settings = tiny()
    model = make_model(settings.learner, make_training_envs(settings, 0), 0)
    path = tmp_path / "mine.safetensors"
    policy_files.save(model, path)
    call("record", "MagFold/TubeFeed-v0", *QUICK, "--policy", str(path), "--episodes", "2", code=0)
    (episode, _) = minari.load_dataset("magfold/TubeFeed/mine-v0").iterate_episodes()
    action, _ = model.predict(episode.observations[0], deterministic=True)
    np.testing.assert_array_equal(action, episode.actions[0])


def test_what_cannot_be_recorded_is_named() -> None:
    assert "id: 'Nothing-v0'" in call("record", "Nothing-v0").output
    named = "MagFold/TubeFeed-v0", *QUICK, "--episodes", "1", "--dataset"
    assert "dataset: 'a b' is not allowed; must look like" in call("record", *named, "a b").output
    assert "dataset: 'a' is not allowed; must look like" in call("record", *named, "a").output
    call("record", *named, "a-v0", code=0)
    again = call("record", *named, "a-v0", code=2)
    assert "dataset: 'a-v0' already exists" in again.output
    assert "no such file" in call("record", *named, "b-v0", "--policy", "nobody").output
    floor = call(
        "record", "MagFold/UnknownFloor-v0", "--policy", "minimiser", "--dataset", "b-v0"
    ).output
    assert "policy: 'minimiser' is not allowed in MagFold/UnknownFloor-v0; must be" in floor
