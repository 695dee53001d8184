"""How runs end: statuses and their messages."""

import math
from collections.abc import Sequence

from magfold_env.engine import outcomes
from magfold_env.engine.state import Model
from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene

FOLDED_WITHIN = 0.05  # [rad] of ±90°
BREAKDOWNS = {
    outcomes.CAPPED: (FoldStatus.UNSETTLED, "stopped {at}: {limit} are the limit"),
    outcomes.UNDERFLOW: (FoldStatus.FAILED, "step size underflow {at}: tolerance out of reach"),
    outcomes.TOO_CROWDED: (FoldStatus.FAILED, "more contacts than there is room for {at}"),
    outcomes.JAMMED: (FoldStatus.JAMMED, "jammed {at}: the drive slipped for 0.1 s"),
    outcomes.LOCKED: (FoldStatus.JAMMED, "jammed {at}: nothing gives way to a drive without limit"),
    outcomes.RAN_AWAY: (FoldStatus.FAILED, "ran away {at}: the feed drives what cannot give way"),
    outcomes.NO_SOLUTION: (FoldStatus.FAILED, "contact and friction forces not found {at}"),
    outcomes.NOT_FINITE: (FoldStatus.FAILED, "accelerations are not finite {at}"),
}


def ending(
    outcome: int, time: float, joints: list[float], limit: str, inside: int = 0
) -> tuple[FoldStatus, str]:
    """Return the status of a run and its message.

    The arguments are the outcome of the integration and its time [s]. ``joints`` are the angles at
    that time [rad], ``limit`` is the text of the work limit, and ``inside`` is the number of
    components in the tube.
    """
    if outcome == outcomes.TIMED_OUT:
        return FoldStatus.UNSETTLED, f"still moving after {time:.4g} s"
    if outcome != outcomes.RESTED:
        status, reason = BREAKDOWNS[outcome]
        return status, reason.format(at=f"at t = {time:.6g} s", limit=limit)
    if inside > 0:
        held = "a component" if inside == 1 else f"{inside} components"
        return FoldStatus.HELD, f"at rest at t = {time:.4g} s with {held} in the tube"
    straight = [
        number
        for number, angle in enumerate(joints, 1)
        if abs(abs(angle) - math.pi / 2.0) > FOLDED_WITHIN
    ]
    if not straight:
        return FoldStatus.FOLDED, f"folded at t = {time:.4g} s"
    return FoldStatus.MISFOLDED, f"at rest at t = {time:.4g} s with {named(straight)} open"


def obstacle_names(scene: Scene) -> list[str]:
    """Return the names of a scene's solids, in their order."""
    walls = ["the tube's left wall", "the tube's right wall"] if scene.mount == "tube" else []
    fixed = ["the fixed magnet"] if scene.field is not None and scene.field.magnet else []
    return [*walls, *fixed, *(f"obstacles[{k}]" for k in range(len(scene.obstacles)))]


def named(joints: Sequence[int]) -> str:
    """Return the numbers of some joints as text, such as "joint 2" or "joints 1, 3 to 9, 12"."""
    starts = [joint for joint in joints if joint - 1 not in joints]
    ends = [joint for joint in joints if joint + 1 not in joints]
    runs = [
        f"{start} to {end}" if end > start + 1 else ", ".join(map(str, range(start, end + 1)))
        for start, end in zip(starts, ends, strict=True)
    ]
    return f"joint{'s' if len(joints) > 1 else ''} {', '.join(runs)}"


def work_cap(model: Model, steps: int) -> str:
    """Return the text of the work limit that a run reached after a number of steps."""
    if steps >= model.max_steps:
        return f"{model.max_steps} steps"
    return f"{model.max_steps_per_second} steps a second"
