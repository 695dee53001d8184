"""The magnets of a chain whose joints keep within their stops, at a fraction of the sums' cost.

Neighbours and components two apart are looked up in splines of their joints' angles; all other
pairs are summed. Where every joint between two components is at its stop their relative pose is
fixed, and what they do to each other is found once and kept. The forces are the gradient of
`energy`, which is that of ``engine.magnets`` to within the splines' error.
"""

from __future__ import annotations

import math

from magfold_env.engine.jit import inlined, kernel
from magfold_env.engine.magnets import (
    act,
    add_forces,
    casing_pair,
    energy,
    spread_charges,
    spread_nodes,
)
from magfold_env.engine.pair_lookup import one_apart, two_apart
from magfold_env.engine.state import Array, Model, Nodes, Pose, Rigid

HALF_PI = math.pi / 2.0
AT_STOP = 1e-9  # [rad] a joint this near to its stop is there
LEFT, RIGHT = 1, 2
TABLED = 2  # components at most so far apart are looked up


@kernel
def add_chain_forces(
    first: int, lo: int, model: Model, q: Array, pose: Pose,
    nodes: Nodes, rigid: Rigid, fx: Array, fy: Array, torque: Array,
) -> None:  # fmt: skip
    """Add the magnets' forces [N] and torques [N·m] on components ``lo`` on.

    Components ``first`` on are charged; those before ``lo`` are held, and nothing is added for
    pairs of them. Energies of joint angles act as torques alone: they are generalised forces of
    the headings ``q``.
    """
    if not (model.contact and model.magnets.tables.end > 0.0):
        add_forces(first, model.magnets, model.charge, pose, nodes, fx, fy, torque)
        return
    n = model.n
    notice_charges(model, nodes, rigid)
    find_stops(first, q, rigid)
    spread_nodes(first, model.magnets, pose, nodes)
    for i in range(first, n):
        if not is_charged(model.charge, i):
            continue
        code = 0
        joined = True
        for j in range(i + 1, n):
            joined = joined and rigid.stop[j] > 0 and j - i <= rigid.code.shape[1]
            code = 3 * code + rigid.stop[j] if joined else 0
            if j < lo or not is_charged(model.charge, j):
                continue
            if joined:
                if rigid.code[i, j - i - 1] != code:
                    rigid.code[i, j - i - 1] = code
                    find_rigid(model, i, j, rigid)
                add_rigid(i, j, pose, rigid, fx, fy, torque)
            elif j - i <= TABLED:
                slope, next_slope = slopes(
                    model, i, j, q[i + 1] - q[i], q[j] - q[i + 1], model.charge, nodes
                )
                bend(i, j, slope, next_slope, torque)
            else:
                _, px, py, t = casing_pair(model.magnets, model.charge, pose, nodes, i, j, False)
                act(pose, i, j, px, py, t, fx, fy, torque)


@inlined
def is_charged(charge: Array, i: int) -> bool:
    """Whether component i has any magnet."""
    return charge[i, 0] != 0.0 or charge[i, 1] != 0.0 or charge[i, 2] != 0.0 or charge[i, 3] != 0.0


@inlined
def notice_charges(model: Model, nodes: Nodes, rigid: Rigid) -> None:
    """If a charge has changed, spread them anew and forget what was kept."""
    charge = model.charge
    changed = False
    for i in range(charge.shape[0]):
        for a in range(charge.shape[1]):
            changed = changed or charge[i, a] != rigid.charge[i, a]
    if changed:
        spread_charges(model.magnets, charge, nodes)
        rigid.charge[:] = charge
        rigid.code[:] = 0


@inlined
def find_stops(first: int, q: Array, rigid: Rigid) -> None:
    """Mark the joints at their stops."""
    for k in range(first + 1, rigid.stop.size):
        angle = q[k] - q[k - 1]
        rigid.stop[k] = 0
        if abs(abs(angle) - HALF_PI) <= AT_STOP:
            rigid.stop[k] = LEFT if angle > 0.0 else RIGHT


