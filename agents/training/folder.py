"""The folder of a training run: its files, records and logs."""

import hashlib
import json
import os
import platform
import shlex
import sys
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, Self

from agents.settings import SettingsError, TrainSettings, load_settings, save_settings
from magfold_env.checkpoint import difference
from magfold_env.envs.tasks.draws import EVALUATION_VERSION
from magfold_env.files import physics_digest, write_text
from magfold_env.reporting import machine

PACKAGES = (
    "magfold_env",
    "gymnasium",
    "numba",
    "numpy",
    "sb3-contrib",
    "stable-baselines3",
    "torch",
)
FILE = "run.json"
EVENTS = "events.out.tfevents.*"
_LENGTHS = {"timesteps", "minutes"}
"""Settings that limit the length of a run."""
_REMEDY = "give another --output, or --fresh to remove it"


@dataclass
class RunInfo:
    """The contents of ``run.json``."""

    name: str
    """Name in the settings, which are stored beside this file and also contain the algorithm."""
    algorithm: str
    seed: int
    """Seed of the run."""
    made: dict[str, str]
    """Commit of the sources, versions, machine and starting time."""
    steps: int = 0
    """Number of environment steps taken."""
    seconds: float = 0.0
    """Training time [s]."""
    resumed_at: list[int] = field(default_factory=list)
    """Steps of the checkpoints from which the run was resumed."""
    validation: dict[str, float] | None = None
    """Result of the last validation."""
    start: str | None = None
    """SHA-256 of the initial policy; None if the initial weights were random."""
    finished: bool = False
    """Whether the training has finished."""

    @classmethod
    def begin(cls, name: str, algorithm: str, seed: int) -> Self:
        """Return the record of a run that begins."""
        return cls(name, algorithm, seed, machine.describe() | versions())

    @classmethod
    def read(cls, folder: Path) -> Self | None:
        """Return the record in `folder`, or None if there is no readable one."""
        try:
            return cls(**json.loads((folder / FILE).read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError):
            return None

    def write(self, folder: Path) -> None:
        """Write the record to `folder`."""
        write_text(folder / FILE, json.dumps(asdict(self), indent=1) + "\n")


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages on which a run depends."""
    return {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}


def provenance() -> dict[str, Any]:
    """Return commit, versions, machine and command as JSON values."""
    spec = sys.modules["__main__"].__spec__
    module = ["-m", spec.name.removesuffix(".__main__")] if spec else []
    return {
        "command": shlex.join(["python", *module, *sys.argv[1:]]),
        "physics": physics_digest(),
        "evaluation draws": EVALUATION_VERSION,
        **machine.describe(),
        **versions(),
        "scipy": version("scipy"),
    }


def file_digest(policy: str) -> str | None:
    """Return the SHA-256 of a policy's file, or None if the policy has no file."""
    path = Path(policy)
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None


class RunFolder:
    """A folder with the files of one run, created when the run begins."""

    def __init__(self, path: Path, settings: TrainSettings) -> None:
        self.path = path
        self.settings = settings
        self.policy = path / "policy.safetensors"
        self.best = path / "best.safetensors"
        self.state = path / "resume.zip"
        self.checkpoints = path / "checkpoints"
        self._settings_file = path / "settings.yaml"

    @property
    def key(self) -> dict[str, Any]:
        """Everything that must be unchanged when a run is resumed; only the length may change."""
        return {
            "settings": self.settings.model_dump(mode="json", exclude=_LENGTHS),
            "physics": physics_digest(),
            "versions": versions(),
        }

    def open(self, resume: bool | None) -> bool:
        """Return whether training remains; prepare the folder if the run is new.

        If the run is resumed, a checkpoint is at `state`. If `resume` is True, the run must exist;
        if the settings ask for more steps or minutes, it is lengthened, even if finished. False
        removes an earlier run's files. None resumes a run with equal settings and refuses others.

        Raises
        ------
        SettingsError
            If the folder contains another run, or no run to resume.
        """
        for partial in (*self.path.glob(".*.zip"), *self.path.glob(".*.safetensors")):
            # The remains of an interrupted write.
            partial.unlink()
        if resume is not False and self._settings_file.is_file():
            longer = self._compare(bool(resume))
            info = RunInfo.read(self.path)
            if not longer and info is not None and info.finished and self.policy.is_file():
                return False
            if self.state.is_file():
                if longer and info is not None:
                    info.finished = False
                    info.write(self.path)
                if longer:
                    save_settings(self.settings, self._settings_file)
                return True
        if resume:
            raise SettingsError(f"{self.path}: there is no checkpoint to resume from")
        earlier = [self.policy, self.best, self.state, self.path / FILE]
        for file in (*earlier, *self.path.glob(EVENTS), *self.checkpoints.glob("policy-*")):
            file.unlink(missing_ok=True)
        self.checkpoints.mkdir(parents=True, exist_ok=True)
        save_settings(self.settings, self._settings_file)
        return True

    def _compare(self, may_be_longer: bool) -> bool:
        """Return whether the settings lengthen the folder's run; refuse other settings."""
        try:
            there = load_settings(self._settings_file)
        except SettingsError as error:
            raise SettingsError(f"{error}\n{self.path}: holds another run; {_REMEDY}") from None
        own = self.settings
        longer = may_be_longer and own.timesteps >= there.timesteps
        aside = _LENGTHS if longer else set[str]()
        old, new = (each.model_dump(mode="json", exclude=aside) for each in (there, own))
        if where := difference(old, new):
            raise SettingsError(f"{self.path}: holds another run, {where}; {_REMEDY}")
        return there != own


def event_sizes(folder: Path) -> dict[str, int]:
    """Return the size of each of TensorBoard's files in `folder` in bytes, by name.

    TensorBoard only appends records. A file's content at the time of a checkpoint is therefore the
    start of its present content, and later records, which will be written again, can be cut off.
    """
    return {path.name: path.stat().st_size for path in sorted(folder.glob(EVENTS))}


def cut_events(folder: Path, sizes: dict[str, int]) -> None:
    """Cut the event files in `folder` to `sizes`; remove files that have no size."""
    for path in folder.glob(EVENTS):
        if path.name not in sizes:
            path.unlink()
        elif path.stat().st_size > sizes[path.name]:
            os.truncate(path, sizes[path.name])
