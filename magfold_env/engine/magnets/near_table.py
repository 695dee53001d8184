"""Energies of casings one and two joints apart, from splines of their joint angles.

The splines have degree five, so they are four times differentiable; forces are their exact
gradient. Knots are even unless faces may touch: neighbours' energy then varies like α² log α with
the angle α from a stop, and knots are denser there (`knots_at`). The coefficients of the sixteen
face pairs are side by side. When a joint enters another interval between knots, these are summed
with the charges and stored; the sum depends only on charges and intervals.
"""

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.elementary import log1p
from magfold_env.engine.state import Array, Nodes, Tables

DEGREE = 5
SPLINES = DEGREE + 1  # that are nonzero between two knots
BEYOND = 0.2  # [rad] how far the polynomials continue beyond the end
LOGARITHMIC = 4.0  # knots per factor e
FACES = 4
PAIRS = FACES * FACES


@inlined
def basis(x: float, last: int, weight: Array, row: int) -> int:
    """Fill in the splines' values ``x`` knots after the first; return the first spline's index.

    Row ``row`` of ``weight`` gets the DEGREE + 1 values, the next row their slopes in x. Beyond the
    first and last knots, the outermost polynomials continue.
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
def one_joint(
    tables: Tables, angle: float, charge: Array, i: int, slot: int, nodes: Nodes
) -> tuple[float, float]:
    """Return the energy of casings i and i + 1 [J], and its slope in their joint's angle [N·m].

    The slot stores the splines' coefficients, summed with the charges, until the angle enters
    another interval between knots. Beyond the end of dense knots, the slope is constant.
    """
    bends, spline, table, past = nodes.bends, nodes.spline, tables.one, 0.0
    if tables.finest == 0.0:
        k, density = place(angle, tables.end, table.shape[0], spline, 0)
    else:
        inside = min(max(angle, -tables.end), tables.end)
        past, last = angle - inside, table.shape[0] - DEGREE
        knots, density = knots_at(inside, tables.end, tables.finest, last)
        k = basis(knots, last, spline, 0)
    if bends.one_cell[slot] != k + 1:
        bends.one_cell[slot] = k + 1
        multiply(charge, i, i + 1, bends.product)
        for r in range(SPLINES):
            bends.one[slot, r] = weigh(table, k + r, 0, bends.product, bends.part)
    energy, slope = along(bends.one, slot, 0, spline, 0), along(bends.one, slot, 0, spline, 1)
    if past != 0.0:
        energy += past * density * slope
    return energy, density * slope


@kernel
def two_joints(
    tables: Tables, angle: float, next_angle: float, charge: Array, i: int, slot: int, nodes: Nodes
) -> tuple[float, float, float]:
    """Return the energy of casings i and i + 2 [J], and its slopes in both joints' angles [N·m].

    In the scratch, the second joint's weights follow the first one's.
    """
    bends, spline, table = nodes.bends, nodes.spline, tables.two
    k, density = place(angle, tables.end, table.shape[0], spline, 0)
    m, _ = place(next_angle, tables.end, table.shape[0], spline, 2)
    cell = k * table.shape[0] + m + 1
    if bends.two_cell[slot] != cell:
        bends.two_cell[slot] = cell
        multiply(charge, i, i + 2, bends.product)
        for r in range(SPLINES):
            for s in range(SPLINES):
                bends.two[slot, SPLINES * r + s] = weigh(
                    table, k + r, PAIRS * (m + s), bends.product, bends.part
                )
    energy, slope, next_slope = 0.0, 0.0, 0.0
    for r in range(SPLINES):
        value = along(bends.two, slot, SPLINES * r, spline, 2)
        energy += spline[0, r] * value
        slope += spline[1, r] * value
        next_slope += spline[0, r] * along(bends.two, slot, SPLINES * r, spline, 3)
    return energy, density * slope, density * next_slope


@inlined
def along(value: Array, slot: int, begin: int, spline: Array, row: int) -> float:
    """Return the sum of six values from ``begin`` on, times the splines' values in a row."""
    low = spline[row, 0] * value[slot, begin] + spline[row, 1] * value[slot, begin + 1]
    middle = spline[row, 2] * value[slot, begin + 2] + spline[row, 3] * value[slot, begin + 3]
    high = spline[row, 4] * value[slot, begin + 4] + spline[row, 5] * value[slot, begin + 5]
    return (low + middle) + high


@inlined
def knots_at(angle: float, end: float, finest: float, last: int) -> tuple[float, float]:
    """Return the number of knots below an angle, and the number of knots per radian there.

    There are ``last`` intervals from −end to end. In addition to an even spacing, there are
    `LOGARITHMIC` intervals per factor e of the distance to each end, down to ``finest`` [rad].
    """
    most = 2.0 * LOGARITHMIC * log1p(2.0 * end / finest)
    even = 0.5 * (last - most) / end
    below, above = finest + end + angle, finest + end - angle
    log = log1p(2.0 * abs(angle) / min(below, above))
    uneven = LOGARITHMIC * (log if angle > 0.0 else -log)
    return (
        0.5 * last + even * angle + uneven,
        even + LOGARITHMIC * (1.0 / below + 1.0 / above),
    )


@inlined
def multiply(charge: Array, i: int, j: int, out: Array) -> None:
    """Fill in the products of the charges of all pairs of faces."""
    for a in range(FACES):
        for b in range(FACES):
            out[FACES * a + b] = charge[i, a] * charge[j, b]


@inlined
def weigh(table: Array, row: int, begin: int, product: Array, part: Array) -> float:
    """Return the sum of a row's entries times the products of charges."""
    for p in range(FACES):
        e = begin + p
        part[p] = (product[p] * table[row, e] + product[p + 4] * table[row, e + 4]) + (
            product[p + 8] * table[row, e + 8] + product[p + 12] * table[row, e + 12]
        )
    return (part[0] + part[1]) + (part[2] + part[3])


@inlined
def place(angle: float, end: float, rows: int, spline: Array, row: int) -> tuple[int, float]:
    """Return the first spline at an angle, and knots per radian; write weights into ``spline``.

    Trial steps overshoot the stops and thus the table. The splines first continue smoothly, so that
    the time at the stop can be found; farther out, the returned slope is constant.
    """
    last = rows - DEGREE
    density = last / (2.0 * end)
    angle = min(max(angle, -end - BEYOND), end + BEYOND)
    return basis((angle + end) * density, last, spline, row), density
