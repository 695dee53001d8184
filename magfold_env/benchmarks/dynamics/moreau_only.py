"""The engine without event location: Moreau's time-stepping takes every step.

The engine's own loop is told that Moreau's scheme has all its steps still to take.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from unittest import mock

from magfold_env.engine.state import MOREAU_LEFT, Model, Record, State, Work
from magfold_env.engine.stepping import integrator
from magfold_env.simulation import session

ENDLESS = 2**60  # steps
INTEGRATE = "_integrate"  # the sessions' name for what calls its loop


@contextmanager
def moreau_only() -> Generator[None]:
    """Let all sessions within the block take Moreau's steps only; not for use with threads."""

    def integrate(chain: tuple[Model, State, Work, Record], until: float) -> int:
        state = chain[1]
        state.counter[MOREAU_LEFT] = ENDLESS
        return integrator.advance(*chain, until)

    with mock.patch.object(session, INTEGRATE, integrate):
        yield
