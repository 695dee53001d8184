"""Sine and cosine without a branch and without a call, so that loops over them vectorise."""

from __future__ import annotations

import math
from typing import Any, cast

import numpy as np
from numba import types
from numba.extending import intrinsic

from magfold_env.engine.compile.jit import inlined, numba_config

# Adding and taking away 1.5·2⁵² rounds a float to an integer and leaves that integer in the
# low bits of the sum.
_ROUND = 1.5 * 2.0**52

_TWO_OVER_PI = 2.0 / math.pi
_HALF_PI = math.pi / 2.0
_HALF_PI_REST = 6.123233995736766e-17  # π/2 = _HALF_PI + _HALF_PI_REST, to 107 bits

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


@intrinsic
def _fused(context: Any, a: Any, b: Any, c: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


def _separate(a: float, b: float, c: float) -> float:
    return a * b + c


# a·b + c, rounded once, wherever the kernel is inlined: not the flag that lets the compiler choose.
# The interpreter has no such operation.
fma: Any = _separate if numba_config.DISABLE_JIT else cast("Any", _fused)


@inlined
def sincos(x: float) -> tuple[float, float]:
    """Sine and cosine of x [rad] to within 1.3e-16, for |x| ≤ 1e14.

    x = k π/2 + r; the polynomials give the sine and the cosine of r, and the two low bits of k
    say which of them is which and their signs.
    """
    shifted = fma(x, _TWO_OVER_PI, _ROUND)
    k = shifted - _ROUND
    r = fma(-k, _HALF_PI_REST, fma(-k, _HALF_PI, x))
    z = r * r
    zz = z * z
    # In pairs, for fewer operations wait for one another than in Horner's scheme.
    p = fma(zz, fma(zz, fma(z, _S6, _S5), fma(z, _S4, _S3)), fma(z, _S2, _S1))
    q = fma(zz, fma(zz, fma(z, _C6, _C5), fma(z, _C4, _C3)), fma(z, _C2, _C1))
    s = fma(r * z, p, r)
    c = fma(z, fma(z, q, -0.5), 1.0)
    quadrant = np.float64(shifted).view(np.int64)
    odd = quadrant & 1
    sine = np.float64(c if odd else s).view(np.int64) ^ ((quadrant & 2) << 62)
    cosine = np.float64(s if odd else c).view(np.int64) ^ (((quadrant + 1) & 2) << 62)
    return np.int64(sine).view(np.float64), np.int64(cosine).view(np.float64)
