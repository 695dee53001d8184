"""The one place that decides how kernels are compiled and where the results are cached.

No fast-math flags are set: they would make a kernel's last bits depend on where it was inlined, and
thus on what else the process has compiled. Loops that must be vectorised sum into arrays with one
element per lane, which strict arithmetic permits. With ``error_model="numpy"``, a division needs no
branch. Serial kernels do not allocate, and are compiled without numba's memory runtime, so an
allocation is an error, and arrays are passed without reference counting.
"""

import warnings
from collections.abc import Callable
from importlib import import_module
from typing import Any, ParamSpec, TypeVar, cast

import numba
from numba.extending import register_jitable

from magfold_env.engine.compile import kernel_cache
from magfold_env.engine.compile.compile_notice import CompileNotice

# Type checkers do not see the settings, which numba fills in at run time, or some options.
numba_config = cast("Any", numba).config
njit = cast("Any", numba.njit)

P = ParamSpec("P")
R = TypeVar("R")

KERNELS: list[Any] = []
"""All kernels of the loaded modules."""


def _load_private() -> tuple[Any, Any]:
    """Return the module that uses numba's private parts, and the listener for compilations.

    Both are None under ``NUMBA_DISABLE_JIT``, for a debugger. They are also None, with a warning,
    if numba is not as that module expects, which is checked once per version. Kernels then still
    give the same results, bit for bit.
    """
    if numba_config.DISABLE_JIT:
        return None, None
    try:
        listener = CompileNotice(kernel_cache.remove_unused, KERNELS)
        numba.core.event.register("numba:compile", listener)  # pyright: ignore
        private = import_module(f"{__package__}.numba_private")
        own, shipped = kernel_cache.cache_directory(), kernel_cache.shipped_directory()
        if not any(each and (each / "checked").is_file() for each in (own, shipped)):
            private.check()
            if own is not None:
                kernel_cache.write(own / "checked", b"")
    except Exception as error:
        warnings.warn(
            f"numba {numba.__version__} differs from what magfold_env knows, so that kernels "
            f"compile about ten times as long ({type(error).__name__}: {error})",
            RuntimeWarning,
            stacklevel=2,
        )
        return None, None
    return private, listener


PRIVATE, FIRST_USE = _load_private()


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a serial kernel with the engine's flags."""
    return _compile(function)


def allocating_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a serial kernel that may allocate, for preparation and searches but not for steps."""
    return _compile(function, _nrt=True)


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a small kernel that every caller should inline."""
    return _compile(function, forceinline=True)


def interpreted(function: Callable[P, R]) -> Callable[P, R]:
    """Mark a rarely called function: Python runs it as it is; the laboratory page compiles it."""
    return function if numba_config.DISABLE_JIT else register_jitable(function)


def parallel_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a kernel whose ``numba.prange`` loops run on all threads."""
    return _compile(function, _nrt=True, parallel=True)


def _compile(function: Callable[P, R], *, parallel: bool = False, **given: bool) -> Any:
    if numba_config.DISABLE_JIT:
        return function
    # Flags that are not set are inherited from the calling kernel.
    defaults = {"error_model": "numpy", "forceinline": False, "nogil": True, "_nrt": False}
    options = {**defaults, **given}
    flags = {**options, "parallel": parallel, "no_cfunc_wrapper": True}
    if PRIVATE is None:
        compiled = _kept_by_numba(function, flags)
    else:
        compiled = njit(**flags)(function)
        PRIVATE.keep(compiled, linked=parallel)
        if not parallel:
            PRIVATE.defer(compiled, **options)
    KERNELS.append(compiled)
    return compiled


def _kept_by_numba(function: Callable[P, R], flags: dict[str, Any]) -> Any:
    """Compile with numba's own cache, in a directory for this package's present sources."""
    directory = kernel_cache.cache_directory(kernel_cache.PACKAGE)
    if directory is None:
        return njit(**flags)(function)
    # The decorator reads the setting when it runs; afterwards the setting is restored for other
    # users of numba in the same process.
    previous, numba_config.CACHE_DIR = numba_config.CACHE_DIR, str(directory)
    try:
        return njit(cache=True, **flags)(function)
    finally:
        numba_config.CACHE_DIR = previous
