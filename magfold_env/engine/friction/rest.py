"""Chains that need no more integration."""

from __future__ import annotations

from magfold_env.engine.chain.feed import is_free
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact.constraints import first_joint
from magfold_env.engine.state import LO, Array, Model, State, Work

ROUNDING = 1e-9  # of accelerations, as a share of typical ones


@kernel
def is_at_rest(model: Model, state: State, work: Work, acceleration: Array) -> bool:
    """Whether nothing will move again, relative to the base while the tube feeds.

    Either friction holds every component; or no joint turns and none will, because stops press
    with more than friction could lift, or because rates and accelerations are far below the
    tolerance and the base does not move by itself. In a field from outside the whole chain must
    be at rest.
    """
    lo, n = state.counter[LO], model.n
    free = is_free(lo, model)
    if model.frictional:
        held = True
        for i in range(lo, n):
            held = held and state.stuck[i] == 1
        if held:
            state.v[lo:] = 0.0
            return True
    # A pinned chain that nothing holds or pulls turns about its pin as a free one turns in space.
    spins = free or (model.pinned and not model.frictional and not pulled(model))
    spins = spins and (n > 1 or free) and not model.field.present
    slow = 1e-3 * model.tolerance
    turning, speeding_up = relative_motion(lo, n, spins, state.v, acceleration, slow)
    if free and model.field.present:
        # Where a field from outside acts, a chain that moves on as one body may bend again.
        for k in range(n, n + 2):
            turning = max(turning, abs(state.v[k]) / model.side)
            speeding_up = max(speeding_up, abs(acceleration[k]) / model.side)
    rounding = ROUNDING * model.rate_scale**2
    quiet = turning <= slow
    quiet = quiet and speeding_up <= max(0.1 * model.tolerance, rounding)
    if not quiet:
        return False
    if not free:
        # Contacts with the walls end as the base moves on.
        return lo == 0 or work.row_count[1] == work.row_count[0]
    if not model.frictional:
        return True
    return stops_press(lo, model, state, work)


@inlined
def pulled(model: Model) -> bool:
    """Whether gravity acts in the plane."""
    return model.gravity_x != 0.0 or model.gravity_y != 0.0


@kernel
def relative_motion(
    lo: int, n: int, spins: bool, v: Array, a: Array, slow: float
) -> tuple[float, float]:
    """Largest relative rate [rad/s] and relative angular acceleration [rad/s²] of a joint.

    The first component counts as a joint too unless it ``spins`` freely. No more joints are looked
    at once one is not ``slow`` [rad/s].
    """
    rate, acceleration = 0.0, 0.0
    for k in range(lo, n):
        if k > lo:
            rate = max(rate, abs(v[k] - v[k - 1]))
            acceleration = max(acceleration, abs(a[k] - a[k - 1]))
        elif not spins:
            rate = abs(v[k])
            acceleration = abs(a[k])
        if rate > slow:
            break
    return rate, acceleration


@kernel
def stops_press(lo: int, model: Model, state: State, work: Work) -> bool:
    """Whether all joints are at stops that press harder than friction on the floor could lift.

    What slides on as one rigid body then stays one.
    """
    grip = 0.0
    for i in range(lo, model.n):
        grip += model.grip[i]
    lift = grip * model.bodies.length[0] * (model.n - lo)
    for k in range(first_joint(lo), model.n):
        if state.lock[k] == 0:
            return False
    for r in range(work.row_count[0]):
        if work.multiplier[r] < lift:
            return False
    return True
