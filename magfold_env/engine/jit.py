"""The one place that decides how kernels are compiled and where the results are cached.

No fast-math flag is set: with them a kernel's last bits depend on where it was inlined, and so on
what else a process has compiled. Loops that must vectorise add into arrays, lane by lane, which
strict arithmetic allows. With ``error_model="numpy"`` a division is no branch. Serial kernels
allocate nothing and are compiled without a runtime for memory, which makes an allocation an error
and lets tuples of arrays be passed on without counting references.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba
import platformdirs
from numba.core import config

from magfold_env.engine.drafts import hand_drafts

# Numba fills its settings in at run time, unseen by type checkers.
numba_config = cast("Any", config)

# They hand arrays to kernels; no kernel sees anything of them.
WITHOUT_KERNELS = {
    "energies.py",
    "frames.py",
    "pack.py",
    "pack_field.py",
    "quadrature.py",
    "session.py",
    "workspace.py",
}

P = ParamSpec("P")
R = TypeVar("R")


def source_fingerprint() -> str:
    """Hash of the engine's sources.

    Numba's on-disk cache notices edits in a kernel's own file but not in the files of the kernels
    it calls, so the cache directory is named after all of them.
    """
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        if path.name not in WITHOUT_KERNELS:
            digest.update(path.name.encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_directory() -> Path:
    """Directory for compiled kernels; ``NUMBA_CACHE_DIR`` moves its root."""
    root = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("magfold_env")
    return Path(root) / f"kernels-{source_fingerprint()}"


_CACHE_DIRECTORY = str(cache_directory())


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a serial kernel with the engine's flags."""
    return _compile(function, parallel=False)


def allocating_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a serial kernel that may allocate: preparations and searches, not time steps."""
    return _compile(function, parallel=False, allocates=True)


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a small kernel that every caller should inline."""
    return _compile(function, parallel=False, forceinline=True)


def merged(function: Callable[P, R]) -> Callable[P, R]:
    """Make a kernel part of its caller, for kernels that are called at one place.

    Every kernel is optimised again within each of its callers, so fewer kernels on the way compile
    the innermost loops fewer times.
    """
    return _compile(function, parallel=False, inline="always")


def parallel_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a kernel whose ``numba.prange`` loops run on all threads."""
    return _compile(function, parallel=True)


def _compile(
    function: Callable[P, R],
    *,
    parallel: bool,
    forceinline: bool = False,
    inline: str = "never",
    allocates: bool = False,
) -> Any:
    # The setting is read when the decorator runs; it is put back so that other users of numba
    # in the same process keep their own.
    previous = numba_config.CACHE_DIR
    numba_config.CACHE_DIR = _CACHE_DIRECTORY
    options = {
        "error_model": "numpy",
        "parallel": parallel,
        "forceinline": forceinline,
        "inline": inline,
        "nogil": True,
        "_nrt": parallel or allocates,
    }
    try:
        # One of the options is not in the signature that type checkers see.
        compiled = cast("Any", numba.njit)(cache=True, no_cfunc_wrapper=True, **options)(function)
    finally:
        numba_config.CACHE_DIR = previous
    if not parallel:
        hand_drafts(compiled, **options)
    return compiled
