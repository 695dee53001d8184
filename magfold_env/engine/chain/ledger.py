"""What the drive did: its impulse, its work, and the largest mean of its force over 1 ms.

Impacts and jumps in speed give impulses without a duration, and where a chain all but locks, a
force of microseconds says nothing about the pusher that is needed. So the peak is that of means
over whole milliseconds of simulated time: impulse over 1 ms, positive outward.
"""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.chain.tube import whole_mass
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Model, State

MEAN_OVER = 1e-3  # [s]
PATIENCE = 0.1  # [s] of slipping after which a feed is jammed
# A drive without a limit gives way only beyond these multiples of the forces in a moving chain.
LOCKED, STRUCK = 1000.0, 100.0
GRAVITY = 9.8  # [m/s²]


@inlined
def next_millisecond(state: State) -> float:
    """When the present millisecond ends [s]."""
    return (state.counter[ix.MILLISECONDS] + 1) * MEAN_OVER


@inlined
def close_millisecond(state: State, impulse: float) -> None:
    """Take the mean force of a millisecond at whose end the drive's impulse is so much [N·s]."""
    force = (impulse - state.account[ix.BEFORE]) / MEAN_OVER
    if abs(force) > abs(state.account[ix.PEAK]):
        state.account[ix.PEAK] = force
    state.account[ix.BEFORE] = impulse
    state.counter[ix.MILLISECONDS] += 1


@kernel
def pass_time(state: State, until: float, gained: float) -> None:
    """Close the milliseconds until a time [s], in which the impulse grows evenly [N·s]."""
    begin, impulse = float(state.clock[ix.TIME]), float(state.account[ix.IMPULSE])
    end = next_millisecond(state)
    while end <= until:
        share = (end - begin) / (until - begin) if until > begin else 1.0
        close_millisecond(state, impulse + share * gained)
        # The mean is the same in all that follow: a slow feed would count for minutes.
        skipped = int((until - end) / MEAN_OVER) - 1
        if skipped > 0:
            state.counter[ix.MILLISECONDS] += skipped
            state.account[ix.BEFORE] += skipped * MEAN_OVER / (until - begin) * gained
        end = next_millisecond(state)


@inlined
def note_impulse(state: State, impulse: float, velocity: float) -> None:
    """Book an impulse of the drive [N·s], at the mean of its velocities before and after [m/s]."""
    state.account[ix.IMPULSE] += impulse
    state.account[ix.FED] += impulse * velocity


@inlined
def most_force(model: Model, state: State) -> float:
    """Return the force that the drive can push or pull with [N].

    One without a limit gives way to far more than what a chain that can move takes: its own forces
    and its weight, and impacts at the speed asked for.
    """
    if not math.isinf(model.force_limit):
        return model.force_limit
    own = model.typical_rate * model.typical_rate * model.bodies.length[0] + GRAVITY
    return whole_mass(model) * (LOCKED * own + STRUCK * abs(state.feed[ix.ASKED]) / MEAN_OVER)


@inlined
def patience_left(model: Model, state: State) -> float:
    """Return how much longer a drive may slip until it is jammed [s]."""
    patience = MEAN_OVER if math.isinf(model.force_limit) else PATIENCE
    return state.feed[ix.SINCE] + patience - state.clock[ix.TIME]
