"""What a feed needs."""

import math
from typing import cast

from magfold_env.engine import entries as at
from magfold_env.engine.chain import feed, ledger
from magfold_env.engine.contact import constraints
from magfold_env.engine.friction import held
from magfold_env.engine.state import Array, Model, State, Work


def push_force(model: Model, state: State, work: Work) -> float:
    """Return the force along the tube that the feed needs at this moment [N].

    See `magfold_env.engine.chain.feed.needed_force`; inside the tube nothing rubs. Negative where
    the chain pulls. No number where the contact forces are not found. The chain stays as it is;
    ``work`` is that of another: what a run carries over from step to step must not change.
    """
    state = state._replace(
        **{name: cast("Array", array).copy() for name, array in state._asdict().items()}
    )
    lo, n = int(state.counter[at.LO]), model.n
    if lo in (0, n):
        return 0.0
    if feed.slips(state):
        return float(state.counter[at.SLIPPING]) * ledger.most_force(model, state)
    feed.carry(model, state, work)
    work.chain.base[at.PULL] = 0.0
    if constraints.begin_step(model, state, work) not in (constraints.OK, constraints.IMPACT):
        return math.nan
    out = work.stages.slope_v[0]
    if not held.first_accelerations(model, state, work, out):
        return math.nan
    return float(feed.needed_force(lo, model, work, out))
