"""Energies of casings one and two joints apart, looked up in splines of their joint angles.

The splines are of degree five on even knots, so four times differentiable; their gradient is
taken exactly. All sixteen pairs of faces have coefficients side by side, a vector's worth at a
time: charges enter last.
"""

from __future__ import annotations

import numpy as np

from magfold_env.engine.jit import inlined, kernel
from magfold_env.engine.state import Array, Nodes, Tables

DEGREE = 5
FACES = 4
PAIRS = FACES * FACES


@inlined
def basis(x: float, last: int, weight: Array, row: int) -> int:
    """Weights of the splines at ``x`` knots from the first; returns the first's number.

    Row ``row`` of ``weight`` gets the DEGREE + 1 values, the next one their slopes by x. Beyond
    the first and the last knot, where only trial steps get, their own values are given.
    """
    x = min(max(x, 0.0), float(last))
    k = min(int(x), last - 1)
    u = x - k
    weight[row, 0] = 1.0
    for p in range(1, DEGREE + 1):
        if p == DEGREE:
            weight[row + 1, 0] = -weight[row, 0]
            for r in range(1, DEGREE):
                weight[row + 1, r] = weight[row, r - 1] - weight[row, r]
            weight[row + 1, DEGREE] = weight[row, DEGREE - 1]
        saved = 0.0
        for r in range(p):
            share = weight[row, r] / p
            weight[row, r] = saved + (r + 1.0 - u) * share
            saved = (u + (p - 1.0 - r)) * share
        weight[row, p] = saved
    return k


@inlined
def one_apart(
    tables: Tables, angle: float, order: int, charge: Array, i: int, nodes: Nodes
) -> float:
    """Energy of casings i and i + 1 [J] (``order`` 0), or its slope by the joint's angle (1)."""
    last = tables.one.shape[0] - DEGREE
    density = last / (2.0 * tables.end)
    k = basis((angle + tables.end) * density, last, nodes.spline, 0)
    combine(tables.one, k, 0, nodes.spline, order, PAIRS, nodes.row)
    total = weigh(charge, i, i + 1, nodes.row, 0)
    return total * density if order == 1 else total


@inlined
def two_apart(
    tables: Tables, angle: float, next_angle: float, with_slopes: bool,
    charge: Array, i: int, nodes: Nodes,
) -> tuple[float, float]:  # fmt: skip
    """Slopes of the energy of casings i and i + 2 by the two joints' angles [N·m].

    Or the energy [J] and 0.
    """
    last = tables.two.shape[0] - DEGREE
    density = last / (2.0 * tables.end)
    k = basis((angle + tables.end) * density, last, nodes.spline, 0)
    begin = PAIRS * basis((next_angle + tables.end) * density, last, nodes.spline, 2)
    count = PAIRS * (DEGREE + 1)
    combine(tables.two, k, begin, nodes.spline, 0, count, nodes.row)
    if not with_slopes:
        return along_row(charge, i, nodes.row, nodes.spline, 2), 0.0
    next_slope = along_row(charge, i, nodes.row, nodes.spline, 3)
    combine(tables.two, k, begin, nodes.spline, 1, count, nodes.row)
    slope = along_row(charge, i, nodes.row, nodes.spline, 2)
    return slope * density, next_slope * density


@kernel
def combine(
    table: Array, k: int, begin: int, weight: Array, row: int, count: int, out: Array
) -> None:
    """Sum six rows of a table from k on, ``count`` entries each, with one row of weights."""
    w0, w1, w2 = weight[row, 0], weight[row, 1], weight[row, 2]
    w3, w4, w5 = weight[row, 3], weight[row, 4], weight[row, 5]
    for c in range(count):
        # Unsigned: a signed index might count from the end, which no vector load can.
        e = np.uint64(begin + c)
        out[c] = (
            (w0 * table[k, e] + w5 * table[k + 5, e])
            + (w1 * table[k + 1, e] + w4 * table[k + 4, e])
            + (w2 * table[k + 2, e] + w3 * table[k + 3, e])
        )


@inlined
def along_row(charge: Array, i: int, row: Array, weight: Array, order: int) -> float:
    """Sum six entries of the combined rows, for casings i and i + 2."""
    total = 0.0
    for s in range(DEGREE + 1):
        total += weight[order, s] * weigh(charge, i, i + 2, row, PAIRS * s)
    return total


@inlined
def weigh(charge: Array, i: int, j: int, row: Array, begin: int) -> float:
    """Sum over all pairs of faces, times their charges."""
    total = 0.0
    for a in range(FACES):
        part = 0.0
        for b in range(FACES):
            part += charge[j, b] * row[begin + FACES * a + b]
        total += charge[i, a] * part
    return total
