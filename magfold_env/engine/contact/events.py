"""The moment, inside a step, when something new touches."""

from __future__ import annotations

from magfold_env.engine.chain.feed import place_all
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.contact import boxes, jacobian
from magfold_env.engine.contact.constraints import first_joint
from magfold_env.engine.state import LO, Array, Model, State, Work
from magfold_env.engine.stepping.dormand_prince import DENSE, STAGES

STALLED = -1.0
NEAR_ENOUGH = 1e-10  # [rad, or of the side]
ROUNDING = 1e-14


@kernel
def interpolate(y: Array, slopes: Array, step: float, fraction: float, out: Array) -> None:
    """Dense output of the step at ``fraction`` of it."""
    for k in range(y.size):
        out[k] = y[k]
    for s in range(STAGES):
        w = 0.0
        for j in range(3, -1, -1):
            w = (w + DENSE[s, j]) * fraction
        w *= step
        for k in range(y.size):
            out[k] += w * slopes[s, k]


@kernel
def margin(model: Model, state: State, q: Array, work: Work) -> float:
    """How far the coordinates are from a new touch, as a share of the side or in radians.

    Negative means that something touched before. What touches already, in the rows of the step,
    does not count.
    """
    lo = state.counter[LO]
    worst = 1.0
    for k in range(first_joint(lo), model.n):
        if state.lock[k] == 0:
            worst = min(worst, jacobian.HALF_PI - abs(q[k] - q[k - 1]))
    if model.n <= boxes.APART and not (model.tube or model.field.solid):
        return worst
    place_all(lo, model, q, work.pose)
    boxes.place_boxes(boxes.first_box(lo), model, work.pose, work)
    for i in range(boxes.first_box(lo), model.n):
        j = boxes.next_partner(model, lo, i, i)
        while j < model.n + boxes.OBSTACLES:
            if boxes.may_touch(model, work, i, j):
                wall = model.n <= j < model.n + 2
                for c in range(8):
                    box, other = (i, j) if c < 4 else (j, i)
                    gap = boxes.corner_gap(model, work, box, other, c % 4)
                    if wall and c >= 4:
                        gap = min(gap, -boxes.behind_face(model, work, j, i, c % 4))
                    gap /= model.side
                    if gap < worst and not jacobian.is_row(work, box, other, c % 4):
                        worst = gap
            j = boxes.next_partner(model, lo, i, j)
    return worst


@kernel
def first_touch(model: Model, state: State, step: float, work: Work) -> float:
    """Fraction of the step at which something new touches; 1 if nothing does.

    `STALLED` if something touches that hardly parted: a matter for `moreau_step`.

    Bracketed at the ends and the middle of the step, then located by the Illinois method on the
    dense output, which costs no forces.
    """
    low, at_low = 0.0, 1.0
    high = 0.0
    at_high = 1.0
    for k in range(1, 3):
        high = 0.5 * k
        interpolate(state.q, work.slope_q, step, high, work.stage_q)
        at_high = margin(model, state, work.stage_q, work)
        if at_high < 0.0:
            break
        low, at_low = high, at_high
    if at_high >= 0.0:
        return 1.0
    if low == 0.0:
        at_low = margin(model, state, state.q, work)
    if at_low < NEAR_ENOUGH:
        return STALLED if low == 0.0 else low
    left = at_low
    kept = 0
    for _ in range(60):
        # The state at the event must be one that is allowed: stay on the near side of it.
        if left < NEAR_ENOUGH or high - low < ROUNDING:
            break
        middle = high - at_high * (high - low) / (at_high - at_low)
        if not low < middle < high:
            middle = 0.5 * (low + high)
        interpolate(state.q, work.slope_q, step, middle, work.stage_q)
        value = margin(model, state, work.stage_q, work)
        if value >= 0.0:
            low, at_low, left = middle, value, value
            at_high = at_high * 0.5 if kept == 1 else at_high
            kept = 1
        else:
            high, at_high = middle, value
            at_low = at_low * 0.5 if kept == -1 else at_low
            kept = -1
    return low
