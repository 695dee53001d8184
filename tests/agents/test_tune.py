"""Tests of the tuning search: it resumes, prunes poor trials, and writes usable settings."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import yaml

pytest.importorskip("optuna", reason="needs Optuna, the extra tune")
import optuna
from optuna.trial import TrialState

from agents.settings import SettingsError, load_settings, save_settings
from agents.training import run
from agents.training.folder import RunInfo
from agents.training.run import DivergedError, train
from agents.tune import folder_of, load_search, search_here
from magfold_env.files import configs_dir
from tests.agents.training import call, same_weights, tiny
from tests.command_line import fails_in_one_line

pytestmark = pytest.mark.train

SPACE: dict[str, Any] = {
    "learner.learning_rate": {"low": 1e-4, "high": 1e-1, "log": True},
    "learner.n_epochs": {"low": 1, "high": 3},
    "learner.hidden": {"choices": [[8], [8, 8]]},
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Return the file of a search whose trials take a second."""
    save_settings(tiny(), tmp_path / "base.yaml")
    search = {
        "name": "search", "config": str(tmp_path / "base.yaml"),
        "settings": {"timesteps": 96, "validate_every": 48}, "space": SPACE, "trials": 2,
    }  # fmt: skip
    return written(tmp_path / "search.yaml", search)


def written(path: Path, content: dict[str, Any]) -> Path:
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def changed(file: Path, **changes: Any) -> str:
    """Return a file like `file` with other keys."""
    content = yaml.safe_load(file.read_text(encoding="utf-8")) | changes
    return str(written(file.with_name("changed.yaml"), content))


def study_in(folder: Path) -> optuna.Study:
    return optuna.load_study(study_name="search", storage=f"sqlite:///{folder / 'study.db'}")


@pytest.mark.medium
def test_the_same_command_goes_on_and_the_best_settings_train_the_same_policy_again(file, tmp_path):
    folder = tmp_path / "out"
    given = "tune", file, "--output", folder
    call(*given, code=0)
    first = study_in(folder).trials
    call(*given, code=0)
    assert study_in(folder).trials == first
    result = call(*given, "--trials", 3, code=0)
    trials = study_in(folder).trials
    assert trials[:2] == first
    assert len(trials) == 3
    for trial in trials:
        run: Any = RunInfo.read(folder / f"trial-{trial.number:04d}")
        assert run.validation["score"] == trial.value
        assert f"trial-{trial.number:04d}" in result.output
    best = study_in(folder).best_trial
    settings = load_settings(folder / "best.yaml")
    assert settings.learner.learning_rate == best.params["learner.learning_rate"]
    assert str(list(settings.learner.hidden)) == best.params["learner.hidden"]
    policy = train(settings, tmp_path / "again")
    assert same_weights(policy, folder / f"trial-{best.number:04d}" / "policy.safetensors")
    more = load_search(str(file), ["learner.gamma=0.5"])
    with pytest.raises(SettingsError, match=r"whose training\.learner\.gamma is 1\.0 where this"):
        search_here(more, folder)


class Scripted:
    """A substitute for training runs, in which trial k has the scores of row k."""

    def __init__(self, scores: list[list[float]]) -> None:
        self._rows = iter(scores)
        self.validated: list[int] = []

    def __call__(self, settings: Any, folder: Path, watch: Any) -> None:
        folder.mkdir()
        self.validated.append(0)
        info = RunInfo("run", "ppo", 0, {})
        for number, score in enumerate(next(self._rows), start=1):
            self.validated[-1] += 1
            info.validation = {"success_rate": 0.0, "score": score}
            watch(number, info.validation)
        info.write(folder)


@pytest.mark.medium
@pytest.mark.parametrize("pruner", ["median", "hyperband"])
def test_runs_that_do_badly_are_broken_off(pruner, file, tmp_path, monkeypatch):
    good, bad = [0.5, 0.6, 0.7, 0.8, 0.9, 0.9], [0.4, 0.3, 0.2, 0.1, 0.1, 0.1]
    runs = Scripted([good] * 5 + [bad])
    monkeypatch.setattr(run, "train", runs)
    settings = {"timesteps": 288, "validate_every": 48}
    given = {"settings": settings, "trials": 6, "startup_trials": 5, "pruner": pruner}
    *found, last = search_here(load_search(changed(file, **given)), tmp_path / "out").trials
    assert last.state is TrialState.PRUNED
    assert runs.validated[-1] == 2
    assert all(trial.value == 0.9 for trial in found)


