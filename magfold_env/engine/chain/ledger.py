"""Record the drive's impulse, its work, and its peak force.

Impacts and jumps in speed give impulses without a duration, and in a chain that almost locks, a
brief force does not show how strong the pusher must be. The peak is therefore the largest mean over
a whole millisecond of simulated time: impulse divided by 1 ms, positive outward.
"""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.chain.tube import whole_mass
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Model, State

MEAN_OVER = 1e-3  # [s]
PATIENCE = 0.1  # [s] of slipping after which a feed is jammed
# A drive without a limit gives way only beyond these multiples of a moving chain's forces.
LOCKED, STRUCK = 1000.0, 100.0
GRAVITY = 9.8  # [m/s²]


@inlined
def next_millisecond(state: State) -> float:
    """Return the time at which the current millisecond ends [s]."""
    return (state.counter[ix.MILLISECONDS] + 1) * MEAN_OVER


@inlined
def close_millisecond(state: State, impulse: float) -> None:
    """Update the peak force at the end of a millisecond, when ``impulse`` is the total [N·s]."""
    force = (impulse - state.account[ix.BEFORE]) / MEAN_OVER
    if abs(force) > abs(state.account[ix.PEAK]):
        state.account[ix.PEAK] = force
    state.account[ix.BEFORE] = impulse
    state.counter[ix.MILLISECONDS] += 1


@kernel
def pass_time(state: State, until: float, gained: float) -> None:
    """Close milliseconds up to a time [s], while the impulse grows evenly by ``gained`` [N·s]."""
    begin, impulse = float(state.clock[ix.TIME]), float(state.account[ix.IMPULSE])
    end = next_millisecond(state)
    while end <= until:
        share = (end - begin) / (until - begin) if until > begin else 1.0
        close_millisecond(state, impulse + share * gained)
        # The other milliseconds have the same mean; a loop over them could take minutes.
        skipped = int((until - end) / MEAN_OVER) - 1
        if skipped > 0:
            state.counter[ix.MILLISECONDS] += skipped
            state.account[ix.BEFORE] += skipped * MEAN_OVER / (until - begin) * gained
        end = next_millisecond(state)


@inlined
def note_impulse(state: State, impulse: float, velocity: float) -> None:
    """Record an impulse of the drive [N·s] at a mean ``velocity`` of the base [m/s]."""
    state.account[ix.IMPULSE] += impulse
    state.account[ix.FED] += impulse * velocity


@inlined
def most_force(model: Model, state: State) -> float:
    """Return the largest force with which the drive can push or pull [N].

    A drive without a limit gets one that is far above the force needed to move a chain against its
    magnetic forces, its weight and impacts at the requested speed.
    """
    if not math.isinf(model.force_limit):
        return model.force_limit
    own = model.typical_rate * model.typical_rate * model.bodies.length[0] + GRAVITY
    return whole_mass(model) * (LOCKED * own + STRUCK * abs(state.feed[ix.ASKED]) / MEAN_OVER)


@inlined
def patience_left(model: Model, state: State) -> float:
    """Return how much longer a drive may slip before it counts as jammed [s]."""
    patience = MEAN_OVER if math.isinf(model.force_limit) else PATIENCE
    return state.feed[ix.SINCE] + patience - state.clock[ix.TIME]
