"""Tests that a run starts or resumes only in its own folder and from undamaged files."""

from pathlib import Path

import pytest

from agents.settings import SettingsError, save_settings
from agents.training import policy_files
from agents.training.folder import RunInfo, file_digest
from agents.training.run import train
from magfold_env.checkpoint import CheckpointError, alone_in
from tests.agents.training import call, killed, same_weights, tiny

pytestmark = pytest.mark.train


def test_a_checkpoint_that_is_damaged_or_of_another_run_is_refused(tmp_path, monkeypatch):
    killed(tiny(), tmp_path, 60 // tiny().envs)
    state = tmp_path / "resume.zip"
    whole = state.read_bytes()
    for content in (b"", whole[: len(whole) // 2]):
        state.write_bytes(content)
        with pytest.raises(CheckpointError, match=r"resume\.zip: is damaged"):
            train(tiny(), tmp_path)
    state.write_bytes(whole)
    with monkeypatch.context() as patch:
        patch.setattr("agents.training.folder.versions", lambda: {"python": "2.7"})
        with pytest.raises(CheckpointError, match=r"whose versions\.gymnasium is"):
            train(tiny(), tmp_path)
    save_settings(tiny(seed=7), tmp_path / "settings.yaml")
    message = r"was written by another run, whose settings\.seed is 0 where this one's is 7"
    with pytest.raises(CheckpointError, match=message):
        train(tiny(seed=7), tmp_path)
    assert not (tmp_path / "policy.safetensors").exists()


def test_a_folder_is_trained_in_by_one_process_at_a_time(tmp_path: Path) -> None:
    with alone_in(tmp_path), pytest.raises(CheckpointError, match="is in use by process"):
        train(tiny(), tmp_path)
    assert not (tmp_path / "settings.yaml").exists()


def test_another_runs_folder_is_refused_unless_it_may_be_cleared(tmp_path: Path) -> None:
    save_settings(tiny(), tmp_path / "settings.yaml")
    with pytest.raises(SettingsError, match=r"another run, whose seed is 0 where"):
        train(tiny(seed=1), tmp_path)
    train(tiny(timesteps=48), tmp_path, resume=False)
    with pytest.raises(SettingsError, match="another run"):
        train(tiny(), tmp_path)


def test_what_cannot_be_resumed_is_refused(tmp_path: Path) -> None:
    save_settings(tiny(), tmp_path / "run.yaml")
    result = call("train", tmp_path / "run.yaml", "--resume", "--output", tmp_path / "run", code=2)
    assert "there is no checkpoint to resume from" in result.output


def test_a_run_begins_with_a_policy_of_the_same_networks(tmp_path: Path) -> None:
    policy = train(tiny(timesteps=48), tmp_path / "first")
    # A rate so small that weights stay.
    still = {"learning_rate": 1e-30}
    settings = tiny(own=still, timesteps=96, start=str(policy), seed=5)
    second = train(settings, tmp_path / "second")
    assert same_weights(policy, second)
    assert policy_files.load(second).steps == 2 * 48 + 48
    info = RunInfo.read(tmp_path / "second")
    assert info is not None
    assert info.start == file_digest(str(policy))
    for changes, message in (
        ({"own": {"hidden": [8]}}, r"whose actor is .*16.* where this one's is .*8"),
        ({"own": {"frames": 2}}, "whose frames is 1 where this one's is 2; must have the same"),
        ({"start": "none.safetensors"}, "start: none.safetensors: no such file"),
        ({"algorithm": "recurrent-ppo"}, "whose algorithm is 'ppo' where"),
    ):
        with pytest.raises(SettingsError, match=message):
            train(tiny(**{"start": str(policy), **changes}), tmp_path / "third")
        assert not (tmp_path / "third").exists()
