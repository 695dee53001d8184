"""The energy of magnets far from each other, expanded in powers of size over distance.

In the plane take x + iy for z. A charge q at z from a centre has the moments
m_ab = q z^a z̄^b / (a! b!), and what others do to it enters through the derivatives
v_ab = ∂^a ∂̄^b of their potential at the centre: its energy is the sum of all m_ab v_ab. As m_ba
is the conjugate of m_ab, and magnets have no net charge, five terms are left up to octupoles:
`TERMS`. A face of height H has the same moments but m_11 = q (z z̄ − H²/6) and
m_21 = q z (z z̄/2 − H²/6), since out of the plane ∂²/∂ζ² of 1/r is −4 ∂ ∂̄.

The derivatives of 1/|z| are closed: ∂^a ∂̄^b 1/|z| = g_a g_b z^−a z̄^−b / |z| with
g_a = (−1/2)(−3/2)… of a factors. Turned into the direction of the two centres and divided by powers
of their distance, moments act on each other by constant, real matrices: one for the real parts and
one for the imaginary ones.

Rows of moments and of derivatives hold `PARTS` numbers each, with √(µ0/4π) in both.
"""

import math

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.magnets.laws import COULOMB
from magfold_env.engine.state import Array, Segments

ComplexArray = NDArray[np.complex128]

TERMS = ((1, 0), (1, 1), (2, 0), (2, 1), (3, 0))
COUNTS = (0, 1, 3, 5)  # terms up to an order
OCTUPOLE = 3  # the highest order there is
PARTS = 9
X10, Y10, X11, X20, Y20, X21, Y21, X30, Y30 = range(PARTS)
PAIR_PARTS = 10  # real and imaginary parts of the five terms
IMAGINARY = 5  # where the imaginary ones begin


def _factor(a: int) -> float:
    """Return g_a."""
    return math.prod(-0.5 - k for k in range(a))


def matrices(terms: tuple[tuple[int, int], ...]) -> tuple[Array, Array]:
    """Return what moments (columns) make of derivatives (rows): real and imaginary parts.

    The conjugate terms are in them.
    """
    real, imaginary = np.zeros((2, len(terms), len(terms)))
    for t, (a, b) in enumerate(terms):
        for u, (c, d) in enumerate(terms):
            straight = _factor(a + c) * _factor(b + d)
            crossed = _factor(a + d) * _factor(b + c)
            real[t, u] = straight if c == d else straight + crossed
            imaginary[t, u] = 0.0 if c == d else straight - crossed
    return real, imaginary


_REAL, _IMAGINARY = matrices(TERMS)
_ORDER = np.array([float(a + b) for a, b in TERMS])
_TWIST = np.array([float(a - b) for a, b in TERMS])
_TIMES = np.array([1.0 if a == b else 2.0 for a, b in TERMS])  # a term and its conjugate


def moments(z: ComplexArray, charge: Array, height: float) -> Array:
    """Return a row of moments, shape (9,), of lines of charge that stand at ``z`` (k,) [m].

    Complex numbers are places in the plane, seen from the centre; charges in A·m.
    """
    # In real numbers: processors differ in how they round the products of complex ones.
    x, y = z.real.copy(), z.imag.copy()
    square, rise = x * x + y * y, height * height / 6.0
    u, v = x * x - y * y, 2.0 * x * y
    wide = square / 2.0 - rise
    terms = [x, y, square - rise, u / 2.0, v / 2.0, x * wide, y * wide]
    terms += [(u * x - v * y) / 6.0, (u * y + v * x) / 6.0]
    return math.sqrt(COULOMB) * np.array([np.sum(charge * term) for term in terms])


@inlined
def turn_row(body: Array, i: int, c: float, s: float, out: Array) -> None:
    """Turn row i of the moments ``body`` by the angle of (c, s), into the same row of ``out``."""
    c2, s2 = c * c - s * s, 2.0 * c * s
    c3, s3 = c2 * c - s2 * s, c2 * s + s2 * c
    out[i, X10] = c * body[i, X10] - s * body[i, Y10]
    out[i, Y10] = c * body[i, Y10] + s * body[i, X10]
    out[i, X11] = body[i, X11]
    out[i, X20] = c2 * body[i, X20] - s2 * body[i, Y20]
    out[i, Y20] = c2 * body[i, Y20] + s2 * body[i, X20]
    out[i, X21] = c * body[i, X21] - s * body[i, Y21]
    out[i, Y21] = c * body[i, Y21] + s * body[i, X21]
    out[i, X30] = c3 * body[i, X30] - s3 * body[i, Y30]
    out[i, Y30] = c3 * body[i, Y30] + s3 * body[i, X30]


