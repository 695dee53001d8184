"""Build the table of ``engine.magnets.far_table``, once per geometry.

At the knots, the energies of two faces of unit charge, with close nodes softened, are sums over
Gauss-Legendre nodes; splines interpolate them. The splines are periodic in both angles; in the
reciprocal distance, their third derivative does not jump at the second and the second-to-last knot.
A reflection through the first face and an exchange of the casings do not change the energies, so
three quarters of them are copies.
"""

import math
from itertools import product

import numpy as np

from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.elementary import sincos
from magfold_env.engine.magnets import sheets
from magfold_env.engine.magnets.far_table import TWO_PI, look_up
from magfold_env.engine.magnets.laws import COULOMB, node_law
from magfold_env.engine.state import Array, FarTable, Magnets, Nodes, Pose
from magfold_env.engine.workspace import new_nodes
from magfold_env.simulation.banded import solve_banded
from magfold_env.simulation.quadrature import graded_rule, width_rule

# Distances of centres, in sides of a casing: touching squares are a side or more apart. Knots at
# smaller distances keep the effect of the end of the splines away from there.
NEAREST, FARTHEST = 0.856, 18.9
RADIAL = 41  # number of radial knots
TURNS = 48  # number of knots in a full turn
SOFT = 0.26  # [sides] softening radius
POLE = math.sqrt(3.0) - 2.0  # pole of the filter that undoes the sampling of cubic splines
NEAR_NODES, FAR_NODES = 10, 5  # nodes per face
NEAR = 2.2  # [sides] distance from which few nodes suffice
PROBES = 100


def build_far_table(magnets: Magnets, side: float) -> tuple[FarTable, float]:
    """Compute the splines for casings with four equal magnets and a given side [m].

    Also returns their error, as a share of the force between two flush faces.
    """
    end, soft = FARTHEST * side, SOFT * side
    reciprocal = np.linspace(1.0 / end, 1.0 / (NEAREST * side), RADIAL)
    soften = np.zeros(4)
    softening(soft, magnets.height2, soften)
    values = np.zeros((RADIAL, TURNS, TURNS))
    few, many = width_rule(True, FAR_NODES), width_rule(True, NEAR_NODES)
    beyond = int(np.searchsorted(reciprocal, 1.0 / (NEAR * side)))
    fill(magnets, 1.0 / reciprocal[:beyond], soft, soften, *few, values[:beyond])
    fill(magnets, 1.0 / reciprocal[beyond:], soft, soften, *many, values[beyond:])
    reach = 2.0 * magnets.depth + _width(magnets) + soft
    density = (RADIAL - 1) / (reciprocal[-1] - reciprocal[0])
    table = FarTable(end, float(density), _coefficients(values), soft, soften, reach)
    return table, _error(table, magnets, side)


def _width(magnets: Magnets) -> float:
    x, y = float(magnets.face_tx[0]), float(magnets.face_ty[0])
    return math.sqrt(x * x + y * y)


@kernel
def softening(soft: float, height2: float, out: Array) -> None:
    """Fill in a Taylor polynomial (4,) in ρ² of unit lines' energy about the distance ``soft``."""
    s, far = soft * soft, math.sqrt(soft * soft + height2)
    force, out[0] = node_law(True, True, height2, 0.0, s)
    # The force divided by the distance is twice the energy's slope in ρ²; its derivatives in ρ²,
    # times the height squared:
    slope = 0.5 / (far * s) - far / (s * s) + 0.5 / (s * soft)
    curve = 2.0 * far / (s * s * s) - 1.0 / (far * s * s) - 0.25 / (far * far * far * s)
    curve -= 0.75 / (s * s * soft)
    out[1] = -0.5 * force
    out[2] = -slope / (2.0 * height2)
    out[3] = -curve / (6.0 * height2)


