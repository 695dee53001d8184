"""Energies of casings one and two joints apart, looked up in splines of their joint angles.

The splines are of degree five on even knots, so four times differentiable; their gradient is
taken exactly. All sixteen pairs of faces have coefficients side by side, a vector's worth at a
time: charges enter last.
"""

import numpy as np

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Array, Nodes, Tables

DEGREE = 5
BEYOND = 0.2  # [rad]
FACES = 4
PAIRS = FACES * FACES


@inlined
def basis(x: float, last: int, weight: Array, row: int) -> int:
    """Weights of the splines at ``x`` knots from the first; returns the first's number.

    Row ``row`` of ``weight`` gets the DEGREE + 1 values, the next one their slopes by x. Beyond
    the first and the last knot the outermost polynomials go on.
    """
    k = min(max(int(x), 0), last - 1)
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
def one_slope(tables: Tables, angle: float, charge: Array, i: int, nodes: Nodes) -> float:
    """Slope of the energy of casings i and i + 1 by their joint's angle [N·m]."""
    table, spline, row = tables.one, nodes.spline, nodes.row
    k, density = place(angle, tables.end, table.shape[0], spline, 0)
    combine(table, k, 0, spline, 1, PAIRS, row)
    return density * weigh(charge, i, i + 1, row, 0)


@kernel
def one_energy(tables: Tables, angle: float, charge: Array, i: int, nodes: Nodes) -> float:
    """Energy of casings i and i + 1 [J]."""
    table, spline, row = tables.one, nodes.spline, nodes.row
    k, _ = place(angle, tables.end, table.shape[0], spline, 0)
    combine(table, k, 0, spline, 0, PAIRS, row)
    return weigh(charge, i, i + 1, row, 0)


@kernel
def two_slopes(
    tables: Tables, angle: float, next_angle: float, charge: Array, i: int, nodes: Nodes
) -> tuple[float, float]:
    """Slopes of the energy of casings i and i + 2 by their two joints' angles [N·m]."""
    table, spline, row = tables.two, nodes.spline, nodes.row
    k, density = place(angle, tables.end, table.shape[0], spline, 0)
    m, _ = place(next_angle, tables.end, table.shape[0], spline, 2)
    combine(table, k, PAIRS * m, spline, 0, row.size, row)
    next_slope = density * along_row(charge, i, row, spline, 3)
    combine(table, k, PAIRS * m, spline, 1, row.size, row)
    return density * along_row(charge, i, row, spline, 2), next_slope


@kernel
def two_energy(
    tables: Tables, angle: float, next_angle: float, charge: Array, i: int, nodes: Nodes
) -> float:
    """Energy of casings i and i + 2 [J]."""
    table, spline, row = tables.two, nodes.spline, nodes.row
    k, _ = place(angle, tables.end, table.shape[0], spline, 0)
    m, _ = place(next_angle, tables.end, table.shape[0], spline, 2)
    combine(table, k, PAIRS * m, spline, 0, row.size, row)
    return along_row(charge, i, row, spline, 2)


@inlined
def place(angle: float, end: float, rows: int, spline: Array, row: int) -> tuple[int, float]:
    """First spline at an angle, and knots a radian; weights go to the scratch's rows from row.

    Trial steps overshoot the stops, and with them the table: there it goes on smoothly, so that
    they find where the stop is met, and at last with a constant slope.
    """
    last = rows - DEGREE
    density = last / (2.0 * end)
    angle = min(max(angle, -end - BEYOND), end + BEYOND)
    return basis((angle + end) * density, last, spline, row), density


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
