"""How a step, and an integration, can end; and the limits on work that end one."""

from magfold_env.engine import entries as at
from magfold_env.engine.compile.jit import inlined
from magfold_env.engine.state import Model, State

# One step, after which the integration goes on; other outcomes end both.
ACCEPTED, TOUCHED, RATTLED = range(-3, 0)

# An integration.
REACHED, RESTED, CAPPED, UNDERFLOW, NOT_FINITE, TOO_CROWDED, NO_SOLUTION, PAUSED, JAMMED = range(9)
RAN_AWAY, LOCKED = 9, 11

# A chain that had its time to settle and still moves.
TIMED_OUT = 10

# Evaluations in a turn, times n², since forces act between pairs: 7 ms, or 50 in a browser.
TURN = 40_000


@inlined
def end_of_turn(model: Model, state: State) -> int:
    """Return the count of evaluations at which a kernel returns to its caller.

    It pauses so that progress can be shown, a limit kept, and a run stopped.
    """
    return state.counter[at.EVALUATIONS] + 1 + TURN // (model.n * model.n)


@inlined
def out_of_work(model: Model, state: State) -> bool:
    """Whether the run, or its present second of simulated time, has had all the steps it may."""
    if state.clock[at.TIME] >= state.clock[at.SECOND] + 1.0:
        state.clock[at.SECOND] = state.clock[at.TIME]
        state.counter[at.SECOND_STEPS] = state.counter[at.STEPS]
    in_second = state.counter[at.STEPS] - state.counter[at.SECOND_STEPS]
    return state.counter[at.STEPS] >= model.max_steps or in_second >= model.max_steps_per_second
