"""NamedTuples that kernels see through one pointer, and kernels that others call by their address.

Both are made in `pointer_types`. Where that does not work with the numba that is there, kernels
see the same tuples field by field, and what would call them by address is left to the interpreter:
``code`` is then the kernel itself, and what belongs to a chain its tuple instead of its address.
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
    """Mark a NamedTuple of numbers, C-contiguous arrays and others of its kind."""
    if not POINTERS:
        return cls
    body = {name: getattr(cls, name) for name in ("__doc__", "__module__", "__qualname__")}
    return cast("type[T]", type(cls.__name__, (pointer_types.Packed, cls), body))


def calls_by_address(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a kernel that calls others by their address."""
    return jit.kernel(function) if POINTERS else function


def reference(packed: Any) -> Any:
    """Return by what a marked NamedTuple is named to kernels that call others by their address."""
    return packed.address if POINTERS else packed


def pointer(packed: T) -> T:
    """Return a marked NamedTuple as kernels take it from Python in the least time."""
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
"""Return the address of a kernel's code for arguments of the types of these."""
call_int: Any = pointer_types.call_int if POINTERS else _call
"""Call code ``(Model, State, Work, Record, float) -> int`` by its address and theirs."""
call_float: Any = pointer_types.call_float if POINTERS else _call
"""Call code ``(Model, State, Work, float) -> float`` by its address and theirs."""
take: Any = pointer_types.take if POINTERS else _take
"""Return the entry of a counter, an array of one integer, and add one to it in one go."""
