"""The engine without event location: Moreau's time-stepping takes every step.

The engine's own loop is compiled a second time, with a patience that never ends after the first
step taken by Moreau's scheme. Nothing of it is written twice.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import cache
from types import FunctionType
from typing import Any, cast
from unittest import mock

from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.state import TOUCHY, Model, Record, State, Work
from magfold_env.engine.stepping import integrator
from magfold_env.simulation import session

ENDLESS = 2**60  # steps
PATIENCE = "PATIENCE"  # the engine's name for the steps taken so after a contact
INTEGRATE = "_integrate"  # and the sessions' for what calls its loop


@cache
def patient_advance() -> Callable[[Model, State, Work, Record, float], int]:
    """Return the engine's `advance` with Moreau's scheme alone.

    Raises
    ------
    LookupError
        If the engine has no such setting any more.
    """
    source: Any = cast("Any", integrator.advance).py_func
    if PATIENCE not in source.__globals__:
        raise LookupError(f"magfold_env.engine.stepping.integrator has no {PATIENCE} to set")
    changed = FunctionType(source.__code__, {**source.__globals__, PATIENCE: ENDLESS})
    # Compiled results are kept by name: the name must not be that of the engine's own loop.
    changed.__qualname__ = "advance_by_moreau"
    compiled = kernel(changed)

    def advance(model: Model, state: State, work: Work, record: Record, until: float) -> int:
        state.counter[TOUCHY] = ENDLESS
        return int(compiled(model, state, work, record, until))

    return advance


@contextmanager
def moreau_only() -> Generator[None]:
    """Let all sessions within the block take Moreau's steps only; not for use with threads."""
    advance = patient_advance()

    def integrate(chain: tuple[Model, State, Work, Record], until: float) -> int:
        return advance(*chain, until)

    with mock.patch.object(session, INTEGRATE, integrate):
        yield
