"""The one place that decides how kernels are compiled and where the results are cached.

No fast-math flag is set: with them a kernel's last bits depend on where it was inlined, and so on
what else a process has compiled. Loops that must vectorise add into arrays, lane by lane, which
strict arithmetic allows. With ``error_model="numpy"`` a division is no branch. Serial kernels
allocate nothing and are compiled without a runtime for memory, which makes an allocation an error
and lets arrays be passed on without counting references.
"""

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

import numba

from magfold_env.engine.compile import insides
from magfold_env.engine.compile.kernel_cache import cache_directory, remove_unused

numba_config = insides.numba_config
# Type checkers do not see some options.
njit = cast("Any", numba.njit)

P = ParamSpec("P")
R = TypeVar("R")

_deferred = insides.load("deferred", "so that kernels compile two to three times as long")
_kernel_cache = insides.load(
    "kernel_cache", "so that damaged files of compiled kernels are errors, and must be removed"
)
_first_use = insides.load("first_use", "so that nothing is said while kernels are compiled")
KERNELS: list[Any] = []
"""All kernels of the modules that are loaded."""

FIRST_USE: Any = _first_use and _first_use.listen(remove_unused, KERNELS)
"""Hears of what is compiled; None where numba does not tell."""


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
    if numba_config.DISABLE_JIT:  # for a debugger
        return function
    flags = {**options, "parallel": parallel, "no_cfunc_wrapper": True}
    if _kernel_cache is not None:
        compiled = njit(**flags)(function)
        _kernel_cache.keep(compiled, linked=parallel or _deferred is None)
    else:
        compiled = _kept_by_numba(function, flags)
    if not parallel and _deferred is not None:
        _deferred.defer(compiled, **options)
    KERNELS.append(compiled)
    return compiled


def _kept_by_numba(function: Callable[P, R], flags: dict[str, Any]) -> Any:
    """Compile with numba's own cache, in the directory that is ours."""
    directory = cache_directory(function.__code__.co_filename)
    if directory is None:
        return njit(**flags)(function)
    # The setting is read when the decorator runs; it is put back so that other users of numba
    # in the same process keep their own.
    previous, numba_config.CACHE_DIR = numba_config.CACHE_DIR, str(directory)
    try:
        return njit(cache=True, **flags)(function)
    finally:
        numba_config.CACHE_DIR = previous


def is_kernel(value: Any) -> bool:
    """Return whether a value is a compiled function, rather than a Python one."""
    return hasattr(value, "py_func") and hasattr(value, "overloads")
