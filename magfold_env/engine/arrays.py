"""Copies within kernels: an assignment of one array to another would allocate."""

from __future__ import annotations

from magfold_env.engine.jit import inlined
from magfold_env.engine.state import Array


@inlined
def copy(source: Array, target: Array, first: int) -> None:
    """Copy the entries from ``first`` on."""
    for k in range(first, source.size):
        target[k] = source[k]
