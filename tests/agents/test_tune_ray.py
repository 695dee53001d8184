"""The same search on a Ray cluster: trials that are lost go on, and so does the whole."""

import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

import pytest
import yaml

pytest.importorskip("ray.tune", reason="needs Ray Tune, the extra ray")

from agents.settings import SettingsError, load_settings, save_settings
from agents.training.folder import RunInfo
from agents.training.run import train
from agents.tuning import cluster as tuning_cluster
from agents.tuning.cluster import search_on_ray
from agents.tuning.search import Search, load_search
from tests.agents.training import same_weights, tiny

# Ray leaves sockets and files to be closed by the collector.
pytestmark = [
    pytest.mark.train,
    pytest.mark.slow,
    pytest.mark.filterwarnings("default"),
]

real_train = tuning_cluster._train


def search_in(folder: Path, **changes: Any) -> Search:
    save_settings(tiny(), folder / "base.yaml")
    content = {
        "name": "search",
        "config": str(folder / "base.yaml"),
        "settings": {"timesteps": 192, "validate_every": 48},
        "space": {
            "learner.learning_rate": {"low": 1e-4, "high": 1e-1, "log": True},
            "learner.hidden": {"choices": [[8], [8, 8]]},
        },
        "trials": 4,
        "startup_trials": 2,
    }
    file = folder / "search.yaml"
    file.write_text(yaml.safe_dump(content | changes), encoding="utf-8")
    return load_search(str(file))


def killed_once(config: dict[str, Any], search: Search, output: Path, cpus: int) -> None:
    """Train, but let the process be killed after the first checkpoint of the search."""
    flag = output / "killed"

    def kill() -> None:
        while not list(output.glob("trial-*/resume.zip")):
            time.sleep(0.01)
        flag.touch()
        os.kill(os.getpid(), signal.SIGKILL)

    if not flag.exists():
        threading.Thread(target=kill, daemon=True).start()
    real_train(config, search, output, cpus)


def test_trials_run_on_a_cluster_and_are_kept(cluster: Any, tmp_path: Path) -> None:
    search, folder = search_in(tmp_path), tmp_path / "out"
    found = search_on_ray(search, folder, cluster.address)
    assert found
    for trial in found:
        run = RunInfo.read(trial.folder)
        assert run is not None
        assert run.finished
        assert run.validation is not None
        assert run.validation["score"] == trial.value
        settings = load_settings(trial.folder / "settings.yaml")
        assert settings.learner.learning_rate == trial.drawn["learner.learning_rate"]
        assert str(list(settings.learner.hidden)) == trial.drawn["learner.hidden"]
    assert len(list(folder.glob("trial-*"))) == 4
    again = search_on_ray(search, folder, cluster.address)
    assert {trial.folder for trial in again} == {trial.folder for trial in found}
    assert len(list(folder.glob("trial-*"))) == 4


def test_a_lost_trial_goes_on_from_its_own_checkpoint(
    cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tuning_cluster, "_train", killed_once)
    settings = {"timesteps": 3000, "validate_every": 1000, "checkpoint_every": 200}
    search = search_in(tmp_path, trials=1, settings=settings)
    (trial,) = search_on_ray(search, tmp_path / "out", cluster.address)
    run = RunInfo.read(trial.folder)
    assert run is not None
    assert run.finished
    assert run.resumed_at
    whole = train(load_settings(trial.folder / "settings.yaml"), tmp_path / "whole")
    assert same_weights(whole, trial.folder / "policy.safetensors")


def test_another_search_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class BegunError(Exception):
        pass

    def begin(**_: Any) -> None:
        raise BegunError

    monkeypatch.setattr("ray.init", begin)
    with pytest.raises(BegunError):
        search_on_ray(search_in(tmp_path), tmp_path / "out")
    with pytest.raises(SettingsError, match=r"another search, whose trials is 4 where this one's"):
        search_on_ray(search_in(tmp_path, trials=5), tmp_path / "out")
