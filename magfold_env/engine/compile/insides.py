"""Parts of numba that it promises to nobody, and what happens where one is missing.

Modules of this package that use them are loaded here. Each has a function ``check`` that tries it
out on something small, once for every version of numba and of this package. If that fails, whoever
asked for the module goes without: kernels do the same to the last bit, but cost more.
"""

import sys
import warnings
from importlib import import_module
from typing import Any, cast

import numba

from magfold_env.engine.compile import first_use, kernel_cache

# Type checkers do not see the settings, which numba fills in at run time.
numba_config = cast("Any", numba).config


def load(name: str, without: str) -> Any:
    """Return a module of this package that uses numba's insides, or None with a warning.

    Under ``NUMBA_DISABLE_JIT``, for a debugger, nothing is compiled, and none is needed.

    Parameters
    ----------
    name
        Of the module.
    without
        What it means to go without it, for the warning.
    """
    if numba_config.DISABLE_JIT:
        return None
    directory = kernel_cache.cache_directory(__file__)
    version = f"numba-{numba.__version__}-py{sys.version_info[0]}{sys.version_info[1]}"
    passed = directory and directory / f"{name}-{version}.checked"
    try:
        module = import_module(f"{__package__}.{name}")
        if passed is None or not passed.is_file():
            with first_use.interruptible():
                module.check()
            if passed is not None:
                kernel_cache.write(passed, b"")
    except Exception as error:
        warnings.warn(
            f"numba {numba.__version__} differs from what magfold_env knows, {without} "
            f"({type(error).__name__}: {error})",
            RuntimeWarning,
            stacklevel=2,
        )
        return None
    return module