@kernel
def expand(terms: int, segments: Segments, a: int, b: int, weight: float) -> float:
    """Let rows a and b act on each other, with a weight; returns their energy without it [J].

    Adds to the derivatives ``local`` at both, and to the forces ``push`` [N].
    """
    x, y, local, push, pair = segments.x, segments.y, segments.local, segments.push, segments.turned
    inverse, c, s = direction(x[a] - x[b], y[a] - y[b])
    energy, fx, fy, _ = act_on_each_other(terms, segments.moment, a, b, inverse, c, s, pair)
    c2, s2 = c * c - s * s, 2.0 * c * s
    c3, s3 = c2 * c - s2 * s, c2 * s + s2 * c
    w3 = weight * inverse * inverse * inverse
    for k in range(2):
        v, at = local[a] if k == 0 else local[b], 2 + k
        w2 = weight * inverse * inverse * (1.0 - 2.0 * k)
        w4 = w2 * inverse * inverse
        v[X10] += w2 * (c * pair[at, 0] - s * pair[at, IMAGINARY])
        v[Y10] += w2 * (c * pair[at, IMAGINARY] + s * pair[at, 0])
        if terms >= COUNTS[2]:
            v[X11] += w3 * pair[at, 1]
            v[X20] += w3 * (c2 * pair[at, 2] - s2 * pair[at, IMAGINARY + 2])
            v[Y20] += w3 * (c2 * pair[at, IMAGINARY + 2] + s2 * pair[at, 2])
        if terms >= COUNTS[3]:
            v[X21] += w4 * (c * pair[at, 3] - s * pair[at, IMAGINARY + 3])
            v[Y21] += w4 * (c * pair[at, IMAGINARY + 3] + s * pair[at, 3])
            v[X30] += w4 * (c3 * pair[at, 4] - s3 * pair[at, IMAGINARY + 4])
            v[Y30] += w4 * (c3 * pair[at, IMAGINARY + 4] + s3 * pair[at, 4])
    push[a, 0] += weight * fx
    push[a, 1] += weight * fy
    push[b, 0] -= weight * fx
    push[b, 1] -= weight * fy
    return energy


@inlined
def direction(dx: float, dy: float) -> tuple[float, float, float]:
    """Inverse of a distance [1/m], and the turn (c, s) that lays its vector along x."""
    inverse = 1.0 / math.sqrt(dx * dx + dy * dy)
    return inverse, dx * inverse, -dy * inverse


@inlined
def act_on_each_other(
    terms: int, moment: Array, a: int, b: int, inverse: float, c: float, s: float, pair: Array
) -> tuple[float, float, float, float]:
    """Energy [J], force on row a [N] and torque about its centre [N·m] by row b.

    The `direction` is that from b's centre to a's.
    ``pair`` is left with the moments of both, and what they make of each other, in that frame.
    """
    inverse2 = inverse * inverse
    inverse3 = inverse2 * inverse
    c2, s2 = c * c - s * s, 2.0 * c * s
    c3, s3 = c2 * c - s2 * s, c2 * s + s2 * c
    for k in range(2):
        m = moment[a] if k == 0 else moment[b]
        odd = 1.0 - 2.0 * k  # seen from b, odd terms have the other sign
        w1, w3 = odd * inverse, odd * inverse3
        pair[k, 0] = w1 * (c * m[X10] - s * m[Y10])
        pair[k, 1] = inverse2 * m[X11]
        pair[k, 2] = inverse2 * (c2 * m[X20] - s2 * m[Y20])
        pair[k, 3] = w3 * (c * m[X21] - s * m[Y21])
        pair[k, 4] = w3 * (c3 * m[X30] - s3 * m[Y30])
        pair[k, IMAGINARY] = w1 * (c * m[Y10] + s * m[X10])
        pair[k, IMAGINARY + 1] = 0.0
        pair[k, IMAGINARY + 2] = inverse2 * (c2 * m[Y20] + s2 * m[X20])
        pair[k, IMAGINARY + 3] = w3 * (c * m[Y21] + s * m[X21])
        pair[k, IMAGINARY + 4] = w3 * (c3 * m[Y30] + s3 * m[X30])
    energy, radial, turn, other_turn = 0.0, 0.0, 0.0, 0.0
    for t in range(terms):
        re, im, other_re, other_im = 0.0, 0.0, 0.0, 0.0
        for u in range(terms):
            re += _REAL[t, u] * pair[1, u]
            im += _IMAGINARY[t, u] * pair[1, IMAGINARY + u]
            other_re += _REAL[t, u] * pair[0, u]
            other_im += _IMAGINARY[t, u] * pair[0, IMAGINARY + u]
        pair[2, t], pair[2, IMAGINARY + t] = re, im
        pair[3, t], pair[3, IMAGINARY + t] = other_re, other_im
        x, y = pair[0, t], pair[0, IMAGINARY + t]
        p, q = pair[1, t], pair[1, IMAGINARY + t]
        share = _TIMES[t] * (x * re - y * im)
        energy += share
        radial += _ORDER[t] * (share + _TIMES[t] * (p * other_re - q * other_im))
        turn += 2.0 * _TWIST[t] * (x * im + y * re)
        other_turn += 2.0 * _TWIST[t] * (p * other_im + q * other_re)
    # A power of the distance for every order; and turning all together changes nothing.
    along = (energy + radial) * inverse2
    across = -(turn + other_turn) * inverse2
    return energy * inverse, along * c + across * s, across * c - along * s, turn * inverse


