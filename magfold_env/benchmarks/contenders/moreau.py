"""The engine without event location: Moreau's time-stepping takes every step.

The engine's own loop is told that Moreau's scheme has all its steps still to take.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from unittest import mock

from magfold_env.engine.state import MOREAU_LEFT
from magfold_env.simulation import session

ENDLESS = 2**60  # steps


@contextmanager
def moreau_only() -> Generator[None]:
    """Let all sessions within the block take Moreau's steps only; not for use with threads."""
    run_chain = session.run_chain

    def run(chain: session.Chain, until: float) -> int:
        _, state, _, _ = chain
        state.counter[MOREAU_LEFT] = ENDLESS
        return run_chain(chain, until)

    with mock.patch.object(session, "run_chain", run):
        yield
