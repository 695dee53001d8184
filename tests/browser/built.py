"""The folder for browsers, built once per version of the sources, and a way to run jobs in it."""

import json
import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from magfold_env.browser import build, wasm
from magfold_env.engine.compile import by_pointer

SCRIPT = Path(__file__).with_name("scenes.mjs")
MISSING = (
    "needs kernels that take tuples by pointer"
    if not by_pointer.POINTERS
    else wasm.NO_LINKER
    if wasm.linker() is None
    else ""
)
NO_NODE = "needs Node.js: no node is on the PATH" if shutil.which("node") is None else ""


@cache
def folder() -> Path:
    """Return a folder that was built from these sources; skip the test if it cannot be built."""
    if MISSING:
        pytest.skip(MISSING)
    return build.kept()


def run(job: dict[str, Any], timeout: float = 600.0) -> Any:
    """Return the result of a script for a job, both as JSON."""
    if NO_NODE:
        pytest.skip(NO_NODE)
    done = subprocess.run(
        ["node", str(SCRIPT), str(folder())], input=json.dumps(job), capture_output=True, text=True,
        timeout=timeout, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