@inlined
def slopes(
    model: Model, i: int, j: int, angle: float, next_angle: float, charge: Array, nodes: Nodes
) -> tuple[float, float]:
    """Slopes of a looked-up pair's energy by the joint behind i + 1 and the next one [N·m]."""
    tables = model.magnets.tables
    if j - i == 1:
        return one_apart(tables, angle, 1, charge, i, nodes), 0.0
    return two_apart(tables, angle, next_angle, True, charge, i, nodes)


@inlined
def bend(i: int, j: int, slope: float, next_slope: float, torque: Array) -> None:
    """Add the torques of an energy with the given slopes by the joints' angles."""
    torque[i] += slope
    torque[i + 1] -= slope
    if j > i + 1:
        torque[i + 1] += next_slope
        torque[j] -= next_slope


@kernel
def find_rigid(model: Model, i: int, j: int, rigid: Rigid) -> None:
    """Keep what the pair does to each other with every joint between exactly at its stop."""
    kept = rigid.force[i, j - i - 1]
    if j - i <= TABLED:
        angle, next_angle = stop_angle(rigid.stop[i + 1]), stop_angle(rigid.stop[j])
        kept[0], kept[1] = slopes(model, i, j, angle, next_angle, model.charge, rigid.nodes)
        return
    pose, bodies = rigid.pose, model.bodies
    pose.cos[0], pose.sin[0], pose.x[0], pose.y[0] = 1.0, 0.0, 0.0, 0.0
    c, s = 1.0, 0.0
    x, y = bodies.length[i] - bodies.reach[i], 0.0
    for k in range(i + 1, j + 1):
        c, s = (-s, c) if rigid.stop[k] == LEFT else (s, -c)
        along = bodies.reach[k] if k == j else bodies.length[k]
        x += along * c
        y += along * s
    pose.cos[1], pose.sin[1], pose.x[1], pose.y[1] = c, s, x, y
    rigid.charges[0] = model.charge[i]
    rigid.charges[1] = model.charge[j]
    spread_charges(model.magnets, rigid.charges, rigid.nodes)
    spread_nodes(0, model.magnets, pose, rigid.nodes)
    _, kept[0], kept[1], kept[2] = casing_pair(
        model.magnets, rigid.charges, pose, rigid.nodes, 0, 1, False
    )


@inlined
def add_rigid(
    i: int, j: int, pose: Pose, rigid: Rigid, fx: Array, fy: Array, torque: Array
) -> None:
    """Add what is kept of a pair: slopes by angles, or a force that turns with component i."""
    k = j - i - 1
    u, v, t = rigid.force[i, k, 0], rigid.force[i, k, 1], rigid.force[i, k, 2]
    if k < TABLED:
        bend(i, j, u, v, torque)
    else:
        c, s = pose.cos[i], pose.sin[i]
        act(pose, i, j, c * u - s * v, s * u + c * v, t, fx, fy, torque)


@inlined
def stop_angle(stop: int) -> float:
    """Angle of a joint at its stop [rad]."""
    return HALF_PI if stop == LEFT else -HALF_PI


@kernel
def chain_energy(first: int, model: Model, q: Array, pose: Pose, nodes: Nodes) -> float:
    """Energy of all pairs of components ``first`` on [J] whose gradient `add_chain_forces` is."""
    if not (model.contact and model.magnets.tables.end > 0.0):
        return energy(first, model.magnets, model.charge, pose, nodes)
    tables = model.magnets.tables
    spread_charges(model.magnets, model.charge, nodes)
    spread_nodes(first, model.magnets, pose, nodes)
    total = 0.0
    for i in range(first, model.n):
        for j in range(i + 1, model.n):
            angle, next_angle = q[i + 1] - q[i], q[j] - q[i + 1]
            if j - i == 1:
                total += one_apart(tables, angle, 0, model.charge, i, nodes)
            elif j - i <= TABLED:
                total += two_apart(tables, angle, next_angle, False, model.charge, i, nodes)[0]
            else:
                total += casing_pair(model.magnets, model.charge, pose, nodes, i, j, True)[0]
    return total
