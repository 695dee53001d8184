"""Descriptions of the machine and the software that made a measurement."""

import os
import platform
import subprocess
from contextlib import suppress
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

LIBRARIES = ("numba", "llvmlite", "numpy", "gymnasium")
PEERS = ("casadi", "magpylib", "mujoco", "pin", "pymunk")


def describe() -> dict[str, str]:
    """Return processor, system, versions, commit and time of a measurement as text."""
    record = {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "system": platform.platform(),
        "python": platform.python_version(),
        "magfold_env": version("magfold_env"),
        "commit": _commit(),
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    record |= {name: version(name) for name in LIBRARIES}
    for name in PEERS:
        with suppress(PackageNotFoundError):
            record[name] = version(name)
    if hasattr(os, "getloadavg"):
        record["load before"] = f"{os.getloadavg()[0]:.2f}"
    return record


def _processor() -> str:
    """Return the processor's name, or its architecture if the system does not report the name."""
    table = Path("/proc/cpuinfo")
    if table.is_file():
        for line in table.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _commit() -> str:
    """Return the checkout's commit, with a mark if files have changed, or else 'unknown'."""
    try:
        head = _git("rev-parse", "HEAD")
        changed = _git("status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return f"{head} with changes" if changed else head


def _git(*arguments: str) -> str:
    folder = Path(__file__).resolve().parent
    command = ["git", "-C", str(folder), *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
