"""Build the table of ``engine.magnets.far_table``, once per geometry.

At the knots, the energies of two faces of unit charge, with close nodes softened, are sums over
Gauss-Legendre nodes; splines interpolate them. The splines are periodic in both angles; in the
reciprocal distance, their third derivative does not jump at the second and the second-to-last knot.
A reflection through the first face and an exchange of the casings do not change the energies, so
three quarters of them are copies.
"""

import math
from itertools import product
from typing import Annotated, NamedTuple

import numpy as np

from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import interpreted, kernel
from magfold_env.engine.elementary import sincos
from magfold_env.engine.magnets import sheets
from magfold_env.engine.magnets.far_table import TWO_PI, look_up
from magfold_env.engine.magnets.laws import COULOMB, node_law
from magfold_env.engine.state import Array, FarTable, IntArray, Magnets, Nodes, Pose
from magfold_env.engine.workspace import new_nodes, zeros
from magfold_env.simulation.banded import factor_banded, solve_banded
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


@by_pointer
class FarKit(NamedTuple):
    """The data from which `fill_far_table` computes splines, and `far_error` their error."""

    few: Array  # offsets and weights of the nodes of a face, (2, count)
    many: Array
    distance: Annotated[Array, RADIAL]  # of the knots [m]
    right: Array  # right-hand sides, then coefficients, (radial + 2, turns·turns)
    values: Array  # energies, the same numbers without the first and last row
    band: Array  # factored matrix of the radial splines, (radial + 2, 9)
    heading: IntArray  # directions of the table's columns, (turns + 12,)
    soften: Annotated[Array, 4]  # of `FarTable`
    energy: Annotated[Array, RADIAL + 2, TURNS + 3, TURNS + 12]
    place: Array  # distances [sides] and angles [rad] of probes, (k, 3)
    fine: Array  # nodes of probes
    found: Annotated[Array, 16 * PROBES, 2]  # energies of probes by splines and by sums
    charge: Array  # of two casings, (2, 4)
    pose: Pose
    nodes: Nodes
    graded: Array  # `graded_rule`
    number: Annotated[Array, 4]  # end, density, soft and reach of `FarTable`


def new_far_kit(magnets: Magnets) -> FarKit:
    """Allocate the data of `fill_far_table` and `far_error`."""
    rng = np.random.default_rng(0)
    distances = rng.uniform(1.0, math.sqrt(2.0), PROBES)
    toward, turn = rng.uniform(-math.pi, math.pi, (2, PROBES))
    # Casings turned by right angles give all pairs of faces.
    quarters = 0.5 * math.pi * np.array(list(product(range(4), range(4))))
    seen = (
        distances[:, None],
        toward[:, None] - quarters[:, 0],
        turn[:, None] + quarters[:, 1] - quarters[:, 0],
    )
    band, quarter = np.zeros((RADIAL + 2, 9)), TURNS // 4
    # The first and the last row set fourth differences to zero.
    band[0, 4:] = band[-1, :5] = 1.0, -4.0, 6.0, -4.0, 1.0
    band[1:-1, 3:6] = 1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0
    factor_banded(band)
    heading = [k + quarter * face for k in range(-1, quarter + 2) for face in range(4)]
    right = np.zeros((RADIAL + 2, TURNS * TURNS))
    return zeros(
        FarKit, {"n": 2}, right=right, values=right[1:-1].reshape(RADIAL, TURNS, TURNS), band=band,
        few=np.array(width_rule(True, FAR_NODES)), many=np.array(width_rule(True, NEAR_NODES)),
        heading=np.array(heading) % TURNS, nodes=new_nodes(magnets, 2),
        place=np.stack(np.broadcast_arrays(*seen), axis=-1).reshape(-1, 3),
        fine=np.array(width_rule(True, 2 * NEAR_NODES)), graded=np.array(graded_rule(64)),
        charge=np.eye(1, 4).repeat(2, axis=0),
    )  # fmt: skip


def build_far_table(magnets: Magnets, side: float) -> tuple[FarTable, float]:
    """Compute the splines for casings with four equal magnets and a given side [m].

    Also returns their error, as a share of the force between two flush faces.
    """
    kit = new_far_kit(magnets)
    fill_far_table(kit, magnets, side)
    end, density, soft, reach = kit.number.tolist()
    table = FarTable(end, density, soft, reach, kit.soften, kit.energy)
    return table, far_error(kit, magnets, table, side)


