"""A run begins or goes on only where it belongs, and from what is whole."""

from collections.abc import Callable
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from agents.settings import SettingsError, TrainSettings, save_settings
from agents.train import main
from agents.training import policy_files
from agents.training.folder import RunInfo, cut_events, event_sizes, file_digest
from agents.training.run import BoundaryCallback, train
from magfold_env.checkpoint import CheckpointError, alone_in
from tests.agents.training import same_weights, tiny

pytestmark = pytest.mark.train

app = typer.Typer()
app.command()(main)
runner = CliRunner()


class KilledError(BaseException):
    """Ends a run as a kill does."""


def begun(settings: TrainSettings, folder: Path) -> Path:
    """Break a run off after its first checkpoint; return the state to go on from."""
    step = BoundaryCallback.on_step

    def stepping(self: BoundaryCallback) -> bool:
        if self.num_timesteps > 60:
            raise KilledError
        return step(self)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(BoundaryCallback, "on_step", stepping)
        with pytest.raises(KilledError):
            train(settings, folder)
    return folder / "resume.zip"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return begun(tiny(), tmp_path_factory.mktemp("begun")).read_bytes()


def flipped(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


@pytest.mark.parametrize(
    "damage",
    [
        pytest.param(lambda content: b"", id="empty"),
        pytest.param(lambda content: content[: len(content) // 2], id="cut"),
        pytest.param(flipped, id="a bit"),
    ],
)
def test_a_damaged_checkpoint_is_refused(
    whole: bytes, damage: Callable[[bytes], bytes], tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    save_settings(tiny(), folder / "settings.yaml")
    (folder / "resume.zip").write_bytes(damage(whole))
    with pytest.raises(CheckpointError, match=r"resume\.zip: is damaged"):
        train(tiny(), folder)
    assert not (folder / "policy.safetensors").exists()


def test_a_foreign_checkpoint_is_refused(whole: bytes, tmp_path: Path) -> None:
    settings = tiny(seed=7)
    save_settings(settings, tmp_path / "settings.yaml")
    (tmp_path / "resume.zip").write_bytes(whole)
    message = r"was written by another run, whose settings\.seed is 0 where this one's is 7"
    with pytest.raises(CheckpointError, match=message):
        train(settings, tmp_path)


def test_other_packages_do_not_go_on_with_a_run(
    whole: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    save_settings(tiny(), tmp_path / "settings.yaml")
    (tmp_path / "resume.zip").write_bytes(whole)
    monkeypatch.setattr("agents.training.folder.versions", lambda: {"python": "2.7"})
    with pytest.raises(CheckpointError, match=r"whose versions\.gymnasium is"):
        train(tiny(), tmp_path)


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
    arguments = [str(tmp_path / "run.yaml"), "--resume", "--output", str(tmp_path / "run")]
    result = runner.invoke(app, arguments)
    assert result.exit_code == 2
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
        ({"own": {"frames": 2}}, "whose frames is 1 where this one's is 2; must be one of the"),
        ({"start": "none.safetensors"}, "start: none.safetensors: no such file"),
        ({"algorithm": "recurrent-ppo"}, "whose algorithm is 'ppo' where"),
    ):
        with pytest.raises(SettingsError, match=message):
            train(tiny(**{"start": str(policy), **changes}), tmp_path / "third")
        assert not (tmp_path / "third").exists()


def test_events_are_cut_to_what_they_were(tmp_path: Path) -> None:
    old, new = tmp_path / "events.out.tfevents.1", tmp_path / "events.out.tfevents.2"
    old.write_bytes(b"1234")
    sizes = event_sizes(tmp_path)
    old.write_bytes(b"123456")
    new.write_bytes(b"78")
    (tmp_path / "other").write_bytes(b"9")
    cut_events(tmp_path, sizes)
    assert old.read_bytes() == b"1234"
    assert not new.exists()
    assert (tmp_path / "other").exists()
