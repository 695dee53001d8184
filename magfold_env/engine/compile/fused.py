# Numba's own modules know no types.
# pyright: basic

"""One instruction of the processor that Python has no word for."""

from typing import Any, cast

import numba
from numba.core import types
from numba.extending import intrinsic


@cast("Any", intrinsic)
def fma(_typing: Any, a: Any, b: Any, c: Any) -> Any:
    """Return a·b + c, rounded once: not the flag that lets the compiler choose."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


def check() -> None:
    """Raise an error unless the product is not rounded."""

    @numba.njit
    def rest(a: float, b: float, c: float) -> float:
        return fma(a, b, c)

    if rest(0.1, 10.0, -1.0) != 2.0**-54:
        raise RuntimeError("the product is rounded")
