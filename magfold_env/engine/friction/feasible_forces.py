"""The forces that constraints and friction can exert: the nearest of them, and its derivative.

A contact pushes, an equality does either, and the friction of a component is in a ball. All is in
the scaled rows of `engine.scaled_rows`, where a force is λ / scale.
"""

from __future__ import annotations

import math

from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.state import Array, Work


@kernel
def project_forces(rows: int, count: int, work: Work, grip: Array, force: Array) -> None:
    """Replace ``force`` (count,) by the nearest that can act."""
    scale = work.newton.scale
    for r in range(rows):
        if work.equality[r] == 0 and force[r] < 0.0:
            force[r] = 0.0
    for r in range(rows, count, 3):
        size = math.sqrt(force[r] ** 2 + force[r + 1] ** 2 + force[r + 2] ** 2) * scale[r]
        radius = grip[work.row_id[r, 0]]
        if size > radius:
            for k in range(r, r + 3):
                force[k] *= radius / size


@kernel
def friction_slope(r: int, penalty: float, work: Work, grip: Array) -> float:
    """Share s and direction u: near t the ball of rows r to r + 2 keeps s (1 − u uᵀ) of a change.

    Within the ball s is 1 and u is 0. Returns s and leaves u in ``work.newton.normal``.
    """
    newton = work.newton
    square = 0.0
    for k in range(r, r + 3):
        newton.normal[k] = newton.force[k] - penalty * newton.rate[k]
        square += newton.normal[k] ** 2
    length = math.sqrt(square)
    size, radius = length * newton.scale[r], grip[work.row_id[r, 0]]
    outside = size > 0.0 and size >= radius
    for k in range(r, r + 3):
        newton.normal[k] = newton.normal[k] / length if outside else 0.0
    if outside:
        return radius / size
    return 1.0 if radius > 0.0 else 0.0


@kernel
def move_forces(
    rows: int, count: int, penalty: float, work: Work, grip: Array, change: Array
) -> None:  # fmt: skip
    """Set ``work.newton.force`` to the projection of t + ``change`` (count,), to first order.

    ``work.newton.projected`` is the projection of t.
    """
    newton = work.newton
    for r in range(rows):
        if work.equality[r] == 1 or newton.projected[r] > 0.0:
            newton.projected[r] += change[r]
    for r in range(rows, count, 3):
        share = friction_slope(r, penalty, work, grip)
        across = 0.0
        for k in range(r, r + 3):
            across += newton.normal[k] * change[k]
        for k in range(r, r + 3):
            newton.projected[k] += share * (change[k] - across * newton.normal[k])
    for r in range(count):
        newton.force[r] = newton.projected[r]
    project_forces(rows, count, work, grip, newton.force)
