"""Drive a session one time step at a time and look at every state it passes through."""

from __future__ import annotations

from collections.abc import Iterator

from magfold_env.engine import outcomes
from magfold_env.engine.chain import feed
from magfold_env.engine.state import LO, STEPS, TIME
from magfold_env.engine.stepping import integrator
from magfold_env.simulation.session import Session


def states(session: Session) -> Iterator[Session]:
    """Yield the session after every time step, to its end; a tube feeds first."""
    while session.released < session.n:
        model, state = session._model, session._state
        lo = int(state.counter[LO])
        if lo == model.n or session._waiting is not None:
            session.feed_one()
            yield session
            continue
        feed.change_speed(model, state, session._work, float(session._speeds[0]))
        until = state.clock[TIME] + feed.time_to_release(model, state)
        yield from _advance(session, until)
        feed.release(model, state)
    yield from _advance(session, session.time + session.scene().duration)


def _advance(session: Session, until: float) -> Iterator[Session]:
    state = session._state
    outcome = outcomes.CAPPED
    while outcome in {outcomes.CAPPED, outcomes.FULL}:
        model = session._model._replace(max_steps=int(state.counter[STEPS]) + 1)
        outcome = integrator.advance(model, state, session._work, session._frames.record, until)
        yield session
    assert outcome in {outcomes.REACHED, outcomes.RESTED}, outcome
