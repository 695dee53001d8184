"""A notice to whoever waits while kernels are compiled, which happens only at their first use.

Meanwhile Python does not look for cycles in memory: a compiler makes millions of objects, and would
spend a tenth of its time on that, to give back at most 300 MB.
"""

import gc
import logging
import multiprocessing
import time
from collections.abc import Callable, Sequence
from typing import Any, cast

from numba.core import event

# Numba's own modules know no types.
_register = cast("Any", event).register

PATIENCE = 1.0  # [s] what takes less goes without saying
NOTICE = "; later uses load it from the disk, and `magfold warmup` compiles all that there is"

_log = logging.getLogger("magfold_env")


class FirstUse(event.Listener):
    """Says that kernels are being compiled, and how long each took; worker processes keep quiet.

    Unless told otherwise, logging prints it on standard error.

    Parameters
    ----------
    compiled
        Called whenever a kernel that was not in the cache has been compiled.
    kernels
        All that there are by now, those that others call included.
    """

    def __init__(self, compiled: Callable[[], None], kernels: Sequence[Any] = ()) -> None:
        self._compiled = compiled
        self._kernels = kernels
        self._depth = 0
        self._seen: set[object] = set()
        self._name = ""
        self._begun = 0.0
        self._quiet = multiprocessing.parent_process() is not None
        self._said = self._told = False
        self._collecting = gc.isenabled()

    def on_start(self, event: Any) -> None:
        """Note a function of this package that is begun, and those compiled within."""
        function = event.data["dispatcher"].py_func
        # What was made by `exec` may belong to no module.
        ours = str(function.__module__).startswith("magfold_env.")
        if ours:  # a kernel that others call is compiled twice: on its own, and within them
            self._seen.add(function)
        if self._depth > 0:
            self._depth += 1
            if not self._said and time.monotonic() - self._begun > PATIENCE:
                self._said = True
                self._say(
                    "compiling %s for its first use, kernel %d of up to %d%s",
                    self._name,
                    len(self._seen),
                    len(self._kernels),
                    "" if self._told else NOTICE,
                )
                self._told = True
        elif ours:
            self._name = f"{function.__module__}.{function.__name__}"
            self._depth = 1
            self._said = False
            self._begun = time.monotonic()
            self._collecting = gc.isenabled()
            gc.disable()

    def _say(self, text: str, *values: object) -> None:
        if not self._quiet:
            _log.warning(text, *values)

    def on_end(self, event: Any) -> None:
        """Note that one has ended, whether or not it could be compiled."""
        if self._depth > 0:
            self._depth -= 1
            if self._depth == 0:
                if self._collecting:
                    gc.enable()
                if self._said:
                    self._say("compiled %s in %.0f s", self._name, time.monotonic() - self._begun)
                self._compiled()


def check() -> None:
    """Raise an error unless numba tells of what it compiles."""
    FirstUse(lambda: None)


def listen(compiled: Callable[[], None], kernels: Sequence[Any]) -> None:
    """Have numba tell of what it compiles from now on; see `FirstUse`."""
    _register("numba:compile", FirstUse(compiled, kernels))
