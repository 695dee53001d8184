"""Hops too small to see: they are ended at once instead of followed."""

from __future__ import annotations

from magfold_env.engine.chain import articulated
from magfold_env.engine.chain.feed import place_all
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import boxes, jacobian
from magfold_env.engine.contact.complementarity import solve_nonnegative
from magfold_env.engine.contact.constraints import (
    AT_STOP,
    IMPACT,
    OK,
    UNSOLVED,
    collect_rows,
    first_joint,
    leave,
    prepare,
)
from magfold_env.engine.state import LO, Array, Model, State, Work
from magfold_env.engine.stepping.dynamics import apply_multipliers, rate_of

HOP = 0.05  # share of the tolerance by which something may part and touch again unseen


@kernel
def end_hops(model: Model, state: State, work: Work, acceleration: Array) -> int:
    """Hold what left its stop, or a square it touched, but would be back before anyone could see.

    An impact throws joints and corners elsewhere off what they touch, and the magnets or the feed
    then press them shut again: ever smaller hops, each with an impact. Those of less than `HOP` of
    the tolerance are left out: the velocity becomes the nearest one at which these stay in touch,
    and what stayed anyway. ``acceleration`` is that of the state. Returns OK, IMPACT
    (velocities changed) or UNSOLVED: no such velocity was found, they are left to hop, and rows
    must be filled anew.
    """
    lo = state.counter[LO]
    work.mark[:] = 0
    found = False
    for k in range(first_joint(lo), model.n):
        angle = state.q[k] - state.q[k - 1]
        if state.lock[k] != 0 or abs(angle) < jacobian.HALF_PI - AT_STOP:
            continue
        side = 1 if angle > 0.0 else -1
        rate, pull = side * state.v[k], side * acceleration[k]
        if k > lo:
            rate -= side * state.v[k - 1]
            pull -= side * acceleration[k - 1]
        if pull > 0.0 and rate * rate < 2.0 * pull * HOP * model.tolerance:
            state.lock[k] = side
            work.mark[k] = 1
            found = True
    found = mark_hopping_contacts(lo, model, state, work, acceleration) or found
    if not found:
        return OK
    dropped = work.row_count[3]
    rows = collect_rows(lo, model, state, work)
    prepare(lo, model, state.v, work)
    for r in range(rows):
        work.bias[r] = rate_of(lo, work, r, state.v)
        work.equality[r] = int(r < work.row_count[0] or stays(work, r, dropped))
        work.passive[r] = 1
    solved = solve_nonnegative(rows, work)
    if solved:
        apply_multipliers(lo, rows, work, state.v)
    else:
        for k in range(model.n):
            if work.mark[k] == 1:
                state.lock[k] = 0
        collect_rows(lo, model, state, work)
    leave(lo, model, state, work)
    return IMPACT if solved else UNSOLVED


@kernel
def mark_hopping_contacts(
    lo: int, model: Model, state: State, work: Work, acceleration: Array
) -> bool:
    """Mark the contacts let go that will be back after an unseen hop; whether there are any."""
    if work.row_count[3] == 0:
        return False
    found = False
    place_all(lo, model, state.q, work.pose)
    boxes.place_boxes(boxes.first_box(lo), model, work.pose, work)
    articulated.centre_velocities(lo, model.bodies, work.pose, state.v, work.vx, work.vy)
    articulated.centripetal(lo, model.bodies, work.pose, state.v, work.ax, work.ay)
    for d in range(work.row_count[3]):
        r = work.bias.size - 1 - d
        jacobian.contact_row(lo, model, work.pose, work, r, state.v)
        rate = rate_of(lo, work, r, state.v)
        pull = -work.bias[r] - rate_of(lo, work, r, acceleration)
        hop = pull > 0.0 and rate * rate < 2.0 * pull * HOP * model.tolerance * model.side
        work.row_id[r, 3] = int(hop)
        found = found or hop
    return found


@inlined
def stays(work: Work, r: int, dropped: int) -> bool:
    """Whether row r was not let go, or is one that `mark_hopping_contacts` marked."""
    for d in range(dropped):
        s = work.bias.size - 1 - d
        same = work.row_id[s, 3] == 0
        for k in range(3):
            same = same and work.row_id[s, k] == work.row_id[r, k]
        if same:
            return False
    return True
