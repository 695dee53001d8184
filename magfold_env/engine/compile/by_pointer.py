"""NamedTuples that kernels access through one pointer, and kernels that others call by address.

`pointer_types` implements both. If the installed numba does not support this, kernels get the same
tuples field by field, and Python makes the calls by address: ``code`` is then the kernel itself,
and a chain's data are tuples instead of addresses.
"""

from collections.abc import Callable
from threading import Lock
from typing import Any, ParamSpec, TypeVar, cast

from magfold_env.engine.compile import jit

T = TypeVar("T", bound=tuple[Any, ...])
P = ParamSpec("P")
R = TypeVar("R")

POINTERS = jit.PRIVATE is not None
pointer_types: Any = jit.PRIVATE and jit.PRIVATE.pointer_types


def by_pointer(cls: type[T]) -> type[T]:
    """Mark a NamedTuple of numbers, C-contiguous arrays and marked tuples for use by pointer."""
    if not POINTERS:
        return cls
    body = {name: getattr(cls, name) for name in ("__doc__", "__module__", "__qualname__")}
    return cast("type[T]", type(cls.__name__, (pointer_types.Packed, cls), body))


def calls_by_address(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a kernel that calls other kernels by address."""
    return jit.kernel(function) if POINTERS else function


def reference(packed: Any) -> Any:
    """Return the form of a marked NamedTuple for kernels that call others by address."""
    return packed.address if POINTERS else packed


def pointer(packed: T) -> T:
    """Return a marked NamedTuple in the form that makes kernel calls from Python fastest."""
    return cast("Any", packed).pointer if POINTERS else packed


def _call(code: Any, *arguments: Any) -> Any:
    return code(*arguments)


_counting = Lock()


def _take(counter: Any) -> int:
    with _counting:
        counter[0] += 1
        return int(counter[0]) - 1


def _itself(kernel: Any, *_arguments: Any) -> Any:
    return kernel


code_of: Any = pointer_types.code_of if POINTERS else _itself
"""Return the address of a kernel's code for arguments of the same types as these."""
call_int: Any = pointer_types.call_int if POINTERS else _call
"""Call code ``(Model, State, Work, Record, float) -> int``; code and tuples are addresses."""
call_float: Any = pointer_types.call_float if POINTERS else _call
"""Call code ``(Model, State, Work, float) -> float``; code and tuples are addresses."""
take: Any = pointer_types.take if POINTERS else _take
"""Atomically add one to a counter, an array of one integer; return the old value."""
