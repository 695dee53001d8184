"""What is noted beside every model: what it was made from, and with what."""

import json
import platform
import subprocess
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Self

from magfold_env.files import write_text

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
    git : dict or None
        The commit of the sources, and whether they differ from it; None outside a git tree.
    versions : dict
        Versions of Python and of the packages that matter.
    machine : str
        Operating system and processor.
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
    git: dict[str, str | bool] | None
    versions: dict[str, str]
    machine: str
    steps: int = 0
    seconds: float = 0.0
    resumed_at: list[int] = field(default_factory=list)
    validation: dict[str, float] | None = None
    wandb_id: str | None = None
    finished: bool = False

    @classmethod
    def begin(cls, name: str, algorithm: str, seed: int) -> Self:
        """Return what is to be noted at the beginning of a run."""
        machine = f"{platform.system()} {platform.machine()}"
        return cls(name, algorithm, seed, git_state(), versions(), machine)

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
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def git_state() -> dict[str, str | bool] | None:
    """Return the commit of the sources, and whether they were modified since.

    None if they do not lie in a git tree, or there is no git.
    """
    # An installed copy may lie in somebody else's tree.
    tracked = _git("ls-files", "--error-unmatch", str(Path(__file__).resolve()))
    commit = _git("rev-parse", "HEAD") if tracked is not None else None
    changes = _git("status", "--porcelain", "--untracked-files=no")
    if commit is None or changes is None:
        return None
    return {"commit": commit, "modified": bool(changes)}


def _git(*arguments: str) -> str | None:
    """Return what git says of the folder of the sources; None if it fails."""
    folder = Path(__file__).resolve().parent
    command = ["git", "-C", str(folder), *arguments]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return answer.stdout.strip()
