"""A chain as a web page shows it: its pose, letters and energies, and how its run ended."""

import math
from typing import Annotated, NamedTuple

from magfold_env.engine import indices as ix
from magfold_env.engine import outcomes
from magfold_env.engine.chain import momentum, tube
from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.magnets.chain import magnet_energy, potential_energy
from magfold_env.engine.state import (
    Array,
    IntArray,
    IntPerBody,
    Model,
    PerBody,
    Record,
    State,
    Work,
)
from magfold_env.fold import FoldStatus
from magfold_env.simulation.endings import FOLDED_WITHIN
from magfold_env.simulation.view import public_state

# `View.energy`: magnetic, of active magnets only, and kinetic [J].
MAGNETIC, KINETIC = range(2)
# `View.feed`: the time [s], the feed's travel [m], its mean force since the previous frame [N], and
# that frame's time [s] and impulse of the drive [N·s].
TIME, ADVANCE, PUSH, BEFORE, IMPULSE = range(5)
# `View.number`: numbers of components out of the tube, and of components with their magnets.
RELEASED, LOADED = range(2)

STATUSES = tuple(FoldStatus)
_FOLDED, _MISFOLDED = STATUSES.index(FoldStatus.FOLDED), STATUSES.index(FoldStatus.MISFOLDED)
_HELD, _UNSETTLED = STATUSES.index(FoldStatus.HELD), STATUSES.index(FoldStatus.UNSETTLED)
BY_BREAKDOWN = -1  # the status is in `endings.BREAKDOWNS`

AT_MOUTH = 1e-6  # [sides] tolerance for a leading hinge to count as outside, see `fold.loaded`


@by_pointer
class View(NamedTuple):
    """A chain at one moment, component 1 first; see `simulation.view.ChainState`."""

    heading: PerBody  # [rad]
    rate: PerBody  # [rad/s]
    base: Annotated[Array, 2]  # [m]
    velocity: Annotated[Array, 2]  # of the base [m/s]
    letter: IntPerBody  # of the joints: 1 L, 0 S, −1 R; the last is unused
    energy: Annotated[Array, 2]
    feed: Annotated[Array, 5]
    number: Annotated[IntArray, 2]


@kernel
def look(
    flip: int, model: Model, state: State, work: Work, record: Record, view: View, frame: int
) -> None:
    """Fill in the view of a recorded frame, or of the present state if ``frame`` is negative.

    ``flip`` is 1 if the engine counts from component n. Do not pass the run's own scratch space.
    The feed's travel is always the present one.
    """
    n = model.n
    lo, q, v = state.counter[ix.N_HELD], state.q, state.v
    time, impulse = state.clock[ix.TIME], state.account[ix.IMPULSE]
    if frame >= 0:
        lo, q, v = record.lo[frame], record.q[frame], record.v[frame]
        time, impulse = record.time[frame], record.impulse[frame]
    public_state(
        flip == 1, lo, model.bodies.length, q, v,
        view.heading, view.rate, view.base, view.velocity,
    )  # fmt: skip
    for k in range(n - 1):
        view.letter[k] = letter(view.heading[k + 1] - view.heading[k])
    view.energy[KINETIC] = momentum.kinetic_of(lo, model, work, q, v)
    first = tube.place_all(lo, model, q, work.pose)
    # Recorded frames, often hundreds, use the dynamics' tables, within the magnets' accuracy.
    view.energy[MAGNETIC] = (
        magnet_energy(first, model, work) if frame < 0 else potential_energy(first, model, q, work)
    )
    view.number[RELEASED] = n - lo
    view.number[LOADED] = loaded(model, lo, q[n])
    since = time - view.feed[BEFORE]
    view.feed[PUSH] = (impulse - view.feed[IMPULSE]) / since if since > 0.0 else 0.0
    view.feed[TIME] = time
    view.feed[ADVANCE] = tube.advance(model, state) if lo > 0 else model.bodies.length.sum()
    if frame >= 0:
        view.feed[BEFORE], view.feed[IMPULSE] = time, impulse


@kernel
def letter(angle: float) -> int:
    """Return the letter nearest to a joint's angle [rad]; the thresholds are ±45°."""
    turn = 2.0 * math.pi
    angle -= turn * math.floor(angle / turn + 0.5)
    return int(angle > 0.25 * math.pi) - int(angle < -0.25 * math.pi)


@kernel
def loaded(model: Model, lo: int, base: float) -> int:
    """Return how many components have magnets; ``base`` is the engine's first hinge's x [m]."""
    if not model.at_mouth:
        return model.n
    count = 0
    # Start from the outermost held component, or from the last one if none is held.
    for behind in range(0 if lo > 0 else 1, model.n - lo + 1):
        count += int(base + behind * model.bodies.length[0] > AT_MOUTH * model.side)
    return count


@kernel
def ending(outcome: int, state: State, view: View) -> int:
    """Return the index in STATUSES of a run's status, or BY_BREAKDOWN; ``view`` is from `look`."""
    if outcome == outcomes.TIMED_OUT:
        return _UNSETTLED
    if outcome != outcomes.RESTED:
        return BY_BREAKDOWN
    if state.counter[ix.N_HELD] > 0:
        return _HELD
    for k in range(view.heading.size - 1):
        angle = view.heading[k + 1] - view.heading[k]
        if abs(abs(angle) - math.pi / 2.0) > FOLDED_WITHIN:
            return _MISFOLDED
    return _FOLDED
