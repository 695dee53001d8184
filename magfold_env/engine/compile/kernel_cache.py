"""Where compiled kernels are kept on disk, and for how long."""

from __future__ import annotations

import hashlib
import os
import shutil
import time
from contextlib import suppress
from pathlib import Path

import platformdirs

# They hand arrays to kernels; no kernel sees anything of them.
WITHOUT_KERNELS = {
    "energies.py",
    "first_use.py",
    "frames.py",
    "kernel_cache.py",
    "pack.py",
    "pack_field.py",
    "quadrature.py",
    "session.py",
    "workspace.py",
}
KEPT = 30.0 * 24.0 * 3600.0  # [s] kernels of other versions are removed when not used for so long


def source_fingerprint() -> str:
    """Hash of the engine's sources.

    Numba's on-disk cache notices edits in a kernel's own file but not in the files of the kernels
    it calls, so the cache directory is named after all of them.
    """
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parents[1].rglob("*.py")):
        if path.name not in WITHOUT_KERNELS:
            digest.update(path.name.encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_directory() -> Path:
    """Directory for compiled kernels; ``NUMBA_CACHE_DIR`` moves its root."""
    root = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("magfold_env")
    return Path(root) / f"kernels-{source_fingerprint()}"


def mark_used(directory: Path) -> None:
    """Note on the directory, if it is there, that it is in use."""
    with suppress(OSError):
        os.utime(directory)


def remove_unused(directory: Path) -> None:
    """Remove the directories beside this one that no process has begun to use within `KEPT`.

    A process that still uses one after such a time only finds less to load.
    """
    for other in directory.parent.glob("kernels-" + "[0-9a-f]" * 16):
        with suppress(OSError):
            if other != directory and time.time() - other.stat().st_mtime > KEPT:
                shutil.rmtree(other, ignore_errors=True)
