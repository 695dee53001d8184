"""Commands and tiny training runs for tests, and comparisons of their results."""

import itertools
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import torch
from tensorboard.backend.event_processing.event_file_loader import EventFileLoader
from typer.testing import CliRunner

from agents.settings import TrainSettings
from agents.training import policy_files
from agents.training.run import BoundaryCallback, train
from magfold_env.cli import options

_ON = {"n_steps": 24, "batch_size": 24, "n_epochs": 2}
_OFF = {"learning_starts": 64, "batch_size": 16, "train_freq": 4, "buffer_size": 150}
LEARNERS: dict[str, dict[str, Any]] = {
    "ppo": _ON, "maskable-ppo": _ON, "recurrent-ppo": {**_ON, "lstm": {"hidden": 8}},
    "sac": _OFF, "tqc": _OFF,
}  # fmt: skip
"""Hyper-parameters that make every learner quick."""


def tiny(
    algorithm: str = "ppo", hindsight: bool = False, own: Any = None, **changes: Any
) -> TrainSettings:
    """Return the settings of a run that takes a second; the learner also has its `own` settings."""
    learner = {"algorithm": algorithm, "hidden": [16], **LEARNERS[algorithm], **(own or {})}
    env: dict[str, Any] = {"fidelity": "quasistatic", "components": 3}
    if algorithm in ("sac", "tqc"):
        env["actions"] = "box"
    if algorithm == "maskable-ppo":
        env["catalogue"] = ["NSNS", "SSNN"]
    if hindsight:
        env["id"] = "MagFold/TubeFeedGoal-v0"
        learner["hindsight"] = {}
    run = {"name": "tiny", "env": env, "learner": learner, "timesteps": 300}
    run |= {"checkpoint_every": 48, "validate_every": 96, "validation_episodes": 4}
    return TrainSettings.model_validate(run | changes)


def call(module: str, *arguments: object, code: int | None = None) -> Any:
    """Return the result of a command of `agents` that must end with the given exit code, if any."""
    app = options.application_of(import_module(f"agents.{module}").main)
    result = CliRunner().invoke(app, list(map(str, arguments)))
    assert code in (None, result.exit_code), result.output
    return result


class KilledError(BaseException):
    """An error that nothing catches, so that it ends a run like a kill."""


def killed(settings: TrainSettings, folder: Path, after: int, resume: bool | None = None) -> None:
    """Train until the run's callback has made this many steps, and interrupt it there."""
    step, calls = BoundaryCallback.on_step, itertools.count(1)

    def stepping(self: BoundaryCallback) -> bool:
        if next(calls) > after:
            raise KilledError
        return step(self)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(BoundaryCallback, "on_step", stepping)
        with pytest.raises(KilledError):
            train(settings, folder, resume)


def weights(policy: Path) -> dict[str, torch.Tensor]:
    """Return the network weights of a saved policy."""
    return policy_files.load(policy).policy.state_dict()


def same_weights(one: Path, other: Path) -> bool:
    """Return whether two saved policies are equal, bit for bit."""
    first, second = weights(one), weights(other)
    assert first.keys() == second.keys()
    return all(torch.equal(first[name], second[name]) for name in first)


def records(folder: Path) -> dict[str, list[tuple[int, float]]]:
    """Return the steps and values of each series in TensorBoard's files, as they were written.

    Series that depend on running times are omitted.
    """
    series: dict[str, list[tuple[int, float]]] = {}
    for file in sorted(folder.glob("events.out.tfevents.*"), key=_age):
        for event in EventFileLoader(str(file)).Load():
            for value in event.summary.value:
                if not value.tag.startswith("time/"):
                    number = float(value.tensor.float_val[0])
                    series.setdefault(value.tag, []).append((event.step, number))
    return series


def _age(file: Path) -> tuple[int, int]:
    """Return the start time [s] of an event file, and its number within its process."""
    parts = file.name.split(".")
    return int(parts[3]), int(parts[-1])
