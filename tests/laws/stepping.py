"""Drive a session one time step at a time and look at every state it passes through."""

from __future__ import annotations

import math
from collections.abc import Iterator

from magfold_env.engine import entries as at
from magfold_env.engine.outcomes import CAPPED, PAUSED, RESTED, TIMED_OUT
from magfold_env.engine.stepping import runs
from magfold_env.simulation.session import Session


def states(session: Session) -> Iterator[Session]:
    """Yield the session after every time step, to its end; a tube feeds first."""
    state = session._state
    outcome = CAPPED
    while outcome in {CAPPED, PAUSED}:
        model = session._model._replace(max_steps=int(state.counter[at.STEPS]) + 1)
        outcome = runs.run(model, state, session._work, session._chains.frames.record, math.inf)
        yield session
    assert outcome in {TIMED_OUT, RESTED}, outcome
