"""Sines, directions, logarithms and roots in plain arithmetic, the same on every machine.

Mathematical libraries differ in the last bits, and if one bit changes, a fold may end differently.
Nothing here calls such a library. Sine, cosine and logarithm also have no branches, so that loops
over them vectorise.
"""

import math
from typing import Any

import numpy as np

from magfold_env.engine.compile.jit import PRIVATE, inlined, interpreted

# Adding and subtracting 1.5·2⁵² rounds a float to an integer, which the sum's low bits hold.
_ROUND = 1.5 * 2.0**52

_TWO_OVER_PI = 2.0 / math.pi
_HALF_PI = math.pi / 2.0
_HALF_PI_REST = 6.123233995736766e-17  # π/2 = _HALF_PI + _HALF_PI_REST, to 107 bits

_SPLIT = 2.0**27 + 1.0  # splits a float's digits into halves, whose products are exact

# The polynomials of fdlibm's k_sin.c and k_cos.c for |r| ≤ π/4.
_S1 = -1.66666666666666324348e-01
_S2 = 8.33333333332248946124e-03
_S3 = -1.98412698298579493134e-04
_S4 = 2.75573137070700676789e-06
_S5 = -2.50507602534068634195e-08
_S6 = 1.58969099521155010221e-10
_C1 = 4.16666666666666019037e-02
_C2 = -1.38888888888741095749e-03
_C3 = 2.48015872894767294178e-05
_C4 = -2.75573143513906633035e-07
_C5 = 2.08757232129817482790e-09
_C6 = -1.13596475577881948265e-11


@inlined
def fma_in_parts(a: float, b: float, c: float) -> float:
    """Return a·b + c, rounded once, by operations that each round; |a| and |b| must be below 2⁹⁹⁶.

    The product and the sums are computed together with their rounding errors. These small parts are
    added with rounding to odd, so that the last sum rounds as if it were the only one [1]_.

    References
    ----------
    .. [1] S. Boldo and G. Melquiond, "Emulation of FMA and correctly rounded sums: proved
       algorithms using rounding to odd", IEEE Transactions on Computers 57 (2008).
    """
    high, low = _product(a, b)
    rest, lower = _sum(c, low)
    total, last = _sum(high, rest)
    odd, error = _sum(lower, last)
    if error != 0.0:
        bits = np.float64(odd).view(np.int64)
        if bits & 1 == 0:
            odd = np.int64(bits + (1 if (error > 0.0) == (odd > 0.0) else -1)).view(np.float64)
    return total + odd


