"""Symmetries: a scene ends alike if it is mirrored, turned, or seen from the other end.

A fold that changes when its start moves by 1e-6 rad is not evidence, and errors within the solver's
tolerance may differ between views. A difference therefore counts only if it persists at two much
tighter tolerances and is much larger than either view's change between tolerances.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from magfold_bench.laws.along_folds import SteppedSession
from magfold_bench.laws.outcomes import SAME_WITHIN, hinge_offsets, moved_starts
from magfold_bench.stress.verdict import Verdict
from magfold_env.fold import Fold, FoldStatus
from magfold_env.scene import FixedMagnet, Rectangle, Scene
from magfold_env.scene.base import FrozenModel
from magfold_env.shapes import FloatArray, centres, headings
from magfold_env.simulation.simulate import simulate

MIRRORED = (3, 2, 1, 0)  # faces: front-left <-> front-right, back-left <-> back-right
OTHER_END = (2, 3, 0, 1)
SIZES = ("width", "height", "thickness", "inset")

TURN = 1.0  # [rad], not a multiple of a special angle
ORIGIN = np.zeros(2)
ROUNDING = 1e-9  # [rad]
AT_ONCE = 10**9  # steps without a stop
MOST_STEPS = 100_000  # in longer runs, symmetries are not checked
TIGHTER = (0.1, 0.01)  # factors of the tolerance; below 1e-12 rad, rounding decides
LEAST_TOLERANCE = 1e-12  # [rad]
MORE_STEPS = 10  # factor of the limit of steps
OWN = 0.1  # share of the views' difference; if the tolerance changes more, it decides the end


class End(NamedTuple):
    """How a run ends."""

    status: FoldStatus
    joints: FloatArray
    capped: bool
    """Whether the chain reached the limit of steps, where rounding decides how it ends."""

    @classmethod
    def of(cls, fold: Fold) -> Self:
        """Return how a fold ends."""
        return cls(fold.status, fold.joint_angles, "are the limit" in fold.message)


def check_symmetries(scene: Scene, fold: Fold, verdict: Verdict) -> None:
    """Check that a scene ends alike if it is mirrored, turned, or seen from its other end."""
    if scene.n == 1 or fold.steps > MOST_STEPS:
        return
    if scene.mount == "tube":
        _check_other_end_of_tube(scene, fold, verdict)
    if scene.bumps is not None:
        return  # A train of bumps has no symmetry.
    here, ends = End.of(fold), views(scene)
    if here.capped or any(end.capped for end in ends.values()):
        verdict.notes.append("stopped by the work cap")
        return
    different = {law: end for law, end in ends.items() if not alike(end, here)}
    if different:
        reason = reason_set_aside(scene, here, different)
        if reason:
            verdict.notes.append(reason)
            different = {}
    for law in ends:
        words = ""
        if law in different:
            end = different[law]
            words = f"ends {end.status.value}, {_apart(end.joints, here.joints):.3g} rad off"
        verdict.require(law, law not in different, words)


def views(scene: Scene) -> dict[str, End]:
    """Return how a scene ends if it is mirrored, turned, or seen from its other end."""
    image = end_of(mirrored(scene))
    ends = {"mirror": image._replace(joints=-image.joints)}
    # A chain starts along +x, where turned solids could be in the way.
    if scene.mount != "tube" and not scene.solids:
        ends["rotation"] = turned_end(scene)
    if scene.mount == "free":
        ends["other end"] = _reversed(end_of(seen_from_other_end(scene)))
    return ends


def reason_set_aside(scene: Scene, here: End, different: Mapping[str, End]) -> str:
    """Return the reason why some views may end differently, or an empty string."""
    starts = moved_starts(scene, np.random.default_rng(0))
    if any(not alike(end_of(start), here) for start in starts):
        return "sensitive to 1e-6 rad"
    if any(is_decided_by_error(scene, here, different, tighter) for tighter in TIGHTER):
        return "decided by the solver's error"
    return ""


def is_decided_by_error(
    scene: Scene, here: End, different: Mapping[str, End], tighter: float
) -> bool:
    """Return whether views agree at a tighter tolerance, or change much between tolerances."""
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
    """Simulate a scene and return how it ends."""
    return End.of(simulate(scene))


def turned_end(scene: Scene) -> End:
    """Return how a scene ends if everything is turned, including the chain."""
    session = SteppedSession(turned(scene, TURN), stride=AT_ONCE)
    session.turn(TURN)
    session.settle()
    return End.of(session.fold())


def alike(one: End, other: End) -> bool:
    """Return whether two chains end alike."""
    return one.status is other.status and _apart(one.joints, other.joints) <= SAME_WITHIN


def _check_other_end_of_tube(scene: Scene, fold: Fold, verdict: Verdict) -> None:
    """Check that a fed chain runs identically if its components are counted from the other end."""
    other = simulate(seen_from_other_end(scene))
    same = (other.status, other.time, other.steps) == (fold.status, fold.time, fold.steps)
    off = _apart(_reversed(End.of(other)).joints, fold.joint_angles)
    words = f"ends {other.status.value} at {other.time:.6g} s, {off:.3g} rad off"
    verdict.require("other end", same and off <= ROUNDING, words)


def _reversed(end: End) -> End:
    return end._replace(joints=-end.joints[::-1])


def _apart(one: FloatArray, other: FloatArray) -> float:
    return float(np.abs(one - other).max(initial=0.0))


# --- other views of the same scene -----------------------------------------------------------


def mirrored(scene: Scene) -> Scene:
    """Return the mirror image, in which left becomes right and y becomes −y."""
    changes = faces(scene, MIRRORED, 1) | started(scene, 1)
    return _around(scene.replace(**changes), np.diag([1.0, -1.0]))


def turned(scene: Scene, angle: float, pivot: FloatArray = ORIGIN) -> Scene:
    """Return a scene with its surroundings turned by an angle [rad], the pivot at the origin.

    A scene does not contain a chain's initial heading, so the chain must be turned separately.
    """
    c, s = math.cos(angle), math.sin(angle)
    return _around(scene, np.array([[c, -s], [s, c]]), pivot)


def seen_from_other_end(scene: Scene) -> Scene:
    """Return a free or fed chain with components counted from the other end.

    A free chain then starts along +x with its other end at the origin, so its surroundings move.
    """
    assert scene.mount != "pinned"
    changes = faces(scene, OTHER_END, -1) | started(scene, -1)
    groups: dict[str, FrozenModel] = {"casing": scene.casing, "feed": scene.feed}
    for name, group in groups.items():
        changes[name] = {
            key: value[::-1]
            for key in ("mass", "inertia", "speed")
            if isinstance(value := getattr(group, key, None), tuple)
        }
    changes["feed"]["direction"] = "backward" if scene.feed.direction == "forward" else "forward"
    changes["friction"] = scene.frictions[::-1]
    other = scene.replace(**changes)
    if scene.mount == "tube":
        return other
    assert scene.start_angles is not None
    chain = headings(scene.start_angles)
    last = centres(chain, scene.casing.side)[-1]
    tip = last + 0.5 * scene.casing.diagonal * np.array([np.cos(chain[-1]), np.sin(chain[-1])])
    return turned(other, -(float(chain[-1]) + math.pi), tip)


def faces(scene: Scene, order: Sequence[int], step: int) -> dict[str, Any]:
    """Return the changes that reorder faces and, if ``step`` is −1, reverse the components."""
    changes: dict[str, Any] = {
        "sequence": ["".join(each[k] for k in order) for each in scene.sequence[::step]]
    }
    if scene.magnets is None:
        return changes
    magnets: dict[str, Any] = {}
    for name in (*SIZES, scene.magnets.strength_name):
        value = np.asarray(getattr(scene.magnets, name), dtype=np.float64)
        if value.ndim:
            rows = value[::step] if value.ndim > 1 else value
            magnets[name] = rows[..., list(order)]
    changes["magnets"] = magnets
    return changes


def started(scene: Scene, step: int) -> dict[str, Any]:
    """Return the changes that mirror the start or, if ``step`` is −1, count it from the other end.

    Joint angles change sign either way. Hinges in a tube change to the other side of its axis only
    in the mirror image.
    """
    if scene.mount == "tube":
        return {"start_offsets": -step * hinge_offsets(scene)[::step]}
    return {"start_angles": -np.array(scene.start_angles)[::step]}


def _around(scene: Scene, matrix: FloatArray, pivot: FloatArray = ORIGIN) -> Scene:
    """Return the scene with its surroundings expressed relative to a pivot and along other axes."""

    def placed(each: Rectangle | FixedMagnet) -> dict[str, Any]:
        along = matrix @ [math.cos(each.heading), math.sin(each.heading)]
        return {
            "position": matrix @ (each.position - pivot),
            "heading": math.atan2(along[1], along[0]),
        }

    changes: dict[str, Any] = {
        "gravity": {"in_plane": matrix @ scene.gravity.in_plane},
        "obstacles": [{"size": each.size, **placed(each)} for each in scene.obstacles],
    }
    if scene.field is not None:
        field: dict[str, Any] = {"uniform": matrix @ scene.field.uniform}
        if scene.field.magnet is not None:
            field["magnet"] = placed(scene.field.magnet)
        changes["field"] = field
    return scene.replace(**changes)
