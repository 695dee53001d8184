"""The one place that decides how kernels are compiled and where the results are cached.

No fast-math flag is set: with them a kernel's last bits depend on where it was inlined, and so on
what else a process has compiled. Loops that must vectorise add into arrays, lane by lane, which
strict arithmetic allows. With ``error_model="numpy"`` a division is no branch. Serial kernels
allocate nothing and are compiled without a runtime for memory, which makes an allocation an error
and lets arrays be passed on without counting references.
"""

import warnings
from collections.abc import Callable
from importlib import import_module
from typing import Any, ParamSpec, TypeVar, cast

import numba

from magfold_env.engine.compile import kernel_cache
from magfold_env.engine.compile.compile_notice import CompileNotice

# Type checkers see neither the settings, which numba fills in at run time, nor some options.
numba_config = cast("Any", numba).config
njit = cast("Any", numba.njit)

P = ParamSpec("P")
R = TypeVar("R")

KERNELS: list[Any] = []
"""All kernels of the modules that are loaded."""


def _load_private() -> tuple[Any, Any]:
    """Return the module of numba's private parts, and who hears of what is compiled.

    Both are None under ``NUMBA_DISABLE_JIT``, for a debugger, and, with a warning, if numba differs
    from what that module knows, which is checked once for each version. Kernels then do the same to
    the last bit.
    """
    if numba_config.DISABLE_JIT:
        return None, None
    try:
        listener = CompileNotice(kernel_cache.remove_unused, KERNELS)
        numba.core.event.register("numba:compile", listener)  # pyright: ignore
        private = import_module(f"{__package__}.numba_private")
        directory = kernel_cache.cache_directory()
        if directory is None or not (directory / "checked").is_file():
            private.check()
            if directory is not None:
                kernel_cache.write(directory / "checked", b"")
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
    """Compile a serial kernel that may allocate: preparations and searches, not time steps."""
    return _compile(function, _nrt=True)


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a small kernel that every caller should inline."""
    return _compile(function, forceinline=True)


def parallel_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a kernel whose ``numba.prange`` loops run on all threads."""
    return _compile(function, _nrt=True, parallel=True)


def _compile(function: Callable[P, R], *, parallel: bool = False, **given: bool) -> Any:
    if numba_config.DISABLE_JIT:
        return function
    # Flags that are not set are those of the kernel that calls this one.
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
    """Compile with numba's own cache, in a directory for the present sources of this package."""
    directory = kernel_cache.cache_directory(kernel_cache.PACKAGE)
    if directory is None:
        return njit(**flags)(function)
    # The setting is read when the decorator runs; it is put back so that other users of numba
    # in the same process keep their own.
    previous, numba_config.CACHE_DIR = numba_config.CACHE_DIR, str(directory)
    try:
        return njit(cache=True, **flags)(function)
    finally:
        numba_config.CACHE_DIR = previous
