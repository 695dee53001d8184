"""A notice to whoever waits while kernels are compiled, which happens only at their first use."""

import logging
import multiprocessing
import time
from collections.abc import Callable
from typing import Any, cast

from numba.core import event

# Numba's own modules know no types.
_register = cast("Any", event).register

PATIENCE = 1.0  # [s] what takes less goes without saying

_log = logging.getLogger("magfold_env")


class FirstUse(event.Listener):
    """Says once a process that kernels are being compiled; worker processes keep quiet.

    Unless told otherwise, logging prints it on standard error.

    Parameters
    ----------
    compiled
        Called whenever a kernel that was not in the cache has been compiled.
    """

    def __init__(self, compiled: Callable[[], None]) -> None:
        self._compiled = compiled
        self._depth = 0
        self._begun = 0.0
        self._said = multiprocessing.parent_process() is not None

    def on_start(self, event: Any) -> None:
        """Note a function of this package that is begun, and those compiled within."""
        if self._depth > 0:
            self._depth += 1
            if not self._said and time.monotonic() - self._begun > PATIENCE:
                self._said = True
                _log.warning(
                    "compiling the engine for its first use, which takes up to a minute; "
                    "later uses load it from the disk"
                )
        elif event.data["dispatcher"].py_func.__module__.startswith("magfold_env."):
            self._depth = 1
            self._begun = time.monotonic()

    def on_end(self, event: Any) -> None:
        """Note that one has ended, whether or not it could be compiled."""
        if self._depth > 0:
            self._depth -= 1
            if self._depth == 0:
                self._compiled()


def check() -> None:
    """Raise an error unless numba tells of what it compiles."""
    FirstUse(lambda: None)


def listen(compiled: Callable[[], None]) -> None:
    """Have numba tell of what it compiles from now on; see `FirstUse`."""
    _register("numba:compile", FirstUse(compiled))
