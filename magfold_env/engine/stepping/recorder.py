"""Record frames at equal intervals, interpolated by the dense output without affecting the run."""

from magfold_env.engine import indices as ix
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Array, Model, Record, State, Work, copy
from magfold_env.engine.stepping.stages import drive_impulse, interpolate


@kernel
def has_room(record: Record, state: State, longest_step: float) -> bool:
    """Whether the record has space for the frames of one more step."""
    if record.interval <= 0.0:
        return True
    return state.counter[ix.FRAMES] + longest_step / record.interval + 2.0 < record.time.size


@inlined
def is_due(record: Record, state: State, until: float) -> bool:
    """Whether a frame is due by a time [s]."""
    return record.interval > 0.0 and state.clock[ix.FRAME_TIME] <= until


@inlined
def next_frame(record: Record, state: State, time: float, gained: float) -> int:
    """Begin a frame at a time [s], until which the impulse grew by ``gained``; return its index."""
    f = state.counter[ix.FRAMES]
    record.time[f] = time
    record.lo[f] = state.counter[ix.N_HELD]
    record.impulse[f] = state.account[ix.IMPULSE] + gained
    state.counter[ix.FRAMES] = f + 1
    state.clock[ix.FRAME_TIME] += record.interval
    return f


@kernel
def record_step(
    model: Model, state: State, work: Work, record: Record, step: float, fraction: float
) -> None:
    """Take the frames in the accepted part of a step."""
    begin = state.clock[ix.TIME]
    while is_due(record, state, begin + fraction * step):
        time = state.clock[ix.FRAME_TIME]
        share = (time - begin) / step
        f = next_frame(record, state, time, drive_impulse(model, state, work, step, share))
        interpolate(state.q, work.stages.slope_q, step, share, record.q[f])
        interpolate(state.v, work.stages.slope_v, step, share, record.v[f])


@kernel
def record_line(
    record: Record, state: State, until: float, end: Array, velocity: Array, impulse: float
) -> bool:
    """Take the frames of a motion at constant ``velocity`` to ``end``; return whether they fit.

    The motion ends at the time ``until`` [s]; ``impulse`` is the drive's during the motion [N·s].
    """
    begin = state.clock[ix.TIME]
    while is_due(record, state, until):
        if state.counter[ix.FRAMES] >= record.time.size:
            return False
        time = state.clock[ix.FRAME_TIME]
        share = (time - begin) / (until - begin) if until > begin else 1.0
        f = next_frame(record, state, time, share * impulse)
        copy(velocity, record.v[f], 0)
        for k in range(state.q.size):
            record.q[f, k] = state.q[k] + share * (end[k] - state.q[k])
    return True


@kernel
def record_instant(record: Record, state: State) -> bool:
    """Take a frame of the state if one is due; return False if it does not fit."""
    time = float(state.clock[ix.TIME])
    if is_due(record, state, time):
        if state.counter[ix.FRAMES] >= record.time.size:
            return False
        f = next_frame(record, state, time, 0.0)
        copy(state.q, record.q[f], 0)
        copy(state.v, record.v[f], 0)
    return True
