"""With what a result was made: code, packages, machine, files."""

import hashlib
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

from agents.training.info import versions
from magfold_env.envs.tasks.draws import EVALUATION_VERSION
from magfold_env.files import physics_digest
from magfold_env.reporting import machine

PACKAGES = ("pygad", "scipy")
"""Besides those that training depends on."""


def provenance() -> dict[str, Any]:
    """Return commit, versions, machine and command as values that JSON can hold."""
    return {
        "command": sys.argv,
        "physics": physics_digest(),
        "evaluation draws": EVALUATION_VERSION,
        **machine.describe(),
        **versions(),
        **{name: version(name) for name in PACKAGES},
    }


def file_digest(policy: str) -> str | None:
    """Return the SHA-256 of a policy's file; None for a policy that has none."""
    path = Path(policy)
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None
