"""Frames at equal intervals, from the dense output: they cost no forces and change nothing."""

from __future__ import annotations

from magfold_env.engine.arrays import copy
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.contact.events import interpolate
from magfold_env.engine.state import FRAME_TIME, FRAMES, LO, TIME, Model, Record, State, Work


@kernel
def has_room(record: Record, state: State, longest_step: float) -> bool:
    """Whether the frames of one more step fit."""
    if record.interval <= 0.0:
        return True
    return state.counter[FRAMES] + longest_step / record.interval + 2.0 < record.time.size


@kernel
def record_step(record: Record, state: State, work: Work, step: float, fraction: float) -> None:
    """Take the frames that fall into the accepted part of a step."""
    if record.interval <= 0.0:
        return
    begin = state.clock[TIME]
    end = begin + fraction * step
    while state.clock[FRAME_TIME] <= end:
        f = state.counter[FRAMES]
        at = (state.clock[FRAME_TIME] - begin) / step
        interpolate(state.q, work.slope_q, step, at, record.q[f])
        interpolate(state.v, work.slope_v, step, at, record.v[f])
        record.time[f] = state.clock[FRAME_TIME]
        record.lo[f] = state.counter[LO]
        state.counter[FRAMES] = f + 1
        state.clock[FRAME_TIME] += record.interval


@kernel
def record_rest(record: Record, model: Model, state: State, until: float) -> bool:
    """Take the frames of a chain that only moves with the base; False if they do not fit."""
    if record.interval <= 0.0:
        return True
    n = model.n
    while state.clock[FRAME_TIME] <= until:
        f = state.counter[FRAMES]
        if f >= record.time.size:
            return False
        copy(state.q, record.q[f], 0)
        copy(state.v, record.v[f], 0)
        record.q[f, n] += state.v[n] * (state.clock[FRAME_TIME] - state.clock[TIME])
        record.time[f] = state.clock[FRAME_TIME]
        record.lo[f] = state.counter[LO]
        state.counter[FRAMES] = f + 1
        state.clock[FRAME_TIME] += record.interval
    return True


@kernel
def record_line(record: Record, state: State, work: Work, step: float) -> None:
    """Take the frames of a step of constant velocity, whose end is in ``work.new_q``, ``new_v``."""
    if record.interval <= 0.0:
        return
    begin = state.clock[TIME]
    while state.clock[FRAME_TIME] <= begin + step:
        f = state.counter[FRAMES]
        share = (state.clock[FRAME_TIME] - begin) / step
        for k in range(state.q.size):
            record.q[f, k] = state.q[k] + share * (work.new_q[k] - state.q[k])
            record.v[f, k] = work.new_v[k]
        record.time[f] = state.clock[FRAME_TIME]
        record.lo[f] = state.counter[LO]
        state.counter[FRAMES] = f + 1
        state.clock[FRAME_TIME] += record.interval


@kernel
def record_instant(record: Record, state: State) -> bool:
    """Take a frame of the state if one is due; False if it does not fit."""
    if record.interval <= 0.0 or state.clock[TIME] < state.clock[FRAME_TIME]:
        return True
    f = state.counter[FRAMES]
    if f >= record.time.size:
        return False
    copy(state.q, record.q[f], 0)
    copy(state.v, record.v[f], 0)
    record.time[f] = state.clock[TIME]
    record.lo[f] = state.counter[LO]
    state.counter[FRAMES] = f + 1
    state.clock[FRAME_TIME] += record.interval
    return True
