"""Symmetric scenes fold symmetrically.

A fold that a start moved by 1e-6 rad changes as well says nothing, and the error that the solver's
tolerance allows may differ between views: what differs must do so at two far tighter ones too, and
far more than either view does from one tolerance to another.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from magfold_env.fold import Fold, FoldStatus
from magfold_env.laws.along_folds import SteppedSession
from magfold_env.laws.outcomes import SAME_WITHIN, moved_starts
from magfold_env.scene import Scene
from magfold_env.simulation.simulate import simulate
from magfold_env.stress.symmetry import mirrored, seen_from_other_end, turned
from magfold_env.stress.verdict import Verdict

Floats = npt.NDArray[np.float64]

TURN = 1.0  # [rad], no multiple of anything
ROUNDING = 1e-9  # [rad]
AT_ONCE = 10**9  # steps without a look
MOST_STEPS = 100_000  # of a run that is worth repeating
TIGHTER = (0.1, 0.01)  # times the tolerance: rounding decides below 1e-12 rad
LEAST_TOLERANCE = 1e-12  # [rad]
MORE_STEPS = 10  # times as many
OWN = 0.1  # of what views differ by: more from the tolerance alone, and that decides


class End(NamedTuple):
    """How a chain ends."""

    status: FoldStatus
    joints: Floats
    capped: bool
    """Whether its steps were too many: where that stops a chain depends on rounding."""

    @classmethod
    def of(cls, fold: Fold) -> End:
        """Return how a fold ends."""
        return cls(fold.status, fold.joint_angles, "are the limit" in fold.message)


def hold_symmetries(scene: Scene, fold: Fold, verdict: Verdict) -> None:
    """Mirror it, turn it and look at it from its other end."""
    if scene.n == 1 or fold.steps > MOST_STEPS:
        return
    if scene.mount == "tube":
        _hold_other_end_of_tube(scene, fold, verdict)
    here, ends = End.of(fold), views(scene)
    if here.capped or any(end.capped for end in ends.values()):
        verdict.notes.append("stopped by the work cap")
        return
    different = {law: end for law, end in ends.items() if not alike(end, here)}
    if different:
        reason = excuse(scene, here, different)
        if reason:
            verdict.notes.append(reason)
            different = {}
    for law in ends:
        words = ""
        if law in different:
            end = different[law]
            words = f"ends {end.status.value}, {_apart(end.joints, here.joints):.3g} rad off"
        verdict.demand(law, law not in different, words)


def views(scene: Scene) -> dict[str, End]:
    """Return how a scene ends that is mirrored, turned, looked at from its other end."""
    ends: dict[str, End] = {"mirror": _flipped(end_of(mirrored(scene)))}
    if scene.mount != "tube":
        ends["rotation"] = turned_end(scene)
    if scene.mount == "free":
        ends["other end"] = _reversed(end_of(seen_from_other_end(scene)))
    return ends


def excuse(scene: Scene, here: End, different: Mapping[str, End]) -> str:
    """Return why some views may end otherwise, nothing if they may not."""
    if is_sensitive(scene, here):
        return "sensitive to 1e-6 rad"
    if any(is_decided_by_error(scene, here, different, tighter) for tighter in TIGHTER):
        return "decided by the solver's error"
    return ""


def is_decided_by_error(
    scene: Scene, here: End, different: Mapping[str, End], tighter: float
) -> bool:
    """Whether views agree at a tighter tolerance, or change much from one to the other."""
    solver = scene.solver
    tight = scene.replace(
        solver={
            "tolerance": max(tighter * solver.tolerance, LEAST_TOLERANCE),
            "max_steps": MORE_STEPS * solver.max_steps,
        }
    )
    end, others = end_of(tight), views(tight)
    own = _apart(end.joints, here.joints)
    unsure = any(
        max(own, _apart(others[law].joints, view.joints)) > OWN * _apart(view.joints, here.joints)
        for law, view in different.items()
    )
    return end.capped or unsure or all(alike(others[law], end) for law in different)


def end_of(scene: Scene) -> End:
    """Return how a scene ends."""
    return End.of(simulate(scene))


def turned_end(scene: Scene) -> End:
    """Return how a scene ends when all of it, the chain included, is turned."""
    session = SteppedSession(turned(scene, TURN), stride=AT_ONCE)
    session.turn(TURN)
    session.run()
    return End.of(session.fold())


def alike(one: End, other: End) -> bool:
    """Whether two chains end alike."""
    return one.status is other.status and _apart(one.joints, other.joints) <= SAME_WITHIN


def is_sensitive(scene: Scene, end: End) -> bool:
    """Whether the fold changes when its start is moved by 1e-6 rad."""
    starts = moved_starts(scene, np.random.default_rng(0))
    return any(not alike(end_of(start), end) for start in starts)


def _hold_other_end_of_tube(scene: Scene, fold: Fold, verdict: Verdict) -> None:
    """Ask for one run from both views, bit for bit: the engine counts from the held end."""
    other = simulate(seen_from_other_end(scene))
    same = (other.status, other.time, other.steps) == (fold.status, fold.time, fold.steps)
    off = _apart(_reversed(End.of(other)).joints, fold.joint_angles)
    words = f"ends {other.status.value} at {other.time:.6g} s, {off:.3g} rad off"
    verdict.demand("other end", same and off <= ROUNDING, words)


def _flipped(end: End) -> End:
    return end._replace(joints=-end.joints)


def _reversed(end: End) -> End:
    return end._replace(joints=-end.joints[::-1])


def _apart(one: Floats, other: Floats) -> float:
    return float(np.abs(one - other).max(initial=0.0))
