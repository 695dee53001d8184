"""The folder for browsers, built once for every version of the sources, and what runs it."""

import json
import os
import shutil
import subprocess
import tempfile
import time
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock

from magfold_env.browser import build, wasm
from magfold_env.engine.compile import by_pointer
from magfold_env.engine.compile.kernel_cache import cache_root
from magfold_env.files import sources_digest

KEPT = 7.0 * 24.0 * 3600.0  # [s] a folder is removed when not used for so long
ROOMS = ("browser", "engine", "scene", "simulation")
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
    """Return a folder that was built of these sources; skips the test where it cannot be."""
    if MISSING:
        pytest.skip(MISSING)
    root = cache_root() or Path(tempfile.gettempdir())
    digest = sources_digest(*(f"{name}/**/*.py" for name in ROOMS), "*.py")
    found = root / f"browser-{digest}"
    with FileLock(root / "browser.lock"):
        if not found.is_dir():
            made = found.with_suffix(f".{os.getpid()}")
            build.build(made)
            made.rename(found)
        found.touch()
        # Other checkouts use others.
        for other in root.glob("browser-" + "[0-9a-f]" * 16):
            if time.time() - other.stat().st_mtime > KEPT:
                shutil.rmtree(other, ignore_errors=True)
        # Scripts need no compiler.
        for name, content in build.scripts().items():
            if found.joinpath(name).read_bytes() != content:
                found.joinpath(name).write_bytes(content)
    return found


def run(job: dict[str, Any], timeout: float = 600.0) -> Any:
    """Return what a script says of a job, both as JSON."""
    if NO_NODE:
        pytest.skip(NO_NODE)
    done = subprocess.run(
        ["node", str(SCRIPT), str(folder())],
        input=json.dumps(job),
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
