"""How long Python waits for compiled kernels."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

from magfold_env.engine.compile.jit import is_kernel

PACKAGE = "magfold_env."


class KernelClock:
    """Adds up the time of the calls from Python to kernels; those among kernels are part of it.

    What a call costs before the kernel begins counts as the kernel's.
    """

    def __init__(self) -> None:
        self.inside = 0.0
        """Seconds so far."""

    @contextmanager
    def running(self) -> Generator[None]:
        """Watch every kernel that a module of this package names.

        All must have been compiled: a kernel that is compiled meanwhile does not find the others.
        """
        found: list[tuple[ModuleType, str, Any]] = [
            (module, name, value)
            for key, module in list(sys.modules.items())
            if key.startswith(PACKAGE)
            for name, value in list(vars(module).items())
            if is_kernel(value)
        ]
        for module, name, kernel in found:
            setattr(module, name, self._watched(kernel))
        try:
            yield
        finally:
            for module, name, kernel in found:
                setattr(module, name, kernel)

    def _watched(self, kernel: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            begun = time.thread_time()
            result = kernel(*arguments)
            self.inside += time.thread_time() - begun
            return result

        return call
