"""A notice for users who wait while kernels are compiled, which happens only at first use.

Meanwhile Python's garbage collector is off: a compiler creates millions of objects, and collection
would take a tenth of its time to free at most 300 MB.
"""

import gc
import logging
import multiprocessing
import signal
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from numba.core import event

PATIENCE = 1.0  # [s] shorter compilations are not reported
NOTICE = "; later uses load it from the disk, and `magfold warmup` compiles all that there is"

_log = logging.getLogger("magfold_env")


class CompileNotice(event.Listener):
    """Logs that kernels are being compiled, and how long each took, but not in worker processes.

    Unless logging is configured otherwise, the messages go to standard error. Some of numba's
    callbacks swallow a KeyboardInterrupt, and numba then continues or fails because a result is
    missing. After Ctrl-C, the next event therefore raises the exception again.

    Parameters
    ----------
    compiled
        Called after each compilation of a kernel that was not in the cache.
    kernels
        All kernels so far, including those that other kernels call.
    """

    def __init__(self, compiled: Callable[[], None], kernels: Sequence[Any] = ()) -> None:
        self._compiled = compiled
        self._kernels = kernels
        self._depth = 0
        self._seen: set[object] = set()
        self._name = ""
        self._begun = 0.0
        self._quiet = multiprocessing.parent_process() is not None
        self._logged = False
        self._notice = NOTICE
        self._collecting = gc.isenabled()
        self._watching = self._pressed = False

    @property
    def compiling_since(self) -> float | None:
        """Start time of the current kernel's compilation, by `time.monotonic` [s]."""
        return self._begun if self._depth > 0 else None

    def on_start(self, event: Any) -> None:
        """Note that numba starts to compile a function of this package, or one that it calls."""
        function = event.data["dispatcher"].py_func
        # A function created by `exec` may have no module.
        ours = str(function.__module__).startswith("magfold_env.")
        if ours:  # a kernel that others call is compiled twice: by itself, and within them
            self._seen.add(function)
        if self._depth > 0:
            if self._pressed:
                self._stop_watching()
            self._depth += 1
            if not self._logged and time.monotonic() - self._begun > PATIENCE:
                self._logged = True
                counts = len(self._seen), max(len(self._seen), len(self._kernels))
                text = "compiling %s for its first use, kernel %d of up to %d%s"
                self._log(text, self._name, *counts, self._notice)
                self._notice = ""
        elif ours:
            self._name = f"{function.__module__}.{function.__name__}"
            self._depth, self._logged, self._begun = 1, False, time.monotonic()
            self._collecting = gc.isenabled()
            gc.disable()
            self._watch()

    def on_end(self, event: Any) -> None:
        """Note that a compilation has ended, successfully or not."""
        if self._depth > 0:
            self._depth -= 1
            if self._depth == 0:
                if self._collecting:
                    gc.enable()
                if self._logged:
                    self._log("compiled %s in %.0f s", self._name, time.monotonic() - self._begun)
                self._compiled()
                self._stop_watching()

    def _log(self, text: str, *values: object) -> None:
        if not self._quiet:
            _log.warning(text, *values)

    def _watch(self) -> None:
        """Watch for Ctrl-C, unless the program handles it differently."""
        usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
        if usual and threading.current_thread() is threading.main_thread():
            self._watching, self._pressed = True, False
            signal.signal(signal.SIGINT, self._note)

    def _stop_watching(self) -> None:
        """Stop watching; raise KeyboardInterrupt if Ctrl-C was pressed."""
        if self._watching and threading.current_thread() is threading.main_thread():
            self._watching = False
            signal.signal(signal.SIGINT, signal.default_int_handler)
            if self._pressed:
                self._pressed = False
                raise KeyboardInterrupt

    def _note(self, _number: int, _frame: object) -> None:
        self._pressed = True
        raise KeyboardInterrupt
