"""Build the splines of ``engine.magnets.near_table``, once per geometry.

The energy of neighbours depends on one joint angle, and the energy of components two places apart
depends on two. Both are bilinear in the charges of the faces. The sixteen energies of pairs of
faces of unit charge are therefore summed over nodes at many angles, as exactly as possible, and
interpolated by splines.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np

from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import interpreted, kernel
from magfold_env.engine.elementary import sincos
from magfold_env.engine.magnets.laws import COULOMB, FacePair
from magfold_env.engine.magnets.near_table import DEGREE, PAIRS, SPLINES, basis, knots_at
from magfold_env.engine.magnets.pairs import BLEND, level_sum, refine
from magfold_env.engine.state import Array, FarTable, Magnets, Nodes, Tables
from magfold_env.engine.workspace import new_nodes, zeros
from magfold_env.simulation.banded import factor_banded, solve_banded

# Joints stop at a right angle; the solver exceeds it by at most a tolerance.
END = math.pi / 2.0 + 0.004
# Where faces may touch, forces keep their values beyond the stop, and knots are denser near it.
GRADED_END, FINEST = math.pi / 2.0, 3e-7
ONE_SPACES = 200
TWO_SPACES = 40
PROBES = 6


@kernel
def face_energies(magnets: Magnets, pitch: float, joints: Array, nodes: Nodes, out: Array) -> None:
    """Compute the energies of all pairs of unit faces at joint angles [rad], (m, 16) [J/(A·m)²].

    The first casing is at the origin and heads along x.
    """
    refined = BLEND * magnets.level_radius[1]
    for p in range(joints.shape[0]):
        x, y, heading, s, c = 0.5 * pitch, 0.0, 0.0, 0.0, 1.0
        for k in range(joints.shape[1]):
            heading += joints[p, k]
            s, c = sincos(heading)
            along = pitch if k + 1 < joints.shape[1] else 0.5 * pitch
            x += along * c
            y += along * s
        for pair in range(PAIRS):
            out[p, pair] = 0.0
        for f in range(8):
            ax, ay = magnets.face_x[f], magnets.face_y[f]
            for g in range(8):
                bx = x + c * magnets.face_x[g] - s * magnets.face_y[g]
                by = y + s * magnets.face_x[g] + c * magnets.face_y[g]
                faces = FacePair(
                    magnets.even, magnets.face_half[f], magnets.face_half[g],
                    ax - bx, ay - by, magnets.face_tx[f], magnets.face_ty[f],
                    c * magnets.face_tx[g] - s * magnets.face_ty[g],
                    s * magnets.face_tx[g] + c * magnets.face_ty[g],
                )  # fmt: skip
                u = level_sum(magnets, 0, faces, True, nodes)[0]
                if faces.x * faces.x + faces.y * faces.y < refined * refined:
                    u += refine(magnets, faces, magnets.graded[f, g] != 0, True, nodes)[0]
                sign = COULOMB if (f < 4) == (g < 4) else -COULOMB
                out[p, 4 * (f % 4) + g % 4] += sign * u


@kernel
def angles_at(shares: Array, spaces: int, out: Array) -> None:
    """Fill in joint angles at shares of knots that are denser near the stops, and the density.

    `knots_at` gives the knots' places, and bisection inverts it.
    """
    for k in range(shares.size):
        low, high = -GRADED_END, GRADED_END
        for _ in range(80):
            middle = 0.5 * (low + high)
            knots = knots_at(middle, GRADED_END, FINEST, spaces)[0]
            if 2.0 * knots < (shares[k] + 1.0) * spaces:
                low = middle
            else:
                high = middle
        out[0, k] = 0.5 * (low + high)
        out[1, k] = knots_at(out[0, k], GRADED_END, FINEST, spaces)[1]


def sites(spaces: int) -> Array:
    """Return where the splines interpolate, as shares of the knots from −1 (first) to 1 (last).

    These are the knots and, near the ends, the midpoints between them: as many places as splines.
    """
    return np.sort(np.concatenate([np.linspace(-1.0, 1.0, spaces + 1), _middles(spaces, 2)]))


def _middles(spaces: int, count: int) -> Array:
    """Return the midpoints of the first and last ``count`` knot spaces, in the form of `sites`."""
    near = (2.0 * np.arange(count) + 1.0) / spaces - 1.0
    return np.concatenate([near, -near[::-1]])


@kernel
def fill_splines(shares: Array, spaces: int, weight: Array, out: Array) -> None:
    """Fill in the values of all splines at shares in the form of `sites`, (shares, splines)."""
    for k in range(shares.size):
        first = basis((shares[k] + 1.0) * spaces / 2.0, spaces, weight, 0)
        for r in range(weight.shape[1]):
            out[k, first + r] = weight[0, r]


@by_pointer
class NearKit(NamedTuple):
    """The data from which `fill_near_table` computes splines in one angle and in a pair of them."""

    nodes: Nodes
    site: Array  # see `sites`
    pair_site: Array
    band: Array  # factored matrices
    pair_band: Array
    angle: Annotated[Array, 2, "sites"]  # joint angles at sites, and knots per radian
    joint: Annotated[Array, "sites", 1]  # joint angles for which energies are computed
    pair_joint: Annotated[Array, "pairs", 2]
    one: Annotated[Array, "sites", PAIRS]  # energies, then coefficients
    two: Array  # (pairs, 16)
    square: Array  # the same numbers, (pair sites, pair sites·16)
    middle: Array  # `_middles`, where the error is estimated
    pair_middle: Array
    probe: Annotated[Array, "probes", 2]  # shares between knots
    exact: Annotated[Array, "probes", PAIRS]  # energies there
    density: Annotated[Array, "probes"]  # knots per radian there
    weight: Annotated[Array, 4, SPLINES]  # scratch
    number: Annotated[Array, 2]  # end and finest of `Tables`


def new_near_kit(magnets: Magnets) -> NearKit:
    """Allocate the data of `fill_near_table`."""
    one, two, middles = sites(ONE_SPACES), sites(TWO_SPACES), _middles(TWO_SPACES, PROBES)
    square = np.zeros((two.size, two.size * PAIRS))
    probes = max(ONE_SPACES, middles.size**2)
    return zeros(
        NearKit, {"sites": one.size, "pairs": two.size**2, "probes": probes},
        nodes=new_nodes(magnets, 1), site=one, pair_site=two,
        band=_band(ONE_SPACES), pair_band=_band(TWO_SPACES),
        two=square.reshape(-1, PAIRS), square=square,
        middle=_middles(ONE_SPACES, ONE_SPACES // 2), pair_middle=middles,
    )  # fmt: skip


def _band(spaces: int) -> Array:
    """Return the factored matrix of the splines' values at the `sites`.

    Splines are zero except near their knots, so the matrix is banded.
    """
    shares = sites(spaces)
    matrix, n = np.zeros((shares.size, shares.size)), shares.size
    fill_splines(shares, spaces, np.zeros((2, SPLINES)), matrix)
    band = np.zeros((n, 2 * DEGREE + 1))
    for ahead in range(-DEGREE, DEGREE + 1):
        band[max(-ahead, 0) : n - max(ahead, 0), DEGREE + ahead] = np.diagonal(matrix, ahead)
    factor_banded(band)
    return band


def build_near_table(magnets: Magnets, pitch: float, far: FarTable) -> tuple[Tables, float]:
    """Compute the splines of one kind of casing; see `fill_near_table`."""
    kit = new_near_kit(magnets)
    error = fill_near_table(kit, magnets, pitch)
    end, finest = kit.number.tolist()
    return Tables(end, finest, kit.one, kit.square, far), error


@interpreted
def fill_near_table(kit: NearKit, magnets: Magnets, pitch: float) -> float:
    """Compute splines from sums of energies over magnets' nodes; see `Tables`.

    ``pitch`` is the distance between a casing's hinges [m]. Returns the error of the slopes of all
    faces together, as a share of the largest slope.
    """
    touching = False
    for f in range(8):
        for g in range(8):
            touching = touching or magnets.graded[f, g] != 0
    end = GRADED_END if touching else END
    kit.number[0], kit.number[1] = end, FINEST if touching else 0.0
    one, count = kit.site.size, kit.pair_site.size
    place(kit, kit.site, touching)
    for k in range(one):
        kit.joint[k, 0] = kit.angle[0, k]
    face_energies(magnets, pitch, kit.joint, kit.nodes, kit.one)
    steepest = largest_slope(kit.angle[0], kit.one)
    solve_banded(kit.band, kit.one)
    for k in range(count):
        for m in range(count):
            kit.pair_joint[count * k + m, 0] = end * kit.pair_site[k]
            kit.pair_joint[count * k + m, 1] = end * kit.pair_site[m]
    face_energies(magnets, pitch, kit.pair_joint, kit.nodes, kit.two)
    solve_banded(kit.pair_band, kit.square)
    for k in range(count):
        solve_banded(kit.pair_band, kit.two[count * k : count * (k + 1)])
    return slope_error(kit, magnets, pitch, touching) / steepest


@interpreted
def place(kit: NearKit, shares: Array, touching: bool) -> None:
    """Fill in the joint angles at shares of the knots (see `sites`), and the knots per radian."""
    if touching:
        angles_at(shares, ONE_SPACES, kit.angle)
        return
    for k in range(shares.size):
        kit.angle[0, k], kit.angle[1, k] = END * shares[k], ONE_SPACES / (2.0 * END)


@interpreted
def slope_error(kit: NearKit, magnets: Magnets, pitch: float, touching: bool) -> float:
    """Return the largest error of slopes [N·m/(A·m)²], estimated from energies between knots.

    The estimate is taken near the stops, where errors are largest. An error that alternates from
    space to space has a slope of up to its size times π divided by the distance of the knots.
    """
    count, middles, end = 0, kit.middle.size, GRADED_END if touching else END
    place(kit, kit.middle, touching)
    for k in range(middles):
        if touching or min(k, middles - 1 - k) < PROBES:
            kit.probe[count, 0], kit.joint[count, 0] = kit.middle[k], kit.angle[0, k]
            kit.density[count] = kit.angle[1, k]
            count += 1
    face_energies(magnets, pitch, kit.joint[:count], kit.nodes, kit.exact)
    worst = largest_error(kit, count, kit.one, ONE_SPACES, 1)
    count = 0
    for k in range(kit.pair_middle.size):
        for m in range(kit.pair_middle.size):
            kit.probe[count, 0], kit.probe[count, 1] = kit.pair_middle[k], kit.pair_middle[m]
            kit.pair_joint[count, 0] = end * kit.pair_middle[k]
            kit.pair_joint[count, 1] = end * kit.pair_middle[m]
            kit.density[count] = TWO_SPACES / (2.0 * end)
            count += 1
    face_energies(magnets, pitch, kit.pair_joint[:count], kit.nodes, kit.exact)
    return math.pi * max(worst, largest_error(kit, count, kit.two, TWO_SPACES, 2))


@interpreted
def largest_slope(angle: Array, values: Array) -> float:
    """Return the largest sum of the slopes of values (k, 16), from parabolas as `np.gradient`."""
    worst, last = 0.0, angle.size - 1
    for k in range(last + 1):
        before, after, found = max(k - 1, 0), min(k + 1, last), 0.0
        back, ahead = angle[k] - angle[before], angle[after] - angle[k]
        for pair in range(PAIRS):
            down, up = values[k, pair] - values[before, pair], values[after, pair] - values[k, pair]
            if k in (0, last):
                found += abs((down + up) / (back + ahead))
            else:
                found += abs((down * ahead / back + up * back / ahead) / (back + ahead))
        worst = max(worst, found)
    return worst


@kernel
def largest_error(kit: NearKit, count: int, table: Array, spaces: int, joints: int) -> float:
    """Return the largest error of the splines at probes, times the density of knots there."""
    worst, weight = 0.0, kit.weight
    for p in range(count):
        m, across, columns = 0, 1, 1
        weight[2, 0] = 1.0
        k = basis((kit.probe[p, 0] + 1.0) * spaces / 2.0, spaces, weight, 0)
        if joints == 2:
            m = basis((kit.probe[p, 1] + 1.0) * spaces / 2.0, spaces, weight, 2)
            across, columns = spaces + DEGREE, SPLINES
        error = 0.0
        for pair in range(PAIRS):
            found = 0.0
            for r in range(SPLINES):
                for s in range(columns):
                    found += weight[0, r] * weight[2, s] * table[across * (k + r) + m + s, pair]
            error += abs(found - kit.exact[p, pair])
        worst = max(worst, error * kit.density[p])
    return worst
