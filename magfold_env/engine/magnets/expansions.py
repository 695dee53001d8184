"""Pairs of casings far from each other: the expansion of `magnets.multipoles`, to higher orders.

Casings are small beside their distances from a few neighbours on, so a few more terms take the
place of sums over nodes there. A charge q that stands on the plane at z from the centre, its height
H, has the moments

    m_ab = q Σ_k z^(a−k) z̄^(b−k) / ((a−k)! (b−k)!) · (−H²)^k / (2k + 1)!

since out of the plane ∂²/∂ζ² of 1/r is −4 ∂ ∂̄, and the mean of ζ^2k over the height is
H^2k / (4^k (2k + 1)). Of two casings' moments those act on each other whose orders together exceed
the highest one by no more than one: without net charges, all others of that size are missing too.
"""

import math

import numpy as np

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.magnets.laws import COULOMB
from magfold_env.engine.magnets.multipoles import ComplexArray, matrices
from magfold_env.engine.state import Array

HIGHEST = 7  # order there is
ORDERS = range(HIGHEST + 1)
TERMS = tuple((a, k - a) for k in ORDERS[1:] for a in range((k + 1) // 2, k + 1))
MOST = len(TERMS)
# Rows of scratch: moments of both, what turns and scales them, powers of z and of |z|².
A_RE, A_IM, B_RE, B_IM, TURN_RE, TURN_IM, POWER_RE, POWER_IM, SQUARE = range(9)
SCRATCH = (9, MOST)

_TOTAL = [a + b for a, b in TERMS]
COUNTS = np.array([sum(total <= order for total in _TOTAL) for order in ORDERS])  # of terms
# How many terms each acts on, at every order of the expansion.
_PARTNERS = np.array([[COUNTS[max(min(k, k + 1 - t), 0)] for t in _TOTAL] for k in ORDERS])
_REAL, _IMAGINARY = matrices(TERMS)
_ORDER = np.array(_TOTAL, dtype=np.float64)
_SIGN = np.array([-1.0 if total % 2 else 1.0 for total in _TOTAL])
_TWIST = np.array([a - b for a, b in TERMS])
_SQUARES = np.array([b for _, b in TERMS])
_TIMES = np.array([1.0 if a == b else 2.0 for a, b in TERMS])  # a term and its conjugate


def wide_moments(z: ComplexArray, charge: Array, height: float) -> Array:
    """Return moments, real and imaginary parts (2, terms), of lines of charge at ``z`` (k,) [m].

    Complex numbers are places in the plane, seen from the centre; charges in A·m.
    """
    # In real numbers: processors differ in how they round the products of complex ones.
    x, y = z.real.copy(), z.imag.copy()
    squares, real, imaginary = [np.ones(x.size)], [np.ones(x.size)], [np.zeros(x.size)]
    for _ in range(HIGHEST):
        squares.append(squares[-1] * (x * x + y * y))
        u, v = real[-1], imaginary[-1]
        real.append(u * x - v * y)
        imaginary.append(u * y + v * x)
    found = np.zeros((2, MOST))
    for t, (a, b) in enumerate(TERMS):
        rise = 1.0
        for k in range(b + 1):
            share = math.factorial(a - k) * math.factorial(b - k) * math.factorial(2 * k + 1)
            for part, power in enumerate((real[a - b], imaginary[a - b])):
                found[part, t] += rise / share * np.sum(charge * squares[b - k] * power)
            rise *= -height * height
    return math.sqrt(COULOMB) * found


@inlined
def find_turns(order: int, zr: float, zi: float, inverse2: float, s: Array) -> None:
    """Fill what turns and scales every term: z^a z̄^b, of z = zr + i zi with |z|² = ``inverse2``."""
    s[POWER_RE, 0], s[POWER_IM, 0], s[SQUARE, 0] = 1.0, 0.0, 1.0
    for k in range(1, order + 1):
        u, v = s[POWER_RE, k - 1], s[POWER_IM, k - 1]
        s[POWER_RE, k] = u * zr - v * zi
        s[POWER_IM, k] = u * zi + v * zr
        s[SQUARE, k] = s[SQUARE, k - 1] * inverse2
    for t in range(COUNTS[order]):
        square = s[SQUARE, _SQUARES[t]]
        s[TURN_RE, t] = square * s[POWER_RE, _TWIST[t]]
        s[TURN_IM, t] = square * s[POWER_IM, _TWIST[t]]


@inlined
def turn_moments(
    order: int, body: Array, i: int, c: float, s: float, scratch: Array, out: Array
) -> None:
    """Turn casing i's moments ``body`` (n, 2, terms) by the angle of (c, s), into ``out``."""
    find_turns(order, c, s, 1.0, scratch)
    for t in range(COUNTS[order]):
        x, y, fr, fi = body[i, 0, t], body[i, 1, t], scratch[TURN_RE, t], scratch[TURN_IM, t]
        out[i, 0, t] = fr * x - fi * y
        out[i, 1, t] = fr * y + fi * x


@kernel
def expansion(
    order: int, moment: Array, a: int, b: int, dx: float, dy: float, s: Array
) -> tuple[float, float, float, float]:
    """Energy [J], force on casing a [N] and torque about its centre [N·m] by casing b.

    ``dx``, ``dy`` [m] is from b's centre to a's; ``moment`` (n, 2, terms) is turned into the
    world's frame, and ``s`` scratch of the shape `SCRATCH`.
    """
    inverse2 = 1.0 / (dx * dx + dy * dy)
    inverse = math.sqrt(inverse2)
    find_turns(order, dx * inverse2, -dy * inverse2, inverse2, s)
    terms = COUNTS[order]
    for t in range(terms):
        fr, fi = s[TURN_RE, t], s[TURN_IM, t]
        u, v = moment[a, 0, t], moment[a, 1, t]
        s[A_RE, t], s[A_IM, t] = fr * u - fi * v, fr * v + fi * u
        # Seen from b, odd terms have the other sign.
        u, v = _SIGN[t] * moment[b, 0, t], _SIGN[t] * moment[b, 1, t]
        s[B_RE, t], s[B_IM, t] = fr * u - fi * v, fr * v + fi * u
    energy, radial, turn, other_turn = 0.0, 0.0, 0.0, 0.0
    for t in range(terms):
        re, im, other_re, other_im = 0.0, 0.0, 0.0, 0.0
        for k in range(_PARTNERS[order, t]):
            re += _REAL[t, k] * s[B_RE, k]
            im += _IMAGINARY[t, k] * s[B_IM, k]
            other_re += _REAL[t, k] * s[A_RE, k]
            other_im += _IMAGINARY[t, k] * s[A_IM, k]
        x, y, p, q = s[A_RE, t], s[A_IM, t], s[B_RE, t], s[B_IM, t]
        share = _TIMES[t] * (x * re - y * im)
        energy += share
        radial += _ORDER[t] * (share + _TIMES[t] * (p * other_re - q * other_im))
        turn += 2.0 * _TWIST[t] * (x * im + y * re)
        other_turn += 2.0 * _TWIST[t] * (p * other_im + q * other_re)
    # A power of the distance for every order; and turning all together changes nothing.
    along = (energy + radial) * inverse2 * inverse
    across = (turn + other_turn) * inverse2 * inverse
    return energy * inverse, along * dx + across * dy, along * dy - across * dx, turn * inverse
