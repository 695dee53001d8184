"""Build the table of ``engine.magnets.far_lookup``, once a geometry.

The energies of two faces of unit charge, nearer nodes softened, are summed over Gauss-Legendre
nodes at the knots, and splines are laid through them: in both angles periodic ones, in the
reciprocal distance ones whose third derivative does not jump at the last knots but one. A mirror
through the first face and an exchange of the casings leave the energies as they are: three quarters
of them are copied.
"""

import importlib
import math
from typing import Any

import numpy as np

from magfold_env.engine.chain.sincos import sincos
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.magnets.laws import COULOMB, node_law
from magfold_env.engine.state import Array, FarTable, IntArray, Magnets

# Distances of centres, in sides of a casing: squares that touch are a side apart or more. Knots
# within keep what the last ones do to the splines away from there.
NEAREST, FARTHEST = 0.856, 11.3
RADIAL = 40  # knots
TURNS = 48  # and in a whole turn
SOFT = 0.26  # sides within which nodes are softened
POLE = math.sqrt(3.0) - 2.0  # of the filter that undoes the sampling of cubic splines
NEAR_NODES, FAR_NODES = 10, 5  # of a face
NEAR = 2.2  # sides from which on few nodes do


def build_far_table(magnets: Magnets, side: float) -> FarTable:
    """Lay the splines for casings with four equal magnets and a number of ``side`` [m]."""
    end, soft = FARTHEST * side, SOFT * side
    reciprocal = np.linspace(1.0 / end, 1.0 / (NEAREST * side), RADIAL)
    soften = softening(soft, math.sqrt(magnets.height2))
    offset, weight, count = np.zeros((2, NEAR_NODES)), np.zeros((2, NEAR_NODES)), []
    for row, nodes in enumerate((FAR_NODES, NEAR_NODES)):
        at, share = np.polynomial.legendre.leggauss(nodes)
        offset[row, :nodes], weight[row, :nodes] = at / 2.0, share / 2.0
        count.append(nodes)
    values = np.zeros((RADIAL, TURNS, TURNS))
    fill(
        magnets, 1.0 / reciprocal, NEAR * side, soft, soften,
        np.array(count), offset, weight, values,
    )  # fmt: skip
    reach = 2.0 * float(np.max(np.hypot(magnets.face_x, magnets.face_y)))
    reach += float(np.max(np.hypot(magnets.face_tx, magnets.face_ty))) + soft
    density = (RADIAL - 1) / (reciprocal[-1] - reciprocal[0])
    return FarTable(end, float(density), _coefficients(values), soft, soften, reach)


def softening(soft: float, height: float) -> Array:
    """Return the energy of lines of unit charge about a distance, as a polynomial in ρ² (4,)."""
    s, h2 = soft * soft, height * height
    root, far = soft, math.sqrt(s + h2)
    energy = 2.0 / h2 * (height * math.asinh(height / root) - far + root)
    # The force over the distance, twice the energy's slope by ρ², and its derivatives.
    force = far / s - 1.0 / root
    slope = 0.5 / (far * s) - far / s**2 + 0.5 / (s * root)
    curve = -0.25 / (far**3 * s) - 1.0 / (far * s**2) + 2.0 * far / s**3 - 0.75 / (s**2 * root)
    return np.array([energy, -force / h2, -slope / (2.0 * h2), -curve / (6.0 * h2)])


@kernel
def fill(
    magnets: Magnets, distances: Array, near: float, soft: float, soften: Array,
    count: IntArray, offset: Array, weight: Array, out: Array,
) -> None:  # fmt: skip
    """Fill energies (distances, turns, turns) of two front-left faces [J/(A·m)²]."""
    turns = out.shape[1]
    for d in range(distances.size):
        row = 1 if distances[d] < near else 0
        nodes = count[row]
        for b in range(turns):
            for e in range(turns):
                # Copies: seen from the other casing, of its mirror image, and both.
                here, b2, e2 = b * turns + e, (turns // 4 - b) % turns, (turns // 4 - e) % turns
                first = min(here, e * turns + b, b2 * turns + e2, e2 * turns + b2)
                if first < here:
                    out[d, b, e] = out[d, first // turns, first % turns]
                    continue
                s, c = sincos(2.0 * math.pi * b / turns)
                x, y = distances[d] * c, distances[d] * s
                s, c = sincos(2.0 * math.pi * (b + turns // 2 - e) / turns)
                for f in range(0, 8, 4):
                    for g in range(0, 8, 4):
                        ex = x + c * magnets.face_x[g] - s * magnets.face_y[g] - magnets.face_x[f]
                        ey = y + s * magnets.face_x[g] + c * magnets.face_y[g] - magnets.face_y[f]
                        a = magnets.face_tx[f], magnets.face_ty[f]
                        bx = c * magnets.face_tx[g] - s * magnets.face_ty[g]
                        by = s * magnets.face_tx[g] + c * magnets.face_ty[g]
                        total = 0.0
                        for m in range(nodes):
                            x0, y0 = ex + offset[row, m] * bx, ey + offset[row, m] * by
                            part = 0.0
                            for k in range(nodes):
                                dx, dy = x0 - offset[row, k] * a[0], y0 - offset[row, k] * a[1]
                                part += weight[row, k] * softened(
                                    dx * dx + dy * dy, soft * soft, magnets.height2, soften
                                )
                            total += weight[row, m] * part
                        out[d, b, e] += COULOMB * (total if f == g else -total)


@kernel
def softened(r2: float, soft2: float, height2: float, soften: Array) -> float:
    """Energy of two lines of unit charge [1/m], the polynomial within the softening radius."""
    if r2 >= soft2:
        return node_law(True, True, height2, 0.0, r2)[1]
    rest = r2 - soft2
    return soften[0] + rest * (soften[1] + rest * (soften[2] + rest * soften[3]))


def _coefficients(values: Array) -> Array:
    """Return the splines' coefficients as `FarTable` has them; angles wrap round."""
    turned = np.ascontiguousarray(np.moveaxis(values, 1, 2))
    filter_rows(turned.reshape(-1, values.shape[1]))
    values = np.ascontiguousarray(np.moveaxis(turned, 2, 1))
    filter_rows(values.reshape(-1, values.shape[2]))
    solve: Any = importlib.import_module("scipy.linalg").solve_banded  # slow to import
    n = len(values)
    band = np.zeros((9, n + 2))
    inner = np.arange(1, n + 1)
    for above, share in ((-1, 1.0 / 6.0), (0, 4.0 / 6.0), (1, 1.0 / 6.0)):
        band[4 - above, inner + above] = share
    for k, share in enumerate((1.0, -4.0, 6.0, -4.0, 1.0)):
        # The last rows say that fourth differences vanish; columns from both ends.
        band[4 - k, k] = share
        band[4 + k, n + 1 - k] = share
    right = np.zeros((n + 2, values[0].size))
    right[1:-1] = values.reshape(n, -1)
    found = solve((4, 4), band, right).reshape(n + 2, *values.shape[1:])
    found = np.pad(found, ((0, 0), (1, 2), (0, 0)), mode="wrap")
    quarter = values.shape[2] // 4
    headings = np.arange(-1, quarter + 2)[:, None] + quarter * np.arange(4)
    return np.ascontiguousarray(found[:, :, headings.ravel() % values.shape[2]])


@kernel
def filter_rows(rows: Array) -> None:
    """Turn periodic values, a period a row, into coefficients of cubic splines."""
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
