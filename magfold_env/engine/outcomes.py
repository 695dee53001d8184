"""The outcomes of a step and of an integration, and the limits on work that can end one."""

from magfold_env.engine import indices as ix
from magfold_env.engine.compile.jit import inlined
from magfold_env.engine.state import Model, State

# Outcomes of a step after which the integration continues; all others end both.
ACCEPTED, TOUCHED, RATTLED = range(-3, 0)

# Outcomes of an integration.
REACHED, RESTED, CAPPED, UNDERFLOW, NOT_FINITE, TOO_CROWDED, NO_SOLUTION, PAUSED, JAMMED = range(9)
RAN_AWAY, LOCKED = 9, 11

# A chain that still moves after its time to settle.
TIMED_OUT = 10

# Evaluations per turn, times n² because forces act between pairs: 7 ms, or 50 ms in a browser.
TURN = 40_000


@inlined
def end_of_turn(model: Model, state: State) -> int:
    """Return the number of evaluations at which a kernel returns to its caller.

    The caller can then show progress, enforce a limit, or stop the run.
    """
    return state.counter[ix.EVALUATIONS] + 1 + TURN // (model.n * model.n)


@inlined
def out_of_work(model: Model, state: State) -> bool:
    """Whether the run, or its present second of simulated time, has used up all its steps."""
    if state.clock[ix.TIME] >= state.clock[ix.SECOND] + 1.0:
        state.clock[ix.SECOND] = state.clock[ix.TIME]
        state.counter[ix.SECOND_STEPS] = state.counter[ix.STEPS]
    in_second = state.counter[ix.STEPS] - state.counter[ix.SECOND_STEPS]
    return state.counter[ix.STEPS] >= model.max_steps or in_second >= model.max_steps_per_second
