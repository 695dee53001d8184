"""Whole arrays within kernels, where an assignment of one to another would allocate."""

from __future__ import annotations

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Array


@inlined
def copy(source: Array, target: Array, first: int) -> None:
    """Copy the entries from ``first`` on."""
    for k in range(first, source.size):
        target[k] = source[k]


@kernel
def is_finite(values: Array) -> bool:
    """Whether every number is."""
    for value in values:
        if not math.isfinite(value):
            return False
    return True