@pytest.mark.medium
def test_an_interrupted_trial_is_taken_up_in_its_folder(file, tmp_path, monkeypatch):
    def interrupt(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    search, folder = load_search(str(file)), tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(run, "train", interrupt)
        with pytest.raises(KeyboardInterrupt):
            search_here(search, folder)
    first, second, third = search_here(search, folder).trials
    assert first.state is TrialState.FAIL
    assert second.params == first.params
    folders = [folder_of(trial, folder).name for trial in (second, third)]
    assert folders == ["trial-0000", "trial-0002"]


def started(file: str, folder: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "agents.tune", file, "--output", str(folder)]
    return subprocess.Popen(command, start_new_session=True, stderr=subprocess.PIPE, text=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sent", "code", "said"),
    [(signal.SIGKILL, -signal.SIGKILL, ""), (signal.SIGINT, 130, "interrupted")],
)
def test_a_trial_that_was_broken_off_goes_on_at_its_checkpoint(
    sent: signal.Signals, code: int, said: str, file: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    settings = {"timesteps": 6_000, "validate_every": 3_000, "checkpoint_every": 200}
    long, folder = changed(file, settings=settings, trials=1), tmp_path / "out"
    process = started(long, folder)
    while not (folder / "trial-0000" / "resume.zip").exists():
        assert process.poll() is None
        time.sleep(0.02)
    os.killpg(process.pid, sent)
    _, told = process.communicate()
    assert process.returncode == code, "the search was over before it was broken off"
    assert "Traceback" not in told
    assert told.strip().endswith(said)
    monkeypatch.setattr("agents.tune.HEARTBEAT", 1)
    time.sleep(4.0)  # the database counts whole seconds
    search_here(load_search(long), folder)
    own = folder / "trial-0000"
    run: Any = RunInfo.read(own)
    assert run.resumed_at
    whole = train(load_settings(own / "settings.yaml"), tmp_path / "whole")
    assert same_weights(whole, own / "policy.safetensors")


@pytest.mark.slow
def test_processes_share_a_study(file: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    many = changed(file, trials=6)
    processes = [started(many, folder) for _ in range(2)]
    for process in processes:
        process.communicate()
    assert [process.returncode for process in processes] == [0, 0]
    trials = study_in(folder).trials
    # One may be under way when the other makes the last.
    assert len(trials) in (6, 7)
    assert all(trial.state is TrialState.COMPLETE for trial in trials)
    assert len({str(trial.params) for trial in trials}) == len(trials)
    assert load_settings(folder / "best.yaml")


def test_numbers_that_break_down_are_told_and_break_a_run_off(tmp_path, file, monkeypatch):
    settings = tiny(learner={**tiny().learner.model_dump(), "learning_rate": 1e30})
    with pytest.raises(DivergedError, match=r"smaller learner\.learning_rate"):
        train(settings, tmp_path)

    def diverge(*_: Any, **__: Any) -> None:
        raise DivergedError("not finite")

    monkeypatch.setattr(run, "train", diverge)
    found = search_here(load_search(str(file)), tmp_path / "out").trials
    assert [trial.state for trial in found] == [TrialState.PRUNED] * 2


@pytest.mark.parametrize(("changes", "message"), [
    ({"trial": 5}, "trial: 5 is not allowed; unknown key, must be one of name, config"),
    ({"space": {}}, r"space: \{\} is not allowed"),
    ({"space": {"learner.gamma": {"low": 0.5, "high": 2.0}}}, r"learner\.gamma: 2.0 is not"),
    ({"space": {"envs": {"low": 3, "high": 2}}}, r"space\.envs\.high: 2 is not .*greater than"),
    ({"space": {"envs": {"low": 0, "high": 2, "log": True}}}, r"space\.envs\.low: 0 is not"),
    ({"space": {"envs": {"low": 1, "top": 2}}}, r"space\.envs\.top: 2 is not .*unknown key"),
    ({"space": {"envs": {"low": 1}}}, r"space\.envs\.low, high: None .* given, or choices"),
    ({"space": {"env.scene": {"choices": ["no", "where"]}}}, r"changed\.yaml: env: .*no"),
    ({"settings": {"env.speeds": 1}}, r"changed\.yaml: tiny: env\.speeds: 1 is not allowed"),
    ({"config": "tqc-tub-feed"}, "no such file; .* in configs/agents; did you mean tqc-tube-feed"),
])  # fmt: skip
def test_wrong_searches_name_key_value_and_remedy(changes, message, file):
    with pytest.raises(SettingsError, match=message):
        load_search(changed(file, **changes))


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--minutes", "nan", "minutes: nan is not allowed; must be greater than 0"),
        ("--minutes", "-1", "minutes: -1.0 is not allowed; must be greater than 0"),
        ("--storage", "sqlite:////no/such", "storage: 'sqlite:////no/such' is not allowed; must"),
        ("--storage", "study.db", "storage: 'study.db' is not allowed; must be the SQLAlchemy ad"),
        ("--storage", "oracle+none://x/y", "storage: 'oracle+none://x/y' is not allowed; must be"),
    ],
)
def test_wrong_options_are_told_in_one_line(
    option: str, value: str, message: str, file: Path, tmp_path: Path
) -> None:
    fails_in_one_line(call("tune", file, "--output", tmp_path / "out", option, value), message)


def test_shipped_searches_are_valid_and_a_wrong_one_ends_the_command(file: Path) -> None:
    for path in (configs_dir() / "tuning").glob("*.yaml"):
        load_search(path.stem)
    result = call("tune", changed(file, trials=-1), code=2)
    assert "trials: -1 is not allowed" in result.output
