"""The folder of a training run: what lies where, and whether a run may begin or go on in it."""

from enum import Enum
from pathlib import Path
from typing import Any

from agents.settings.run import SettingsError, TrainSettings, load_settings, save_settings
from agents.training.event_files import PATTERN
from agents.training.info import FILE, RunInfo, versions
from magfold_env.checkpoint import difference
from magfold_env.files import physics_digest


class Resume(Enum):
    """What to do with what an earlier run has left in the folder."""

    AUTO = "take up the same run if there is one; refuse another"
    ALWAYS = "take up the run, which must be there"
    NEVER = "remove it"


class Standing(Enum):
    """How far the run in a folder has come."""

    NEW = "to begin"
    BROKEN_OFF = "to be taken up again"
    FINISHED = "finished"


class RunFolder:
    """A folder with the files of one run.

    Parameters
    ----------
    path : Path
        Where; made when a run begins.
    settings : TrainSettings
        The run.
    """

    def __init__(self, path: Path, settings: TrainSettings) -> None:
        self.path = path
        self.settings = settings
        self.policy = path / "policy.zip"
        self.best = path / "best.zip"
        self.state = path / "resume.zip"
        self.checkpoints = path / "checkpoints"
        self._settings_file = path / "settings.yaml"

    @property
    def key(self) -> dict[str, Any]:
        """Everything that must be the same for a run to go on as it would have."""
        return {
            "settings": self.settings.model_dump(mode="json"),
            "physics": physics_digest(),
            "versions": versions(),
        }

    def open(self, resume: Resume) -> Standing:
        """Return how far the run has come; make the folder ready if it is to begin.

        Raises
        ------
        SettingsError
            If another run lies here, or none where one is to be taken up.
        """
        for half in self.path.glob(".*.zip"):
            # What a kill has left of a file that was being written.
            half.unlink()
        if resume is not Resume.NEVER and self._settings_file.is_file():
            self._refuse_other()
            info = RunInfo.read(self.path)
            if info is not None and info.finished and self.policy.is_file():
                return Standing.FINISHED
            if self.state.is_file():
                return Standing.BROKEN_OFF
        if resume is Resume.ALWAYS:
            raise SettingsError(f"{self.path}: there is no checkpoint to resume from")
        self._clear()
        self.checkpoints.mkdir(parents=True, exist_ok=True)
        save_settings(self.settings, self._settings_file)
        return Standing.NEW

    def _refuse_other(self) -> None:
        """Refuse a folder whose run has other settings."""
        try:
            there = load_settings(self._settings_file)
        except SettingsError as error:
            raise SettingsError(f"{error}\n{self.path}: holds another run; {_REMEDY}") from None
        here = self.settings.model_dump(mode="json")
        if where := difference(there.model_dump(mode="json"), here):
            raise SettingsError(f"{self.path}: holds another run, {where}; {_REMEDY}")

    def _clear(self) -> None:
        """Remove the files of an earlier run."""
        files = [self.policy, self.best, self.state, self.path / FILE]
        for file in (*files, *self.path.glob(PATTERN), *self.checkpoints.glob("policy-*.zip")):
            file.unlink(missing_ok=True)


_REMEDY = "give another --output, or --fresh to remove it"
