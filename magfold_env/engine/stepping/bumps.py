"""A train of bumps, as on a shaken table: each changes all free components' velocities at once.

The times between bumps are uniformly distributed from 0 to twice their mean; the directions are
uniform, too. Park and Miller's generator [1]_ gives the numbers; its products fit in an integer, so
that a train is the same on every machine.

References
----------
.. [1] S. K. Park and K. W. Miller, "Random number generators: good ones are hard to find",
   Communications of the ACM 31 (1988) 1192-1201.
"""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import feed, ledger
from magfold_env.engine.chain.momentum import kinetic, spread
from magfold_env.engine.chain.tube import base_mass
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.elementary import sincos
from magfold_env.engine.state import Model, State, Work

FACTOR, MODULUS = 48271, 2**31 - 1


@inlined
def draw(state: State) -> float:
    """Return the next random number, uniform from 0 to 1."""
    state.counter[ix.DICE] = FACTOR * state.counter[ix.DICE] % MODULUS
    return float(state.counter[ix.DICE]) / MODULUS


def begin(model: Model, state: State) -> None:
    """Set the time of the first bump, if there are any."""
    state.clock[ix.BUMP] = math.inf
    if model.bump_rate > 0.0:
        number = FACTOR * model.bump_seed % MODULUS
        state.counter[ix.DICE] = number
        first = 2.0 * (number / MODULUS) / model.bump_rate
        if first <= model.bump_duration:
            state.clock[ix.BUMP] = first


@kernel
def bump(model: Model, state: State, work: Work) -> None:
    """Bump the chain, as far as its hinges allow, and set the time of the next bump.

    A base that the tube or a pin holds keeps its velocity.
    """
    s, c = sincos(2.0 * math.pi * draw(state))
    x, y = model.bump_speed * c, model.bump_speed * s
    state.clock[ix.BUMP] += 2.0 * draw(state) / model.bump_rate
    if state.clock[ix.BUMP] > model.bump_duration:
        state.clock[ix.BUMP] = math.inf
    lo, n = state.counter[ix.N_HELD], model.n
    if lo == n:
        return
    energy, along = kinetic(lo, model, state, work)
    state.stuck[lo:] = 0
    spread(lo, model, state, work, x, y, base_mass(lo, model, work))
    new_energy, new_along = kinetic(lo, model, state, work)
    impulse = 0.0
    if feed.drives(model, state):
        impulse = new_along - along
        for i in range(lo, n):
            impulse -= model.bodies.mass[i] * x
        ledger.note_impulse(state, impulse, float(state.v[n]))
    state.account[ix.BUMPED] += new_energy - energy - impulse * state.v[n]
    state.counter[ix.FRESH] = 1