@kernel
def fill(
    magnets: Magnets, distances: Array, soft: float, soften: Array,
    offset: Array, weight: Array, out: Array,
) -> None:  # fmt: skip
    """Compute the energies (distances, turns, turns) of two front-left faces [J/(A·m)²]."""
    turns = out.shape[1]
    for d in range(distances.size):
        for b in range(turns):
            for e in range(turns):
                # Copies for the view from the other casing, the mirror image, and both.
                here, b2, e2 = b * turns + e, (turns // 4 - b) % turns, (turns // 4 - e) % turns
                first = min(here, e * turns + b, b2 * turns + e2, e2 * turns + b2)
                if first < here:
                    out[d, b, e] = out[d, first // turns, first % turns]
                    continue
                toward, turn = TWO_PI * b / turns, TWO_PI * (b + turns // 2 - e) / turns
                out[d, b, e] = face_energy(
                    magnets, distances[d], toward, turn, soft, soften, offset, weight
                )


@kernel
def face_energy(
    magnets: Magnets, distance: float, toward: float, turn: float, soft: float, soften: Array,
    offset: Array, weight: Array,
) -> float:  # fmt: skip
    """Return the energy of two casings' front-left faces of unit charge [J/(A·m)²].

    The second is in the direction ``toward`` and turned by ``turn`` [rad], as seen from the first.
    """
    s, c = sincos(toward)
    x, y = distance * c, distance * s
    s, c = sincos(turn)
    energy = 0.0
    for f in range(0, 8, 4):
        ax, ay = magnets.face_tx[f], magnets.face_ty[f]
        for g in range(0, 8, 4):
            ex = x + c * magnets.face_x[g] - s * magnets.face_y[g] - magnets.face_x[f]
            ey = y + s * magnets.face_x[g] + c * magnets.face_y[g] - magnets.face_y[f]
            bx = c * magnets.face_tx[g] - s * magnets.face_ty[g]
            by = s * magnets.face_tx[g] + c * magnets.face_ty[g]
            total = 0.0
            for m in range(offset.size):
                x0, y0, part = ex + offset[m] * bx, ey + offset[m] * by, 0.0
                for k in range(offset.size):
                    dx, dy = x0 - offset[k] * ax, y0 - offset[k] * ay
                    r2 = dx * dx + dy * dy
                    part += weight[k] * softened(r2, soft * soft, magnets.height2, soften)
                total += weight[m] * part
            energy += total if f == g else -total
    return COULOMB * energy


@kernel
def softened(r2: float, soft2: float, height2: float, soften: Array) -> float:
    """Return the energy of two lines of unit charge [1/m], softened within the softening radius."""
    if r2 >= soft2:
        return node_law(True, True, height2, 0.0, r2)[1]
    rest = r2 - soft2
    return soften[0] + rest * (soften[1] + rest * (soften[2] + rest * soften[3]))


def _coefficients(values: Array) -> Array:
    """Return the splines' coefficients in the form of `FarTable`; angles are periodic."""
    turned = np.ascontiguousarray(np.moveaxis(values, 1, 2))
    filter_rows(turned.reshape(-1, values.shape[1]))
    values = np.ascontiguousarray(np.moveaxis(turned, 2, 1))
    filter_rows(values.reshape(-1, values.shape[2]))
    n = len(values)
    band = np.zeros((n + 2, 9))
    # The first and the last row set fourth differences to zero.
    band[0, 4:] = band[-1, :5] = 1.0, -4.0, 6.0, -4.0, 1.0
    band[1:-1, 3:6] = 1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0
    right = np.zeros((n + 2, values[0].size))
    right[1:-1] = values.reshape(n, -1)
    solve_banded(band, right)
    found = right.reshape(n + 2, *values.shape[1:])
    found = np.pad(found, ((0, 0), (1, 2), (0, 0)), mode="wrap")
    quarter = values.shape[2] // 4
    headings = [k + quarter * face for k in range(-1, quarter + 2) for face in range(4)]
    return np.ascontiguousarray(found[:, :, np.array(headings) % values.shape[2]])


@kernel
def filter_rows(rows: Array) -> None:
    """Convert periodic values, one period per row, to coefficients of cubic splines."""
    n = rows.shape[1]
    for line in range(rows.shape[0]):
        total, share = 0.0, 1.0
        for k in range(n):
            total += share * rows[line, (n - k) % n]
            share *= POLE
        rows[line, 0] = total
        for k in range(1, n):
            rows[line, k] += POLE * rows[line, k - 1]
        total, share = 0.0, -POLE
        for k in range(n):
            total += share * rows[line, (n - 1 + k) % n]
            share *= POLE
        rows[line, n - 1] = total
        following = total
        for k in range(n - 2, -1, -1):
            following = POLE * (following - rows[line, k])
            rows[line, k] = following
        for k in range(n):
            rows[line, k] *= 6.0


def _error(table: FarTable, magnets: Magnets, side: float) -> float:
    """Return the largest force error of touching casings, relative to the force of flush faces.

    The estimate uses energies of all faces together: an error that alternates from knot to knot has
    a slope equal to its size times π divided by the distance of the knots.
    """
    rng = np.random.default_rng(0)
    distances = side * rng.uniform(1.0, math.sqrt(2.0), PROBES)
    toward, turn = rng.uniform(-math.pi, math.pi, (2, PROBES))
    # Casings turned by right angles give all pairs of faces.
    quarters = 0.5 * math.pi * np.array(list(product(range(4), range(4))))
    places = np.stack(
        np.broadcast_arrays(
            distances[:, None],
            toward[:, None] - quarters[:, 0],
            turn[:, None] + quarters[:, 1] - quarters[:, 0],
        ),
        axis=-1,
    )
    energies = np.zeros((PROBES, 16, 2))
    rule, nodes = width_rule(True, 2 * NEAR_NODES), new_nodes(magnets, 2)
    charge, pose = np.eye(1, 4).repeat(2, axis=0), Pose(*np.zeros((4, 2)))
    probe(
        magnets, table, places.reshape(-1, 3), charge, pose, nodes, *rule, energies.reshape(-1, 2)
    )
    worst = float(np.abs(energies[..., 0] - energies[..., 1]).sum(axis=1).max())
    knots = side * TWO_PI / TURNS
    width, half = _width(magnets), float(magnets.face_half[0])
    offset, share = graded_rule(64)
    gap = max(side - 2.0 * magnets.depth, 0.0)
    push = [sheets.potential(x * width, gap, 0.5 * width, half, half)[2] for x in offset.tolist()]
    flush = -COULOMB * float(share @ np.array(push))
    return worst * math.pi / knots / flush


@kernel
def probe(
    magnets: Magnets, table: FarTable, places: Array, charge: Array, pose: Pose, nodes: Nodes,
    offset: Array, weight: Array, out: Array,
) -> None:  # fmt: skip
    """Compute energies (k, 2) of two faces by splines and by sums, at distances and angles (k, 3).

    ``charge`` (2, 4) contains the charges of the faces.
    """
    pose.cos[0], pose.sin[0], pose.x[0], pose.y[0] = 1.0, 0.0, 0.0, 0.0
    for p in range(len(places)):
        distance, toward, turn = places[p, 0], places[p, 1], places[p, 2]
        pose.sin[1], pose.cos[1] = sincos(turn)
        s, c = sincos(toward)
        pose.x[1], pose.y[1] = distance * c, distance * s
        out[p, 0] = look_up(table, charge, pose, turn, 0, 1, nodes.stencils)[0]
        out[p, 1] = face_energy(
            magnets, distance, toward, turn, table.soft, table.soften, offset, weight
        )
