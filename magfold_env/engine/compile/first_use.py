"""A notice to whoever waits while kernels are compiled, which happens only at their first use.

Meanwhile Python does not look for cycles in memory: a compiler makes millions of objects, and would
spend a tenth of its time on that, to give back at most 300 MB.
"""

import gc
import logging
import multiprocessing
import signal
import threading
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from typing import Any, cast

from numba.core import event

# Numba's own modules know no types.
_register = cast("Any", event).register

PATIENCE = 1.0  # [s] what takes less goes without saying
NOTICE = "; later uses load it from the disk, and `magfold warmup` compiles all that there is"

_log = logging.getLogger("magfold_env")


class Interrupt:
    """Sees to it that Ctrl-C is not lost while something is compiled.

    Numba has callbacks that swallow what is raised in them, and then goes on, or fails for want of
    what was to be made. So KeyboardInterrupt is raised once more when the compiler comes by.
    """

    def __init__(self) -> None:
        self._holding = self._pressed = False

    def hold(self) -> None:
        """Begin to watch for it, unless the program does something else with it."""
        usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
        if usual and threading.current_thread() is threading.main_thread():
            self._holding, self._pressed = True, False
            signal.signal(signal.SIGINT, self._note)

    def check(self) -> None:
        """Raise KeyboardInterrupt if it was pressed."""
        if self._pressed:
            self.release()

    def release(self) -> None:
        """Watch no longer; raise KeyboardInterrupt if it was pressed."""
        if self._holding and threading.current_thread() is threading.main_thread():
            self._holding = False
            signal.signal(signal.SIGINT, signal.default_int_handler)
            if self._pressed:
                self._pressed = False
                raise KeyboardInterrupt

    def _note(self, _number: int, _frame: object) -> None:
        self._pressed = True
        raise KeyboardInterrupt


@contextmanager
def interruptible() -> Generator[None]:
    """Have Ctrl-C end what is compiled within; see `Interrupt`."""
    interrupt = Interrupt()
    interrupt.hold()
    try:
        yield
    finally:
        interrupt.release()


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
        self._interrupt = Interrupt()
        self._collecting = gc.isenabled()

    def on_start(self, event: Any) -> None:
        """Note a function of this package that is begun, and those compiled within."""
        function = event.data["dispatcher"].py_func
        # What was made by `exec` may belong to no module.
        ours = str(function.__module__).startswith("magfold_env.")
        if ours:  # a kernel that others call is compiled twice: on its own, and within them
            self._seen.add(function)
        if self._depth > 0:
            self._interrupt.check()
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
            self._interrupt.hold()

    @property
    def compiling_since(self) -> float | None:
        """When the kernel that is being compiled was begun, by `time.monotonic` [s]."""
        return self._begun if self._depth > 0 else None

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
                self._interrupt.release()


def check() -> None:
    """Raise an error unless numba tells of what it compiles."""
    FirstUse(lambda: None)


def listen(compiled: Callable[[], None], kernels: Sequence[Any]) -> FirstUse:
    """Have numba tell of what it compiles from now on; see `FirstUse`."""
    listener = FirstUse(compiled, kernels)
    _register("numba:compile", listener)
    return listener