@inlined
def add_shifted_moments(moment: Array, part: int, whole: int, dx: float, dy: float) -> None:
    """Add the moments of row ``part`` to row ``whole``, from whose centre its own is (dx, dy)."""
    p, m = moment[part], moment[whole]
    x10, y10, x11, x20, y20 = p[X10], p[Y10], p[X11], p[X20], p[Y20]
    square = dx * dx + dy * dy
    half_x, half_y = 0.5 * (dx * dx - dy * dy), dx * dy  # of the square of dx + i dy
    m[X10] += x10
    m[Y10] += y10
    m[X11] += x11 + 2.0 * (x10 * dx + y10 * dy)
    m[X20] += x20 + x10 * dx - y10 * dy
    m[Y20] += y20 + x10 * dy + y10 * dx
    m[X21] += p[X21] + x20 * dx + y20 * dy + x11 * dx + x10 * square + x10 * half_x + y10 * half_y
    m[Y21] += p[Y21] + y20 * dx - x20 * dy + x11 * dy + y10 * square + x10 * half_y - y10 * half_x
    m[X30] += p[X30] + x20 * dx - y20 * dy + x10 * half_x - y10 * half_y
    m[Y30] += p[Y30] + x20 * dy + y20 * dx + x10 * half_y + y10 * half_x


@inlined
def add_shifted_derivatives(local: Array, whole: int, part: int, dx: float, dy: float) -> None:
    """Add the derivatives of row ``whole`` to row ``part``, whose centre is (dx, dy) from its own.

    The transpose of `add_shifted_moments`, which keeps forces the gradient of the energy.
    """
    v, w = local[whole], local[part]
    x11, x20, y20 = v[X11], v[X20], v[Y20]
    x21, y21, x30, y30 = v[X21], v[Y21], v[X30], v[Y30]
    square = dx * dx + dy * dy
    half_x, half_y = 0.5 * (dx * dx - dy * dy), dx * dy
    w[X10] += (
        v[X10] + x20 * dx - y20 * dy + x11 * dx
        + x30 * half_x - y30 * half_y + x21 * square + x21 * half_x - y21 * half_y
    )  # fmt: skip
    w[Y10] += (
        v[Y10] + x20 * dy + y20 * dx - x11 * dy
        + x30 * half_y + y30 * half_x + y21 * square - x21 * half_y - y21 * half_x
    )  # fmt: skip
    w[X11] += x11 + 2.0 * (x21 * dx - y21 * dy)
    w[X20] += x20 + x30 * dx - y30 * dy + x21 * dx + y21 * dy
    w[Y20] += y20 + x30 * dy + y30 * dx + y21 * dx - x21 * dy
    w[X21] += x21
    w[Y21] += y21
    w[X30] += x30
    w[Y30] += y30


@inlined
def force_of(moment: Array, local: Array, row: int) -> tuple[float, float]:
    """Force [N] on moments that move with their centre, from the derivatives of a row.

    That is −2 conj(Σ m_ab v_{a+1,b}), as far as there are derivatives.
    """
    m, v = moment[row], local[row]
    x, y = m[X10], m[Y10]
    re = x * v[X20] - y * v[Y20] + x * v[X11] + m[X11] * v[X21]
    im = x * v[Y20] + y * v[X20] - y * v[X11] + m[X11] * v[Y21]
    x, y = m[X20], m[Y20]
    re += x * v[X30] - y * v[Y30] + x * v[X21] - y * v[Y21]
    im += x * v[Y30] + y * v[X30] - x * v[Y21] - y * v[X21]
    return -2.0 * re, 2.0 * im


@inlined
def torque_of(moment: Array, local: Array, row: int) -> float:
    """Torque about the centre [N·m] on moments, from the derivatives of a row."""
    m, v = moment[row], local[row]
    return (
        2.0 * (m[X10] * v[Y10] + m[Y10] * v[X10])
        + 4.0 * (m[X20] * v[Y20] + m[Y20] * v[X20])
        + 2.0 * (m[X21] * v[Y21] + m[Y21] * v[X21])
        + 6.0 * (m[X30] * v[Y30] + m[Y30] * v[X30])
    )
