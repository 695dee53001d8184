"""Frames at equal intervals, from the dense output: they cost no forces and change nothing."""

from magfold_env.engine import entries as at
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Array, Model, Record, State, Work, copy
from magfold_env.engine.stepping.stages import drive_impulse, interpolate


@kernel
def has_room(record: Record, state: State, longest_step: float) -> bool:
    """Whether the frames of one more step fit."""
    if record.interval <= 0.0:
        return True
    return state.counter[at.FRAMES] + longest_step / record.interval + 2.0 < record.time.size


@inlined
def next_frame(record: Record, state: State, time: float) -> int:
    """Begin a frame at a time [s]; return its number."""
    f = state.counter[at.FRAMES]
    record.time[f] = time
    record.lo[f] = state.counter[at.LO]
    state.counter[at.FRAMES] = f + 1
    state.clock[at.FRAME_TIME] += record.interval
    return f


@kernel
def record_step(
    model: Model, state: State, work: Work, record: Record, step: float, fraction: float
) -> None:
    """Take the frames that fall into the accepted part of a step."""
    if record.interval <= 0.0:
        return
    begin = state.clock[at.TIME]
    end = begin + fraction * step
    while state.clock[at.FRAME_TIME] <= end:
        share = (state.clock[at.FRAME_TIME] - begin) / step
        f = next_frame(record, state, state.clock[at.FRAME_TIME])
        interpolate(state.q, work.stages.slope_q, step, share, record.q[f])
        interpolate(state.v, work.stages.slope_v, step, share, record.v[f])
        record.impulse[f] = state.account[at.IMPULSE] + drive_impulse(
            model, state, work, step, share
        )


@kernel
def record_rest(record: Record, state: State, until: float, force: float) -> bool:
    """Take the frames of a chain that only moves with the base; False if they do not fit.

    ``force`` is that of the drive [N].
    """
    if record.interval <= 0.0:
        return True
    n = state.q.size - 2
    while state.clock[at.FRAME_TIME] <= until:
        if state.counter[at.FRAMES] >= record.time.size:
            return False
        time = state.clock[at.FRAME_TIME]
        f = next_frame(record, state, time)
        copy(state.q, record.q[f], 0)
        copy(state.v, record.v[f], 0)
        record.q[f, n] += state.v[n] * (time - state.clock[at.TIME])
        record.impulse[f] = state.account[at.IMPULSE] + force * (time - state.clock[at.TIME])
    return True


@kernel
def record_line(
    record: Record, state: State, step: float, end: Array, velocity: Array, impulse: float
) -> None:
    """Take the frames of a step of constant ``velocity`` to ``end``.

    ``impulse`` is that of the drive within it [N·s].
    """
    if record.interval <= 0.0:
        return
    begin = state.clock[at.TIME]
    while state.clock[at.FRAME_TIME] <= begin + step:
        share = (state.clock[at.FRAME_TIME] - begin) / step
        f = next_frame(record, state, state.clock[at.FRAME_TIME])
        for k in range(state.q.size):
            record.q[f, k] = state.q[k] + share * (end[k] - state.q[k])
            record.v[f, k] = velocity[k]
        record.impulse[f] = state.account[at.IMPULSE] + share * impulse


@kernel
def record_instant(record: Record, state: State) -> bool:
    """Take a frame of the state if one is due; False if it does not fit."""
    if record.interval <= 0.0 or state.clock[at.TIME] < state.clock[at.FRAME_TIME]:
        return True
    if state.counter[at.FRAMES] >= record.time.size:
        return False
    f = next_frame(record, state, state.clock[at.TIME])
    copy(state.q, record.q[f], 0)
    copy(state.v, record.v[f], 0)
    record.impulse[f] = state.account[at.IMPULSE]
    return True
