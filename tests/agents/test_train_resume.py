"""Tests that a run that was killed and resumed ends like an uninterrupted run."""

import errno
import itertools
import os
import zipfile
from pathlib import Path
from typing import Any

import pytest

from agents.settings import SettingsError, TrainSettings
from agents.training.folder import RunInfo
from agents.training.models import REST
from agents.training.run import train
from tests.agents.training import killed, records, same_weights, tiny

pytestmark = pytest.mark.train


PRETRAINED: dict[str, Any] = {
    "pretraining": [{"timesteps": 100, "env": {"match": "outline"}}],
    "timesteps": 200,
}


SLOW = pytest.mark.slow
RUNS = [
    pytest.param(tiny("ppo", envs=2), id="ppo"),
    pytest.param(tiny("ppo", own={"shared_layers": True}, envs=2), id="ppo, shared layers"),
    pytest.param(tiny("ppo", own={"frames": 3, "blind": True}, envs=2), id="ppo, frames, blind"),
    pytest.param(tiny("sac", own={"frames": 3}, timesteps=200), id="sac, frames", marks=SLOW),
    pytest.param(tiny("recurrent-ppo", envs=2), id="recurrent-ppo"),
    pytest.param(tiny("recurrent-ppo", **PRETRAINED), id="recurrent-ppo in two phases", marks=SLOW),
    pytest.param(tiny("tqc", True, **PRETRAINED), id="tqc with hindsight in two phases"),
    pytest.param(tiny("ppo", **PRETRAINED), id="ppo in two phases", marks=SLOW),
    pytest.param(tiny("maskable-ppo"), id="maskable-ppo", marks=SLOW),
    pytest.param(tiny("sac", timesteps=200), id="sac", marks=SLOW),
    pytest.param(tiny("tqc", timesteps=200), id="tqc", marks=SLOW),
    pytest.param(tiny("sac", True, timesteps=200), id="sac with hindsight", marks=SLOW),
]


@pytest.mark.medium
@pytest.mark.parametrize("settings", RUNS)
def test_a_killed_run_goes_on_bit_for_bit(settings: TrainSettings, tmp_path: Path) -> None:
    whole, broken = tmp_path / "whole", tmp_path / "killed"
    train(settings, whole)
    # Before the first checkpoint, in the random actions, later, and twice from one checkpoint.
    for calls in (10, 28, 35, 40, 3):
        killed(settings, broken, calls)
    train(settings, broken)
    for name in ("policy.safetensors", "best.safetensors"):
        assert same_weights(whole / name, broken / name)
    written = records(broken)
    for steps in ([step for step, _ in series] for series in written.values()):
        assert steps == sorted(set(steps))
    assert written == records(whole)
    info: Any = RunInfo.read(broken)
    assert info.finished
    assert info.resumed_at == sorted(info.resumed_at) != []


@pytest.mark.medium
def test_a_finished_run_is_left_as_it_is(tmp_path: Path) -> None:
    policy = train(tiny(), tmp_path)
    before = policy.stat().st_mtime_ns
    assert train(tiny(), tmp_path) == policy
    assert policy.stat().st_mtime_ns == before
    train(tiny(), tmp_path, resume=False)
    assert policy.stat().st_mtime_ns > before


@pytest.mark.medium
@pytest.mark.parametrize("algorithm", ["ppo", "recurrent-ppo", pytest.param("sac", marks=SLOW)])
def test_a_finished_run_that_is_lengthened_is_the_longer_run(algorithm, tmp_path):
    short, long = (tiny(algorithm, envs=2, timesteps=steps) for steps in (200, 400))
    train(long, tmp_path / "whole")
    lengthened = tmp_path / "lengthened"
    train(short, lengthened)
    shorter, other = tiny(algorithm, timesteps=96), tiny(algorithm, seed=1)
    refused = (long, None), (shorter, True), (other, True)
    for settings, resume in refused:
        with pytest.raises(SettingsError, match="holds another run, whose"):
            train(settings, lengthened, resume)
    # Killed on the way, and taken up as the longer one.
    killed(long, lengthened, 3, resume=True)
    policy = train(long, lengthened)
    assert same_weights(tmp_path / "whole" / "policy.safetensors", policy)
    written, whole = records(lengthened), records(tmp_path / "whole")
    for name, series in whole.items():
        # Where the short one ended it was validated besides.
        assert set(series) <= set(written[name])
        assert name.startswith("validation/") or series == written[name]
    info: Any = RunInfo.read(lengthened)
    assert info.finished
    assert info.resumed_at[0] >= 200
    (lengthened / "resume.zip").unlink()
    with pytest.raises(SettingsError, match="there is no checkpoint to resume from"):
        train(long.model_copy(update={"timesteps": 500}), lengthened, resume=True)


@pytest.mark.medium
def test_a_run_that_a_full_disk_broke_off_goes_on(tmp_path: Path) -> None:
    train(tiny(), tmp_path / "whole")
    write, states = zipfile.ZipFile.writestr, itertools.count()

    def full_disk(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
        write(archive, name, content)
        if name == REST and next(states):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    broken = tmp_path / "broken"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("agents.training.models.zipfile.ZipFile.writestr", full_disk)
        told = rf"^\[Errno \d+\] {os.strerror(errno.ENOSPC)}: '.*resume\.zip'$"
        with pytest.raises(OSError, match=told):
            train(tiny(), broken)
    train(tiny(), broken)
    assert same_weights(tmp_path / "whole" / "policy.safetensors", broken / "policy.safetensors")
    assert records(tmp_path / "whole") == records(broken)
