"""Build the splines of ``engine.magnets.near_table``, once per geometry.

The energy of neighbours depends on one joint angle, and the energy of components two places apart
depends on two. Both are bilinear in the charges of the faces. The sixteen energies of pairs of
faces of unit charge are therefore summed over nodes at many angles, as exactly as possible, and
interpolated by splines.
"""

import math
from itertools import product

import numpy as np

from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.elementary import sincos
from magfold_env.engine.magnets.laws import COULOMB, FacePair
from magfold_env.engine.magnets.near_table import DEGREE, PAIRS, SPLINES, basis, knots_at
from magfold_env.engine.magnets.pairs import BLEND, level_sum, refine
from magfold_env.engine.state import Array, FarTable, Magnets, Nodes, Tables
from magfold_env.engine.workspace import new_nodes
from magfold_env.simulation.banded import solve_banded

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


def energies(magnets: Magnets, pitch: float, joints: Array) -> Array:
    """Return the energies (m, 16) of a chain's first and last casing at joint angles (m, k) [rad].

    ``pitch`` is the distance between a casing's hinges [m].
    """
    out = np.zeros((len(joints), PAIRS))
    face_energies(magnets, pitch, joints, new_nodes(magnets, 1), out)
    return out


@kernel
def angles_at(shares: Array, end: float, finest: float, spaces: int, out: Array) -> None:
    """Fill in the joint angles at shares of the knots (see `sites`), and the knots per radian.

    ``out`` has shape (2, shares). `knots_at` gives the knots' places, and bisection inverts it.
    """
    for k in range(shares.size):
        low, high = -end, end
        for _ in range(80):
            middle = 0.5 * (low + high)
            if 2.0 * knots_at(middle, end, finest, spaces)[0] < (shares[k] + 1.0) * spaces:
                low = middle
            else:
                high = middle
        out[0, k] = 0.5 * (low + high)
        out[1, k] = knots_at(out[0, k], end, finest, spaces)[1]


def joint_angles(shares: Array, spaces: int, graded: bool) -> tuple[Array, Array | float]:
    """Return the angles at shares of the knots (see `sites`), and the knots per radian there."""
    if not graded:
        return END * shares, spaces / (2.0 * END)
    out = np.zeros((2, shares.size))
    angles_at(shares, GRADED_END, FINEST, spaces, out)
    return out[0], out[1]


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


def splines_at(spaces: int, shares: Array) -> Array:
    """Return the values of all splines at shares in the form of `sites`, (shares, splines)."""
    out = np.zeros((shares.size, spaces + DEGREE))
    fill_splines(shares, spaces, np.zeros((2, SPLINES)), out)
    return out


def coefficients(spaces: int, values: Array) -> Array:
    """Return the coefficients (splines, …) that reproduce values, one row for each of the `sites`.

    Splines are zero except near their knots, so the matrix is banded.
    """
    matrix = splines_at(spaces, sites(spaces))
    n = len(matrix)
    band = np.zeros((n, 2 * DEGREE + 1))
    for ahead in range(-DEGREE, DEGREE + 1):
        band[max(-ahead, 0) : n - max(ahead, 0), DEGREE + ahead] = np.diagonal(matrix, ahead)
    found = values.reshape(n, -1).copy()
    solve_banded(band, found)
    return found.reshape(values.shape)


def build_near_table(magnets: Magnets, pitch: float, far: FarTable) -> tuple[Tables, float]:
    """Compute the splines of one kind of casing from sums of energies over its magnets' nodes.

    Also returns the error of the slopes of all faces together, as a share of the largest slope.
    """
    touching = bool(magnets.graded.any())
    angles, _ = joint_angles(sites(ONE_SPACES), ONE_SPACES, touching)
    values = energies(magnets, pitch, angles[:, None])
    one = coefficients(ONE_SPACES, values)
    worst = np.abs(np.gradient(values, angles, axis=0)).sum(axis=1).max()
    end = GRADED_END if touching else END
    angles = end * sites(TWO_SPACES)
    grid = np.array(list(product(angles, angles)))
    values = energies(magnets, pitch, grid).reshape(angles.size, angles.size, PAIRS)
    two = coefficients(TWO_SPACES, values).swapaxes(0, 1)
    two = coefficients(TWO_SPACES, two).swapaxes(0, 1)
    finest = FINEST if touching else 0.0
    two = two.reshape(len(two), -1).copy()
    tables = Tables(end, finest, np.ascontiguousarray(one), two, far)
    return tables, _slope_error(tables, magnets, pitch) / worst


def _slope_error(tables: Tables, magnets: Magnets, pitch: float) -> float:
    """Return the largest error of slopes [N·m/(A·m)²], estimated from energies between knots.

    The estimate is taken near the stops, where errors are largest. An error that alternates from
    space to space has a slope of up to its size times π divided by the distance of the knots.
    """
    worst = 0.0
    for table, spaces, joints in ((tables.one, ONE_SPACES, 1), (tables.two, TWO_SPACES, 2)):
        crowded = tables.finest > 0.0 and joints == 1
        shares = _middles(spaces, spaces // 2 if crowded else PROBES)
        found = table.reshape((spaces + DEGREE,) * joints + (PAIRS,))
        for _ in range(joints):
            # Contracts the first axis and moves it behind all others except that of the faces.
            found = np.moveaxis(np.tensordot(splines_at(spaces, shares), found, 1), 0, -2)
        angles, density = tables.end * shares, spaces / (2.0 * tables.end)
        if crowded:
            angles, density = joint_angles(shares, spaces, True)
        grid = np.array(list(product(angles, repeat=joints)))
        error = np.abs(found.reshape(-1, PAIRS) - energies(magnets, pitch, grid))
        worst = max(worst, float((error.sum(axis=1) * density).max()) * math.pi)
    return worst
