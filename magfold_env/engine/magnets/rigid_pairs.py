"""Pairs of components between which every joint is at its stop: found once and kept.

Their relative pose follows from the stops between them, which one integer to base 3 tells. What
is kept is of that very pose, so it does not depend on how the chain came there.
"""

from __future__ import annotations

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.magnets.lookup import one_slope, two_slopes
from magfold_env.engine.magnets.pairs import casing_pair, spread_charges, spread_nodes
from magfold_env.engine.state import Array, IntArray, Model, Nodes, Rigid, copy

HALF_PI = math.pi / 2.0
AT_STOP = 1e-9  # [rad] a joint this near to its stop is there
LEFT, RIGHT = 1, 2


@kernel
def find_stops(
    first: int, q: Array, charge: Array, known_charge: Array,
    stop: IntArray, reach: IntArray, code: IntArray,
) -> bool:  # fmt: skip
    """Mark the joints at their stops; whether a pair is not known, or not any more.

    ``reach`` is filled with the last component to which each is rigidly joined.
    """
    changed = False
    n = q.size - 2
    for i in range(charge.shape[0]):
        for a in range(charge.shape[1]):
            changed = changed or charge[i, a] != known_charge[i, a]
    for k in range(first + 1, n):
        angle = q[k] - q[k - 1]
        stop[k] = 0
        if abs(abs(angle) - HALF_PI) <= AT_STOP:
            stop[k] = LEFT if angle > 0.0 else RIGHT
    reach[n - 1] = n - 1
    for i in range(n - 2, first - 1, -1):
        reach[i] = reach[i + 1] if stop[i + 1] > 0 else i
    for i in range(first, n):
        stops = 0
        for j in range(i + 1, min(reach[i], i + code.shape[1]) + 1):
            stops = 3 * stops + stop[j]
            changed = changed or code[i, j - i - 1] != stops
    return changed


@inlined
def is_rigid(i: int, j: int, reach: IntArray, code: IntArray) -> bool:
    """Whether component j is rigidly joined to i, and their forces kept."""
    return j <= reach[i] and j - i <= code.shape[1]


@kernel
def renew(first: int, model: Model, nodes: Nodes, rigid: Rigid) -> None:
    """Spread charges that have changed over the nodes, and find what is not known of pairs."""
    changed = False
    for i in range(model.n):
        for a in range(model.charge.shape[1]):
            changed = changed or model.charge[i, a] != rigid.charge[i, a]
    if changed:
        spread_charges(model.magnets, model.charge, nodes)
        for i in range(model.n):
            copy(model.charge[i], rigid.charge[i], 0)
        rigid.code[:] = 0
    for i in range(first, model.n):
        stops = 0
        for j in range(i + 1, min(rigid.reach[i], i + rigid.code.shape[1]) + 1):
            stops = 3 * stops + rigid.stop[j]
            if rigid.code[i, j - i - 1] != stops:
                rigid.code[i, j - i - 1] = stops
                find_rigid(model, i, j, rigid)


@kernel
def find_rigid(model: Model, i: int, j: int, rigid: Rigid) -> None:
    """Keep what the pair does to each other with every joint between exactly at its stop.

    For a pair in the tables these are the slopes by the joints' angles, for others a force and a
    torque in the frame of i.
    """
    kept, nodes = rigid.force[i, j - i - 1], rigid.nodes
    tables = model.magnets.tables
    angle, next_angle = stop_angle(rigid.stop[i + 1]), stop_angle(rigid.stop[j])
    if j - i == 1:
        kept[0] = one_slope(tables, angle, model.charge, i, nodes)
        kept[1] = 0.0
        return
    if j - i == 2:
        kept[0], kept[1] = two_slopes(tables, angle, next_angle, model.charge, i, nodes)
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
    copy(model.charge[i], rigid.charges[0], 0)
    copy(model.charge[j], rigid.charges[1], 0)
    spread_charges(model.magnets, rigid.charges, nodes)
    spread_nodes(0, model.magnets, pose, nodes)
    _, kept[0], kept[1], kept[2] = casing_pair(
        model.magnets, rigid.charges, pose, nodes, 0, 1, False
    )


@inlined
def stop_angle(stop: int) -> float:
    """Angle of a joint at its stop [rad]."""
    return HALF_PI if stop == LEFT else -HALF_PI
