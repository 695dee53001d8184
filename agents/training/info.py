"""What is noted beside every model: what it was made from, and with what."""

import json
import platform
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Self

from magfold_env.files import write_text
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


@dataclass
class RunInfo:
    """The contents of ``run.json``.

    Attributes
    ----------
    name, algorithm : str
        From the settings, which lie beside it in full.
    seed : int
        Seed of the run.
    made : dict
        Commit of the sources, versions, machine and time at the beginning.
    steps : int
        Environment steps made.
    seconds : float
        Time spent on them [s].
    resumed_at : list of int
        Steps of the checkpoints from which the run was taken up again.
    validation : dict or None
        Result of the last validation.
    wandb_id : str or None
        The run's name with Weights & Biases; None if it is not logged there.
    finished : bool
        Whether the training has come to its end.
    """

    name: str
    algorithm: str
    seed: int
    made: dict[str, str]
    steps: int = 0
    seconds: float = 0.0
    resumed_at: list[int] = field(default_factory=list)
    validation: dict[str, float] | None = None
    wandb_id: str | None = None
    finished: bool = False

    @classmethod
    def begin(cls, name: str, algorithm: str, seed: int) -> Self:
        """Return what is to be noted at the beginning of a run."""
        return cls(name, algorithm, seed, machine.describe() | versions())

    @classmethod
    def read(cls, folder: Path) -> Self | None:
        """Return what was noted in `folder`; None if nothing, or nothing that can be read."""
        try:
            return cls(**json.loads((folder / FILE).read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError):
            return None

    def write(self, folder: Path) -> None:
        """Write to `folder`."""
        write_text(folder / FILE, json.dumps(asdict(self), indent=1) + "\n")


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that a run depends on."""
    return {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}
