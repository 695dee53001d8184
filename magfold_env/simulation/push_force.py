"""What a feed needs."""

import math
from typing import cast

import numpy as np

from magfold_env.engine import entries as at
from magfold_env.engine.chain import feed
from magfold_env.engine.contact import constraints
from magfold_env.engine.friction import held
from magfold_env.engine.magnets import chain
from magfold_env.engine.state import Array, Loads, Model, State, Work


def push_force(model: Model, state: State, work: Work) -> float:
    """Return the force along the tube that the feed needs at this moment [N].

    By Newton's law for the chain: the mass times the acceleration of what is outside, less the
    friction of the floor and the forces of the walls on it; inside the tube nothing rubs. Negative
    where the chain pulls. The pull of a fixed external magnet on components inside the tube is left
    out. No number where the contact forces are not found. The chain stays as it is; ``work`` is
    that of another: what a run carries over from step to step must not change.
    """
    state = state._replace(
        **{name: cast("Array", array).copy() for name, array in state._asdict().items()}
    )
    lo, n = int(state.counter[at.LO]), model.n
    if lo in (0, n):
        return 0.0
    if constraints.begin_step(model, state, work) not in (constraints.OK, constraints.IMPACT):
        return math.nan
    # Rows that are not used have no force then.
    work.rows.multiplier[:] = 0.0
    work.rows.jacobian[:] = 0.0
    out = work.stages.slope_v[0]
    if not held.first_accelerations(model, state, work, out):
        return math.nan
    momentum = _momentum_rate(lo, model, work, out)
    outside = work.chain.force[n] + float(work.rows.multiplier @ work.rows.jacobian[:, n])
    return momentum - outside + _pull_of_held(lo, model, state, work)


def _momentum_rate(lo: int, model: Model, work: Work, acceleration: Array) -> float:
    """Mass times acceleration along x of the free components [N], centripetal parts left out."""
    bodies = model.bodies
    swing = -work.pose.sin[lo:] * acceleration[lo : model.n]
    hinges = np.concatenate([[0.0], np.cumsum(bodies.length[lo:] * swing)[:-1]])
    return float(bodies.mass[lo:] @ (hinges + bodies.reach[lo:] * swing))


def _pull_of_held(lo: int, model: Model, state: State, work: Work) -> float:
    """Force along x of the magnets inside the tube on those outside [N]."""
    if not model.magnetic:
        return 0.0
    first = feed.place_all(lo, model, state.q, work.pose)
    loads = Loads(*(np.zeros(model.n) for _ in range(3)))
    chain.add_chain_forces(first, lo, model, state.q, work.pose, work.nodes, work.rigid, loads)
    return float(loads.fx[lo:].sum())
