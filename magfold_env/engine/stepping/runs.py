"""Feed many chains, on any number of threads."""

from __future__ import annotations

from typing import NamedTuple

from magfold_env.engine.chain import feed
from magfold_env.engine.compile.by_pointer import call_float, call_int, calls_by_address, take
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.magnets import pairs
from magfold_env.engine.magnets.outer_field import field_energy
from magfold_env.engine.outcomes import REACHED, TIMED_OUT
from magfold_env.engine.state import LO, TIME, Array, IntArray, Model, State, Work

BEGIN, ADVANCE, RELEASE, ENERGY = range(4)


class Batch(NamedTuple):
    """Chains that are fed together, m of them."""

    code: IntArray  # addresses of the code for BEGIN, ADVANCE, RELEASE and ENERGY
    models: IntArray  # addresses of what belongs to each chain, (m,)
    states: IntArray
    works: IntArray
    record: int  # address of a record without room, for all of them
    counters: IntArray  # of their states, (m, …)
    clocks: Array
    charges: Array  # of their models
    waiting: Array  # charges that components get when they are fed, (m, n, 4) [A·m]
    speeds: Array  # at which they are fed, (m, n) [m/s]
    outcomes: IntArray  # how each integration ended, (m,); REACHED: it has not
    energies: Array  # of chains that have ended, (m,) [J]


@kernel
def begin(model: Model, state: State, work: Work, speed: float) -> float:
    """Begin to feed at a speed [m/s]; returns when the outermost component will be released [s].

    A chain that is all in the tube is brought there at once: nothing outside can move by itself.
    """
    feed.change_speed(model, state, work, speed)
    until = state.clock[TIME] + feed.time_to_release(model, state)
    if state.counter[LO] == model.n:
        state.q[model.n] += speed * (until - state.clock[TIME])
        state.clock[TIME] = until
    return until


@kernel
def end(model: Model, state: State, work: Work, x: float) -> float:
    """Release the outermost component."""
    feed.release(model, state)
    return x


@kernel
def energy(model: Model, state: State, work: Work, x: float) -> float:
    """Magnetic energy of the components whose magnets act [J], an outer field's included."""
    first = feed.place_all(state.counter[LO], model, state.q, work.pose)
    if not model.magnetic:
        return 0.0
    total = pairs.energy(first, model.magnets, model.charge, work.pose, work.nodes)
    if model.field.present:
        total += field_energy(first, model, work.pose, work.nodes)
    return total


@calls_by_address
def advance_at(code: int, model: int, state: int, work: int, record: int, until: float) -> int:
    """`integrator.advance`, for the addresses of its code and of its arguments."""
    return call_int(code, model, state, work, record, until)


@calls_by_address
def feed_chains(
    batch: Batch, rows: IntArray, duration: float, all_of_it: bool, next_row: IntArray
) -> int:
    """Feed the next component of some chains, or all; chains that are all out settle.

    Chains are taken one by one from a counter that threads share. Returns how many this thread
    took.

    Parameters
    ----------
    batch
        All chains; outcomes and energies are filled in.
    rows
        The chains to feed.
    duration
        Longest time to settle [s].
    next_row
        The counter, (1,).
    """
    code, counters, outcomes = batch.code, batch.counters, batch.outcomes
    taken = 0
    while True:
        place = take(next_row)
        if place >= rows.size:
            return taken
        taken += 1
        k = rows[place]
        model, state, work = batch.models[k], batch.states[k], batch.works[k]
        outcome = REACHED
        left = counters[k, LO]
        for _ in range(left if all_of_it else 1):
            i = counters[k, LO] - 1
            for face in range(4):
                batch.charges[k, i, face] = batch.waiting[k, i, face]
            until = call_float(code[BEGIN], model, state, work, batch.speeds[k, i])
            outcome = call_int(code[ADVANCE], model, state, work, batch.record, until)
            if outcome != REACHED:
                break
            call_float(code[RELEASE], model, state, work, 0.0)
        if outcome == REACHED and counters[k, LO] == 0:
            until = batch.clocks[k, TIME] + duration
            outcome = call_int(code[ADVANCE], model, state, work, batch.record, until)
            if outcome == REACHED:
                outcome = TIMED_OUT
        outcomes[k] = outcome
        if outcome != REACHED:
            batch.energies[k] = call_float(code[ENERGY], model, state, work, 0.0)


@calls_by_address
def find_energies(batch: Batch, rows: IntArray) -> None:
    """Fill in the energies [J] of some chains as they are."""
    for k in rows:
        batch.energies[k] = call_float(
            batch.code[ENERGY], batch.models[k], batch.states[k], batch.works[k], 0.0
        )
