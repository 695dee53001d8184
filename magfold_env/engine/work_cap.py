"""The hard limits on work: so many steps in all, and so many in a second of simulated time."""

from __future__ import annotations

from magfold_env.engine.compile.jit import inlined
from magfold_env.engine.state import SECOND, SECOND_STEPS, STEPS, TIME, Model, State


@inlined
def out_of_work(model: Model, state: State) -> bool:
    """Whether the run, or its present second, has had all the steps it may have."""
    if state.clock[TIME] >= state.clock[SECOND] + 1.0:
        state.clock[SECOND] = state.clock[TIME]
        state.counter[SECOND_STEPS] = state.counter[STEPS]
    in_second = state.counter[STEPS] - state.counter[SECOND_STEPS]
    return state.counter[STEPS] >= model.max_steps or in_second >= model.max_steps_per_second
