"""The engine's magnets at many states in one compiled loop, so that calls cost nothing.

Nothing else in this benchmark calls the engine's kernels.
"""

from __future__ import annotations

from typing import NamedTuple

from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.magnets.chain import add_chain_forces
from magfold_env.engine.magnets.outer_field import add_field
from magfold_env.engine.magnets.pairs import add_forces
from magfold_env.engine.state import Array, IntArray, Loads, Magnets, Model, Nodes, Pose, Rigid


class States(NamedTuple):
    """Where a chain is, in some states."""

    first: IntArray  # first component that is charged, (states,)
    lo: IntArray  # first component that is free, (states,)
    q: Array  # headings and base as the dynamics have them, (states, n + 2) [rad, m]
    poses: Pose  # of the components, each array of shape (states, n)


@allocating_kernel
def sum_forces(
    times: int, magnets: Magnets, charge: Array, poses: Pose, nodes: Nodes, out: Loads
) -> None:
    """Sum over the nodes of casings anywhere.

    Parameters
    ----------
    times
        How often to do it all.
    charge : (states, n, 4) array
        Of the outer pole faces [A·m].
    poses
        Of the casings, each array of shape (states, n).
    """
    for _ in range(times):
        for k in range(charge.shape[0]):
            clear(k, out)
            pose = Pose(poses.cos[k], poses.sin[k], poses.x[k], poses.y[k])
            loads = Loads(out.fx[k], out.fy[k], out.torque[k])
            add_forces(0, magnets, charge[k], pose, nodes, loads)


@allocating_kernel
def chain_forces(
    times: int, model: Model, states: States, nodes: Nodes, rigid: Rigid, out: Loads
) -> None:
    """Do ``times`` times what the dynamics do, look-ups and all, at states of one chain.

    A field from outside acts where the scene has one.
    """
    poses = states.poses
    for _ in range(times):
        for k in range(states.first.size):
            clear(k, out)
            if not model.magnetic:
                continue
            pose = Pose(poses.cos[k], poses.sin[k], poses.x[k], poses.y[k])
            loads, lo = Loads(out.fx[k], out.fy[k], out.torque[k]), states.lo[k]
            add_chain_forces(
                states.first[k], lo, model, states.q[k], pose, nodes, rigid, loads
            )  # fmt: skip
            if model.field.present:
                add_field(lo, model, pose, nodes, loads)


@allocating_kernel
def clear(k: int, out: Loads) -> None:
    """Set the loads of a state to zero."""
    for i in range(out.fx.shape[1]):
        out.fx[k, i] = 0.0
        out.fy[k, i] = 0.0
        out.torque[k, i] = 0.0
