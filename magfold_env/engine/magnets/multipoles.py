"""The energy of distant magnets, expanded in powers of size over distance.

Let z = x + iy in the plane. An upright line of charge q and height H, at z from a centre, has the
moments

    m_ab = q Σ_k z^(a−k) z̄^(b−k) / ((a−k)! (b−k)!) · (−H²)^k / (2k + 1)!

since out of the plane ∂²/∂ζ² of 1/r is −4 ∂ ∂̄, and the mean of ζ^2k over the height is H^2k / (4^k
(2k + 1)). The action of other charges enters through the derivatives v_ab = ∂^a ∂̄^b of their
potential at the centre: the energy is the sum of all m_ab v_ab. Since m_ba is the conjugate of m_ab
and magnets have no net charge, the `TERMS` suffice.

The derivatives of 1/|z| have a closed form: ∂^a ∂̄^b 1/|z| = g_a g_b z^−a z̄^−b / |z| with g_a =
(−1/2)(−3/2)… of a factors. Turned into the direction between the centres and divided by powers of
their distance, moments interact by constant real matrices, one for real and one for imaginary
parts. Moments of two bodies interact if the sum of their orders exceeds the highest order by at
most one: all other terms of that size contain a net charge, and thus vanish.

Moments and derivatives are arrays (rows, 2, terms) of real and imaginary parts; both contain the
factor √(µ0/4π). Pairs of casings are expanded to their rule's order, segments of the chain
(`magnets.multipole_tree`) to `OCTUPOLES`.
"""

import math
from itertools import product

import numpy as np

from magfold_env.engine.compile.jit import inlined, interpreted, kernel
from magfold_env.engine.elementary import total
from magfold_env.engine.magnets.laws import COULOMB
from magfold_env.engine.state import Array, IntArray, Segments