@inlined
def _sum(a: float, b: float) -> tuple[float, float]:
    """Return a + b and its rounding error."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@inlined
def _product(a: float, b: float) -> tuple[float, float]:
    """Return a·b and its rounding error."""
    scaled_a, scaled_b = _SPLIT * a, _SPLIT * b
    a_high, b_high = scaled_a - (scaled_a - a), scaled_b - (scaled_b - b)
    a_low, b_low = a - a_high, b - b_high
    product = a * b
    return product, a_low * b_low - (
        ((product - a_high * b_high) - a_low * b_high) - a_high * b_low
    )


# Returns a·b + c, rounded once wherever it is inlined; `fma_in_parts` takes several times as long.
fma: Any = PRIVATE.fma if PRIVATE else fma_in_parts


@inlined
def sincos(x: float) -> tuple[float, float]:
    """Return the sine and cosine of x [rad] to within 1.3e-16, for |x| ≤ 1e14.

    With x = k π/2 + r, the polynomials give the sine and cosine of r. The two lowest bits of k
    decide which of them is the sine of x, and they decide the signs.
    """
    shifted = fma(x, _TWO_OVER_PI, _ROUND)
    k = shifted - _ROUND
    r = fma(-k, _HALF_PI_REST, fma(-k, _HALF_PI, x))
    z = r * r
    zz = z * z
    # Terms are paired, because fewer operations then depend on one another than in Horner's scheme.
    p = fma(zz, fma(zz, fma(z, _S6, _S5), fma(z, _S4, _S3)), fma(z, _S2, _S1))
    q = fma(zz, fma(zz, fma(z, _C6, _C5), fma(z, _C4, _C3)), fma(z, _C2, _C1))
    s = fma(r * z, p, r)
    c = fma(z, fma(z, q, -0.5), 1.0)
    quadrant = np.float64(shifted).view(np.int64)
    odd = quadrant & 1
    sine = np.float64(c if odd else s).view(np.int64) ^ ((quadrant & 2) << 62)
    cosine = np.float64(s if odd else c).view(np.int64) ^ (((quadrant + 1) & 2) << 62)
    return np.int64(sine).view(np.float64), np.int64(cosine).view(np.float64)


# Tangents of the limits between the three reduction angles, and of the middle angle.
_TAN_PI_16, _TAN_3_PI_16 = 0.198912367379658, 0.6681786379192989
_TAN_PI_8 = math.sqrt(2.0) - 1.0


@inlined
def direction(x: float, y: float) -> float:
    """Return the angle of the vector (x, y) [rad], from −π to π; 0 for a zero vector.

    The relative error is below 6e-16. The angle is first reduced by 0, π/8 or π/4, so that its
    tangent is at most tan π/16. There, ten terms of the arc tangent's series are exact to rounding.
    """
    across, along = abs(y), abs(x)
    steep = across > along
    small, large = (along, across) if steep else (across, along)
    tangent, angle = 0.0, 0.0
    if small > _TAN_3_PI_16 * large:
        tangent, angle = 1.0, 0.25 * math.pi
    elif small > _TAN_PI_16 * large:
        tangent, angle = _TAN_PI_8, 0.125 * math.pi
    below = large + tangent * small
    t = (small - tangent * large) / below if below > 0.0 else 0.0
    s = t * t
    series = 1.0 / 17.0 - s * (1.0 / 19.0)
    series = 1.0 / 15.0 - s * series
    series = 1.0 / 13.0 - s * series
    series = 1.0 / 11.0 - s * series
    series = 1.0 / 9.0 - s * series
    series = 1.0 / 7.0 - s * series
    series = 1.0 / 5.0 - s * series
    series = 1.0 / 3.0 - s * series
    angle += t - t * (s * series)
    if steep:
        angle = _HALF_PI - angle
    if x < 0.0:
        angle = math.pi - angle
    return -angle if y < 0.0 else angle


_LN2 = 0.6931471805599453
_SQRT2 = 1.4142135623730951
_EXPONENT = 0x7FF0000000000000  # the bits of a double's exponent
_BIAS = 1023


@inlined
def log1p(z: float) -> float:
    """Return the natural logarithm of 1 + z for z ≥ 0, with a relative error below 3e-16.

    1 + z is divided by the nearest power of two, which leaves a factor m between 1/√2 and √2. Its
    logarithm, 2 atanh(s) with s = (m − 1)/(m + 1), is computed as a series in s².
    """
    bits = np.float64(_SQRT2 * (1.0 + z)).view(np.int64) & _EXPONENT
    power = np.int64(bits).view(np.float64)
    s = (z + (1.0 - power)) / (z + (1.0 + power))
    s2 = s * s
    series = 1.0 / 21.0
    series = series * s2 + 1.0 / 19.0
    series = series * s2 + 1.0 / 17.0
    series = series * s2 + 1.0 / 15.0
    series = series * s2 + 1.0 / 13.0
    series = series * s2 + 1.0 / 11.0
    series = series * s2 + 1.0 / 9.0
    series = series * s2 + 1.0 / 7.0
    series = series * s2 + 1.0 / 5.0
    series = series * s2 + 1.0 / 3.0
    series = series * s2 + 1.0
    return ((bits >> 52) - _BIAS) * _LN2 + 2.0 * s * series


@inlined
def square(x: float) -> float:
    """Return x², which a library's power function may round differently."""
    return x * x


# The bits of 1, minus an offset that makes a float's bits best approximate its logarithm.
_ONE = 4606979756816785920


@inlined
def inverse_root(x: float, degree: int) -> float:
    """Return x^(−1/degree) with a relative error below 1e-15, for normal x > 0 and degree 3 or 5.

    Newton's method starts from a guess, made by dividing the exponent, that is at most 5 % off.
    """
    y = np.int64(_ONE + (_ONE - np.float64(x).view(np.int64)) // degree).view(np.float64)
    share = 1.0 / degree
    for _ in range(4):
        power = x * y * y * y
        if degree == 5:
            power *= y * y
        y += y * share * (1.0 - power)
    return y


@inlined
def time_across(gap: float, rate: float, acceleration: float) -> tuple[float, float]:
    """Return the first time t > 0 at which r t + a t²/2 = g, and the rate at t; or ∞ and 0.

    Here g ≥ 0 is the gap, r the rate and a the acceleration. The form avoids cancellation.
    """
    root = rate * rate + 2.0 * acceleration * gap
    if rate < 0.0:
        if acceleration > 0.0:
            return (math.sqrt(root) - rate) / acceleration, math.sqrt(root)
    elif root >= 0.0 and rate + math.sqrt(root) > 0.0:
        return 2.0 * gap / (rate + math.sqrt(root)), math.sqrt(root)
    return math.inf, 0.0


@interpreted
def total(values: Any) -> float:
    """Return the sum of fewer than 16 numbers, in NumPy's order."""
    n = values.size
    found, first = 0.0, 0
    if n >= 8:
        pairs = (values[0] + values[1]) + (values[2] + values[3])
        found, first = pairs + ((values[4] + values[5]) + (values[6] + values[7])), 8
    for k in range(first, n):
        found += values[k]
    return found
