"""Generalised forces of the magnets on many shapes of one pinned chain."""

from __future__ import annotations

from magfold_env.engine.arrays import copy
from magfold_env.engine.chain import articulated
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.magnets.outer_field import add_magnet_forces
from magfold_env.engine.state import Array, Model, Work


@kernel
def magnet_loads(model: Model, headings: Array, work: Work, out: Array) -> None:
    """Fill ``out`` (shapes, n) [N·m] for headings (shapes, n) [rad]."""
    n = model.n
    q = work.stage_q
    q[n] = 0.0
    q[n + 1] = 0.0
    for shape in range(headings.shape[0]):
        copy(headings[shape], q, 0)
        articulated.place(0, model.bodies, q, work.pose)
        work.fx[:] = 0.0
        work.fy[:] = 0.0
        work.torque[:] = 0.0
        add_magnet_forces(0, model, work.pose, work.nodes, work.fx, work.fy, work.torque)
        articulated.generalise(
            0, model.bodies, work.pose, work.fx, work.fy, work.torque, work.force
        )
        for k in range(n):
            out[shape, k] = work.force[k]
