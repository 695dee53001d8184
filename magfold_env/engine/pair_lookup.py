"""Energies of casings one and two joints apart, looked up in splines of their joint angles.

The splines are of degree five on even knots, so four times differentiable; their gradient is
taken exactly. All sixteen pairs of faces have coefficients side by side, a vector's worth at a
time: charges enter last.
"""

from __future__ import annotations

from magfold_env.engine.jit import inlined, kernel
from magfold_env.engine.state import Array, Nodes, Tables

DEGREE = 5
FACES = 4
PAIRS = FACES * FACES


@inlined
def basis(x: float, last: int, weight: Array, row: int) -> int:
    """Weights of the splines at ``x`` knots from the first; returns the first's number.

    Row ``row`` of ``weight`` gets the DEGREE + 1 values, the next one their slopes by x. Beyond
    the first and the last knot their own values are given.
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


@kernel
def one_apart(
    tables: Tables, angle: float, charge: Array, i: int, nodes: Nodes
) -> tuple[float, float]:
    """Energy [J] of casings i and i + 1, and its slope by the joint's angle [N·m].

    Beyond the table's end, where only trial steps get, its last values are given.
    """
    last = tables.one.shape[0] - DEGREE
    density = last / (2.0 * tables.end)
    weight = nodes.spline
    k = basis((angle + tables.end) * density, last, weight, 0)
    value, slope = nodes.lane_u, nodes.lane_x
    for c in range(PAIRS):
        value[c] = 0.0
        slope[c] = 0.0
    for r in range(DEGREE + 1):
        w, d = weight[0, r], weight[1, r]
        for c in range(PAIRS):
            value[c] += w * tables.one[k + r, c]
            slope[c] += d * tables.one[k + r, c]
    return weigh(charge, i, i + 1, value), density * weigh(charge, i, i + 1, slope)


@kernel
def two_apart(
    tables: Tables, angle: float, next_angle: float, charge: Array, i: int, nodes: Nodes
) -> tuple[float, float, float]:
    """Energy [J] of casings i and i + 2, and its slopes by the two joints' angles [N·m].

    Beyond the table's end, where only trial steps get, its last values are given.
    """
    last = tables.two.shape[0] - DEGREE
    density = last / (2.0 * tables.end)
    weight = nodes.spline
    k = basis((angle + tables.end) * density, last, weight, 0)
    m = basis((next_angle + tables.end) * density, last, weight, 2)
    value, slope, next_slope = nodes.lane_u, nodes.lane_x, nodes.lane_y
    for c in range(PAIRS):
        value[c] = 0.0
        slope[c] = 0.0
        next_slope[c] = 0.0
    for r in range(DEGREE + 1):
        w, d = weight[0, r], weight[1, r]
        for s in range(DEGREE + 1):
            ww, dw, wd = w * weight[2, s], d * weight[2, s], w * weight[3, s]
            for c in range(PAIRS):
                coefficient = tables.two[k + r, m + s, c]
                value[c] += ww * coefficient
                slope[c] += dw * coefficient
                next_slope[c] += wd * coefficient
    return (
        weigh(charge, i, i + 2, value),
        density * weigh(charge, i, i + 2, slope),
        density * weigh(charge, i, i + 2, next_slope),
    )


@inlined
def weigh(charge: Array, i: int, j: int, lanes: Array) -> float:
    """Sum over all pairs of faces, times their charges."""
    total = 0.0
    for a in range(FACES):
        row = 0.0
        for b in range(FACES):
            row += charge[j, b] * lanes[FACES * a + b]
        total += charge[i, a] * row
    return total
