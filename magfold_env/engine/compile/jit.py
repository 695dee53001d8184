"""The one place that decides how kernels are compiled and where the results are cached.

No fast-math flag is set: with them a kernel's last bits depend on where it was inlined, and so on
what else a process has compiled. Loops that must vectorise add into arrays, lane by lane, which
strict arithmetic allows. With ``error_model="numpy"`` a division is no branch. Serial kernels
allocate nothing and are compiled without a runtime for memory, which makes an allocation an error
and lets arrays be passed on without counting references.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, ParamSpec, TypeVar, cast

import numba
from numba.core import config, event

from magfold_env.engine.compile.deferred import hand_drafts
from magfold_env.engine.compile.first_use import FirstUse
from magfold_env.engine.compile.kernel_cache import cache_directory, mark_used, remove_unused

# Type checkers see neither the settings, which numba fills in at run time, nor some options.
numba_config, njit, events = (cast("Any", each) for each in (config, numba.njit, event))

P = ParamSpec("P")
R = TypeVar("R")

_CACHE_DIRECTORY = cache_directory()
mark_used(_CACHE_DIRECTORY)
events.register("numba:compile", FirstUse(partial(remove_unused, _CACHE_DIRECTORY)))


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a serial kernel with the engine's flags."""
    return _compile(function, parallel=False)


def allocating_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a serial kernel that may allocate: preparations and searches, not time steps."""
    return _compile(function, parallel=False, allocates=True)


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a small kernel that every caller should inline."""
    return _compile(function, parallel=False, forceinline=True)


def parallel_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a kernel whose ``numba.prange`` loops run on all threads."""
    return _compile(function, parallel=True)


def _compile(
    function: Callable[P, R], *, parallel: bool, forceinline: bool = False, allocates: bool = False
) -> Any:
    options = {
        "error_model": "numpy",
        "forceinline": forceinline,
        "nogil": True,
        "_nrt": parallel or allocates,
    }
    # The setting is read when the decorator runs; it is put back so that other users of numba
    # in the same process keep their own.
    previous = numba_config.CACHE_DIR
    numba_config.CACHE_DIR = str(_CACHE_DIRECTORY)
    try:
        compiled = njit(cache=True, parallel=parallel, no_cfunc_wrapper=True, **options)(function)
    finally:
        numba_config.CACHE_DIR = previous
    # With NUMBA_DISABLE_JIT=1, for a debugger, `compiled` is the function itself.
    if not parallel and not numba_config.DISABLE_JIT:
        hand_drafts(compiled, **options)
    return compiled
