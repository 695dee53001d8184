"""Whole runs, of one chain or of many chains on any number of threads."""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import feed
from magfold_env.engine.chain.tube import place_all
from magfold_env.engine.compile.by_pointer import call_float, call_int, calls_by_address, take
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.magnets.chain import magnet_energy
from magfold_env.engine.outcomes import PAUSED, REACHED, RESTED, TIMED_OUT, end_of_turn
from magfold_env.engine.state import Array, IntArray, Model, Record, State, Work
from magfold_env.engine.stepping import bumps
from magfold_env.engine.stepping.integrator import advance, move_with_base

RUN, ENERGY = range(2)


@kernel
def run(model: Model, state: State, work: Work, record: Record, until: float) -> int:
    """Feed a chain and let it move until a time [s], or until the run ends as ``state`` defines.

    Returns REACHED in both cases, TIMED_OUT at the time limit of the run, or another outcome of the
    integration. Returns PAUSED when the record is full and after a turn of at most 50 ms. The
    caller then empties the record and calls again, and the run continues as if it had not paused.
    """
    turn = end_of_turn(model, state)
    while True:
        lo, bump = state.counter[ix.N_HELD], state.clock[ix.BUMP]
        if lo <= state.counter[ix.KEEP] or state.clock[ix.TIME] >= until:
            return REACHED
        if state.counter[ix.EVALUATIONS] >= turn:
            return PAUSED
        if lo > 0 and state.counter[ix.FEEDING] == 0:
            feed.begin(model, state, work)
        parked = state.counter[ix.PARKED] == 1
        if lo > 0 and not parked and until == math.inf and state.feed[ix.ASKED] == 0.0:
            # The drive has stopped for good, so the components outside get their time to settle.
            parked = True
            state.counter[ix.PARKED] = 1
            state.clock[ix.END] = state.clock[ix.TIME] + model.duration
        fed = lo > 0 and not parked
        stop = min(state.clock[ix.MARK] if fed else state.clock[ix.END], bump, until)
        if lo < model.n:
            outcome = advance(model, state, work, record, stop, turn)
        elif parked:
            outcome = RESTED
        else:
            # No component is outside yet that could move by itself.
            force = feed.inside_force(model, state, work, stop)
            outcome = move_with_base(model, state, work, record, stop, force)
        if outcome != REACHED:
            return outcome
        if state.clock[ix.TIME] >= bump:
            bumps.bump(model, state, work)
        if lo > 0:
            arrived = feed.is_at_mark(state)
            state.counter[ix.FEEDING] = 0
            if arrived:
                feed.pass_mark(model, state, work)
                if state.counter[ix.N_HELD] == 0:
                    state.clock[ix.END] = state.clock[ix.TIME] + model.duration
        if not fed and state.clock[ix.TIME] >= state.clock[ix.END]:
            return TIMED_OUT


@kernel
def energy(model: Model, state: State, work: Work, x: float) -> float:
    """Return the magnetic energy of components whose magnets act [J], with an external field."""
    first = place_all(state.counter[ix.N_HELD], model, state.q, work.pose)
    return magnet_energy(first, model, work)


@calls_by_address
def run_at(code: int, model: int, state: int, work: int, record: int, until: float) -> int:
    """Call `run` by the addresses of its code and of its arguments."""
    return call_int(code, model, state, work, record, until)


@calls_by_address
def energy_at(code: int, model: int, state: int, work: int, x: float) -> float:
    """Call `energy` by the addresses of its code and of its arguments."""
    return call_float(code, model, state, work, x)


@calls_by_address
def run_chains(
    code: IntArray, models: IntArray, states: IntArray, works: IntArray, record: int,
    until: Array, rows: IntArray, outcomes: IntArray, energies: Array, next_row: IntArray,
) -> int:  # fmt: skip
    """Call `run` for the chains ``rows``, which threads take one by one from a shared counter (1,).

    The arguments are addresses: of the code of `run` and `energy`, of each chain's data (m,), and
    of a record, which only a single chain may have. Runs pause at the times ``until`` (m,) [s].
    Fills in the outcomes (m,), REACHED or PAUSED for runs that have not ended, and the energies
    (m,) [J] of ended runs. Returns how many chains this thread ran.
    """
    taken = 0
    while True:
        place = take(next_row)
        if place >= rows.size:
            return taken
        taken += 1
        k = rows[place]
        outcome = call_int(code[RUN], models[k], states[k], works[k], record, until[k])
        outcomes[k] = outcome
        if outcome not in (REACHED, PAUSED):
            energies[k] = call_float(code[ENERGY], models[k], states[k], works[k], 0.0)


@calls_by_address
def energies_of(
    code: IntArray, models: IntArray, states: IntArray, works: IntArray, rows: IntArray, out: Array
) -> None:
    """Fill in the energies [J] of some chains in their present states."""
    for k in rows:
        out[k] = call_float(code[ENERGY], models[k], states[k], works[k], 0.0)