HIGHEST = 7  # largest order
ORDERS = range(HIGHEST + 1)
TERMS = tuple((a, k - a) for k in ORDERS[1:] for a in range((k + 1) // 2, k + 1))
MOST = len(TERMS)
OCTUPOLES = 3  # the order of segments
D10, D11, D20, D21, D30 = range(5)  # the terms up to this order
# Rows of scratch: moments of both, factors that turn and scale them, powers of z and of |z|², and
# the derivatives that each causes at the other.
A_RE, A_IM, B_RE, B_IM, TURN_RE, TURN_IM, POWER_RE, POWER_IM, SQUARE = range(9)
AT_A_RE, AT_A_IM, AT_B_RE, AT_B_IM = range(9, 13)

_TOTAL = [a + b for a, b in TERMS]
COUNTS = np.array([sum(total <= order for total in _TOTAL) for order in ORDERS])  # numbers of terms
# Number of terms with which each term interacts, at every order of the expansion.
_PARTNERS = np.array([[COUNTS[max(min(k, k + 1 - t), 0)] for t in _TOTAL] for k in ORDERS])
_ORDER = np.array(_TOTAL, dtype=np.float64)
_SIGN = np.array([-1.0 if total % 2 else 1.0 for total in _TOTAL])
_TWIST = np.array([a - b for a, b in TERMS])
_SQUARES = np.array([b for _, b in TERMS])
_SHARES = np.ones((MOST, 1 + max(_SQUARES)))  # products of factorials
for (_t, (_a, _b)), _k in product(enumerate(TERMS), range(1 + max(_SQUARES))):
    if _k <= _b:
        _SHARES[_t, _k] = math.prod(map(math.factorial, (_a - _k, _b - _k, 2 * _k + 1)))
_TIMES = np.array([1.0 if a == b else 2.0 for a, b in TERMS])  # counts a term and its conjugate


def _matrices() -> tuple[Array, Array]:
    """Return matrices from moments (columns) to derivatives (rows), for real and imaginary parts.

    They include the conjugate terms.
    """
    g = [math.prod(-0.5 - k for k in range(a)) for a in range(2 * HIGHEST + 1)]
    real, imaginary = np.zeros((2, MOST, MOST))
    for (t, (a, b)), (u, (c, d)) in product(enumerate(TERMS), enumerate(TERMS)):
        straight, crossed = g[a + c] * g[b + d], g[a + d] * g[b + c]
        real[t, u] = straight if c == d else straight + crossed
        imaginary[t, u] = 0.0 if c == d else straight - crossed
    return real, imaginary


_REAL, _IMAGINARY = _matrices()


def _shifts(way: int) -> tuple[IntArray, Array]:
    """Return all contributions of a shift by d to the terms up to octupoles.

    Each is a term times d^j d̄^k / (j! k!): a lower term for moments (``way`` −1), a higher one for
    derivatives (1). One array holds the changed term, the source term, and the powers of d and
    |d|²; the other holds a factor and the signs of both parts.
    """
    rows: list[list[int]] = []
    factors: list[list[float]] = []
    powers = range(OCTUPOLES)
    for (t, (a, b)), j, k in product(enumerate(TERMS[: COUNTS[OCTUPOLES]]), powers, powers):
        c, d = a + way * j, b + way * k
        if min(c, d) >= 0 and 1 <= c + d <= OCTUPOLES:
            rows.append([t, TERMS.index((max(c, d), min(c, d))), abs(j - k), min(j, k)])
            share = 1.0 / (math.factorial(j) * math.factorial(k))
            factors.append([share, 1.0 if c >= d else -1.0, 1.0 if j >= k else -1.0])
    return np.array(rows), np.array(factors)


_UP, _UP_FACTORS = _shifts(-1)
_DOWN, _DOWN_FACTORS = _shifts(1)


@interpreted
def moments(x: Array, y: Array, charge: Array, height: float, powers: Array, out: Array) -> None:
    """Fill in the moments of lines of charge: real and imaginary parts (2, terms).

    ``x`` and ``y`` (k,) are the lines' positions in the plane relative to the centre [m]. Charges
    are in A·m; ``powers`` (4, orders + 1, k) is scratch.
    """
    square, real, imaginary, part = powers[0], powers[1], powers[2], powers[3, 0]
    for p in range(x.size):
        square[0, p], real[0, p], imaginary[0, p] = 1.0, 1.0, 0.0
        for k in range(HIGHEST):
            square[k + 1, p] = square[k, p] * (x[p] * x[p] + y[p] * y[p])
            real[k + 1, p] = real[k, p] * x[p] - imaginary[k, p] * y[p]
            imaginary[k + 1, p] = real[k, p] * y[p] + imaginary[k, p] * x[p]
    for t in range(MOST):
        for way in range(2):
            rise, found = 1.0, 0.0
            for k in range(_SQUARES[t] + 1):
                for p in range(x.size):
                    factor = powers[1 + way, _TWIST[t], p]
                    part[p] = charge[p] * square[_SQUARES[t] - k, p] * factor
                found += rise / _SHARES[t, k] * total(part)
                rise *= -height * height
            out[way, t] = math.sqrt(COULOMB) * found


@inlined
def clear(values: Array, row: int, order: int) -> None:
    """Clear a row of moments or derivatives up to an order."""
    for t in range(COUNTS[order]):
        values[row, 0, t], values[row, 1, t] = 0.0, 0.0


@inlined
def find_powers(order: int, zr: float, zi: float, square: float, s: Array) -> None:
    """Fill in the powers of z = zr + i zi and of |z|² = ``square`` up to an order."""
    s[POWER_RE, 0], s[POWER_IM, 0], s[SQUARE, 0] = 1.0, 0.0, 1.0
    for k in range(1, order + 1):
        u, v = s[POWER_RE, k - 1], s[POWER_IM, k - 1]
        s[POWER_RE, k] = u * zr - v * zi
        s[POWER_IM, k] = u * zi + v * zr
        s[SQUARE, k] = s[SQUARE, k - 1] * square


@inlined
def find_turns(order: int, zr: float, zi: float, square: float, s: Array) -> None:
    """Fill in each term's factor z^a z̄^b, for z = zr + i zi with |z|² = ``square``."""
    find_powers(order, zr, zi, square, s)
    for t in range(COUNTS[order]):
        s[TURN_RE, t] = s[SQUARE, _SQUARES[t]] * s[POWER_RE, _TWIST[t]]
        s[TURN_IM, t] = s[SQUARE, _SQUARES[t]] * s[POWER_IM, _TWIST[t]]


@inlined
def turn_moments(order: int, i: int, c: float, s: float, segments: Segments) -> None:
    """Turn casing i's moments by the angle of (c, s), from its own frame into the world's."""
    body, moment, scratch = segments.body, segments.moment, segments.scratch
    find_turns(order, c, s, 1.0, scratch)
    for t in range(COUNTS[order]):
        x, y, fr, fi = body[i, 0, t], body[i, 1, t], scratch[TURN_RE, t], scratch[TURN_IM, t]
        moment[i, 0, t] = fr * x - fi * y
        moment[i, 1, t] = fr * y + fi * x


@kernel
def expansion(
    order: int, moment: Array, a: int, b: int, dx: float, dy: float, s: Array
) -> tuple[float, float, float, float]:
    """Return the energy [J], and the force [N] and torque [N·m] of row b on row a.

    The torque is about a's centre; (``dx``, ``dy``) [m] points from b's centre to a's. The scratch
    keeps the derivatives that each row causes at the other, divided by powers of the distance, in a
    frame along (``dx``, ``dy``).
    """
    inverse2 = 1.0 / (dx * dx + dy * dy)
    inverse = math.sqrt(inverse2)
    find_turns(order, dx * inverse2, -dy * inverse2, inverse2, s)
    terms = COUNTS[order]
    for t in range(terms):
        fr, fi = s[TURN_RE, t], s[TURN_IM, t]
        u, v = moment[a, 0, t], moment[a, 1, t]
        s[A_RE, t], s[A_IM, t] = fr * u - fi * v, fr * v + fi * u
        # Relative to b, odd terms have the opposite sign.
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
        s[AT_A_RE, t], s[AT_A_IM, t], s[AT_B_RE, t], s[AT_B_IM, t] = re, im, other_re, other_im
        x, y, p, q = s[A_RE, t], s[A_IM, t], s[B_RE, t], s[B_IM, t]
        share = _TIMES[t] * (x * re - y * im)
        energy += share
        radial += _ORDER[t] * (share + _TIMES[t] * (p * other_re - q * other_im))
        turn += 2.0 * _TWIST[t] * (x * im + y * re)
        other_turn += 2.0 * _TWIST[t] * (p * other_im + q * other_re)
    # Each order has a power of the distance, and a common rotation does not change the energy.
    along = (energy + radial) * inverse2 * inverse
    across = (turn + other_turn) * inverse2 * inverse
    return energy * inverse, along * dx + across * dy, along * dy - across * dx, turn * inverse


@kernel
def expand_segments(segments: Segments, a: int, b: int, weight: float) -> float:
    """Add the weighted interaction of rows a and b; return their energy without the weight [J].

    Adds to the derivatives ``local`` at both rows, and to their forces ``push`` [N].
    """
    local, push, s = segments.local, segments.push, segments.scratch
    dx, dy = segments.x[a] - segments.x[b], segments.y[a] - segments.y[b]
    energy, fx, fy, _ = expansion(OCTUPOLES, segments.moment, a, b, dx, dy, s)
    inverse = weight / math.sqrt(dx * dx + dy * dy)
    for t in range(COUNTS[OCTUPOLES]):
        fr, fi = inverse * s[TURN_RE, t], inverse * s[TURN_IM, t]
        local[a, 0, t] += fr * s[AT_A_RE, t] - fi * s[AT_A_IM, t]
        local[a, 1, t] += fr * s[AT_A_IM, t] + fi * s[AT_A_RE, t]
        local[b, 0, t] += _SIGN[t] * (fr * s[AT_B_RE, t] - fi * s[AT_B_IM, t])
        local[b, 1, t] += _SIGN[t] * (fr * s[AT_B_IM, t] + fi * s[AT_B_RE, t])
    push[a, 0] += weight * fx
    push[a, 1] += weight * fy
    push[b, 0] -= weight * fx
    push[b, 1] -= weight * fy
    return energy


@inlined
def add_moments(segments: Segments, part: int, whole: int) -> None:
    """Shift the moments of row ``part`` to the centre of row ``whole`` and add them there."""
    dx, dy = segments.x[part] - segments.x[whole], segments.y[part] - segments.y[whole]
    _shift(_UP, _UP_FACTORS, segments.moment, part, whole, dx, dy, segments.scratch)


@inlined
def add_derivatives(segments: Segments, whole: int, part: int) -> None:
    """Shift the derivatives at row ``whole`` to the centre of row ``part`` and add them there.

    This is the transpose of `add_moments`, so that forces remain the gradient of the energy.
    """
    dx, dy = segments.x[part] - segments.x[whole], segments.y[part] - segments.y[whole]
    _shift(_DOWN, _DOWN_FACTORS, segments.local, whole, part, dx, dy, segments.scratch)


@inlined
def _shift(
    rows: IntArray, factors: Array, values: Array, source: int, target: int,
    dx: float, dy: float, s: Array,
) -> None:  # fmt: skip
    """Add one row of moments or derivatives to another row, shifted by (dx, dy) [m]."""
    find_powers(OCTUPOLES, dx, dy, dx * dx + dy * dy, s)
    for e in range(rows.shape[0]):
        t, u, power, square = rows[e, 0], rows[e, 1], rows[e, 2], rows[e, 3]
        x, y = values[source, 0, u], factors[e, 1] * values[source, 1, u]
        share = factors[e, 0] * s[SQUARE, square]
        p, q = share * s[POWER_RE, power], share * factors[e, 2] * s[POWER_IM, power]
        values[target, 0, t] += p * x - q * y
        values[target, 1, t] += p * y + q * x


@inlined
def force_of(segments: Segments, row: int) -> tuple[float, float]:
    """Return the force [N] on moments that move with their centre, from a row's derivatives.

    It is −2 conj(Σ m_ab v_{a+1,b}), up to the highest available derivatives.
    """
    m, v = segments.moment[row], segments.local[row]
    x, y = m[0, D10], m[1, D10]
    re = x * v[0, D20] - y * v[1, D20] + x * v[0, D11] + m[0, D11] * v[0, D21]
    im = x * v[1, D20] + y * v[0, D20] - y * v[0, D11] + m[0, D11] * v[1, D21]
    x, y = m[0, D20], m[1, D20]
    re += x * v[0, D30] - y * v[1, D30] + x * v[0, D21] - y * v[1, D21]
    im += x * v[1, D30] + y * v[0, D30] - x * v[1, D21] - y * v[0, D21]
    return -2.0 * re, 2.0 * im


@inlined
def torque_of(segments: Segments, row: int) -> float:
    """Return the torque about the centre [N·m] on moments, from a row's derivatives."""
    m, v, torque = segments.moment[row], segments.local[row], 0.0
    for t in range(COUNTS[OCTUPOLES]):
        torque += 2.0 * _TWIST[t] * (m[0, t] * v[1, t] + m[1, t] * v[0, t])
    return torque