@interpreted
def fill_far_table(kit: FarKit, magnets: Magnets, side: float) -> None:
    """Compute the splines of casings with a given side [m]; see `FarTable`."""
    end, soft, near = FARTHEST * side, SOFT * side, 1.0 / (NEAR * side)
    first, last = 1.0 / end, 1.0 / (NEAREST * side)
    step, beyond = (last - first) / (RADIAL - 1), 0
    for k in range(RADIAL):
        reciprocal = k * step + first if k < RADIAL - 1 else last
        kit.distance[k] = 1.0 / reciprocal
        beyond += int(reciprocal < near)
    softening(soft, magnets.height2, kit.soften)
    few, many, values = kit.few, kit.many, kit.values
    fill(magnets, kit.distance[:beyond], soft, kit.soften, few[0], few[1], values[:beyond])
    fill(magnets, kit.distance[beyond:], soft, kit.soften, many[0], many[1], values[beyond:])
    filter_all(kit.right, TURNS)
    solve_banded(kit.band, kit.right)
    spread(kit)
    kit.number[0], kit.number[1], kit.number[2] = end, (RADIAL - 1) / (last - first), soft
    kit.number[3] = 2.0 * magnets.depth + _width(magnets) + soft


@interpreted
def _width(magnets: Magnets) -> float:
    x, y = magnets.face_tx[0], magnets.face_ty[0]
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


@kernel
def spread(kit: FarKit) -> None:
    """Copy the coefficients to the form of `FarTable`."""
    turns = kit.values.shape[1]
    for d in range(kit.energy.shape[0]):
        for b in range(turns + 3):
            before = (b + turns - 1) % turns
            for e in range(kit.heading.size):
                kit.energy[d, b, e] = kit.right[d, turns * before + kit.heading[e]]


@kernel
def filter_all(right: Array, n: int) -> None:
    """Convert rows of n·n energies, periodic in both angles, to coefficients of cubic splines."""
    for d in range(1, right.shape[0] - 1):
        for line in range(2 * n):
            first, step = (line, n) if line < n else ((line - n) * n, 1)
            filter_line(right[d], first, step, n)


@kernel
def filter_line(values: Array, first: int, step: int, n: int) -> None:
    """Convert n periodic values, each a ``step`` after the other, to coefficients of splines."""
    total, share = 0.0, 1.0
    for k in range(n):
        total += share * values[first + step * ((n - k) % n)]
        share *= POLE
    values[first] = total
    for k in range(1, n):
        values[first + step * k] += POLE * values[first + step * (k - 1)]
    total, share = 0.0, -POLE
    for k in range(n):
        total += share * values[first + step * ((n - 1 + k) % n)]
        share *= POLE
    following = total
    values[first + step * (n - 1)] = following
    for k in range(n - 2, -1, -1):
        following = POLE * (following - values[first + step * k])
        values[first + step * k] = following
    for k in range(n):
        values[first + step * k] *= 6.0


@interpreted
def far_error(kit: FarKit, magnets: Magnets, table: FarTable, side: float) -> float:
    """Return the largest force error of touching casings, relative to the force of flush faces.

    The estimate uses energies of all faces together: an error that alternates from knot to knot has
    a slope equal to its size times π divided by the distance of the knots.
    """
    probe(kit, magnets, table, side)
    worst, error = 0.0, 0.0
    for p in range(kit.place.shape[0]):
        error = (error if p % 16 > 0 else 0.0) + abs(kit.found[p, 0] - kit.found[p, 1])
        worst = max(worst, error)
    width, half, push = _width(magnets), magnets.face_half[0], 0.0
    gap = max(side - 2.0 * magnets.depth, 0.0)
    for k in range(kit.graded.shape[1]):
        place = kit.graded[0, k] * width
        push -= kit.graded[1, k] * sheets.potential(place, gap, 0.5 * width, half, half)[2]
    return worst * math.pi / (side * TWO_PI / TURNS) / (COULOMB * push)


@kernel
def probe(kit: FarKit, magnets: Magnets, table: FarTable, side: float) -> None:
    """Compute energies of two faces by splines and by sums, at the probes' distances and angles."""
    pose = kit.pose
    pose.cos[0], pose.sin[0], pose.x[0], pose.y[0] = 1.0, 0.0, 0.0, 0.0
    for p in range(kit.place.shape[0]):
        distance, toward, turn = side * kit.place[p, 0], kit.place[p, 1], kit.place[p, 2]
        pose.sin[1], pose.cos[1] = sincos(turn)
        s, c = sincos(toward)
        pose.x[1], pose.y[1] = distance * c, distance * s
        kit.found[p, 0] = look_up(table, kit.charge, pose, turn, 0, 1, kit.nodes.stencils)[0]
        kit.found[p, 1] = face_energy(
            magnets, distance, toward, turn, table.soft, table.soften, kit.fine[0], kit.fine[1]
        )
