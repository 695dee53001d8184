"""Many copies of a NamedTuple that kernels see through one pointer, side by side in memory."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, Generic, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.by_pointer import WORD, place_of, words_of
from magfold_env.engine.state import Array, IntArray

T = TypeVar("T", bound=tuple[Any, ...])

LINE = 8  # words of a cache line: arrays begin with one


class Stack(Generic[T]):
    """Copies of ``original``, the arrays of each in one row of a block.

    Parameters
    ----------
    original
        A NamedTuple marked with `by_pointer`, whose arrays have entries of eight bytes.
    count
        How many copies.
    own
        Arrays that each copy has of its own, such as ``bodies.mass``; all by default. The others
        are the original's.
    """

    def __init__(self, original: T, count: int, own: Collection[str] | None = None) -> None:
        self._original, self._count = original, count
        self._places: dict[str, tuple[int, NDArray[Any]]] = {}
        size = 0
        for name, array in _arrays(original):
            if own is None or name in own:
                self._places[name] = size, array
                size += -(-array.size // LINE) * LINE
        self._image = np.zeros(size)
        for start, array in self._places.values():
            self._image[start : start + array.size] = array.ravel().view(np.float64)
        self._block = _aligned(count, size)
        self._block[:] = self._image
        # Words that differ from the original's are addresses in the first row; those of the next
        # rows lie a row further on.
        words = words_of(_with_arrays(original, {name: self[name][0] for name in self._places}))
        moved = words != words_of(original)
        rows = np.arange(count)
        self._words = words + rows[:, None] * (moved * self._block.strides[0])
        self.addresses: IntArray = self._words.ctypes.data + rows * self._words.strides[0]
        """Where the words of each copy begin."""

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return an array of all copies, shape (count, …)."""
        start, array = self._places[name]
        return np.lib.stride_tricks.as_strided(
            self._block[:, start:].view(array.dtype),
            (self._count, *array.shape),
            (self._block.strides[0], *_strides(array.shape)),
        )

    def number(self, name: str) -> Array:
        """Return a number of all copies, (count,), to be set between two calls of kernels."""
        return self._words[:, place_of(self._original, name)].view(np.float64)

    def restore(self, rows: IntArray) -> None:
        """Give the arrays of some copies the original's values again."""
        self._block[rows] = self._image


def _arrays(packed: tuple[Any, ...], prefix: str = "") -> list[tuple[str, NDArray[Any]]]:
    """Return the arrays of a NamedTuple, at any depth, with their names."""
    found: list[tuple[str, NDArray[Any]]] = []
    for name, value in zip(cast("Any", packed)._fields, packed, strict=True):
        if isinstance(value, np.ndarray):
            found.append((prefix + name, cast("NDArray[Any]", value)))
        elif isinstance(value, tuple):
            found += _arrays(cast("tuple[Any, ...]", value), f"{prefix}{name}.")
    return found


def _with_arrays(packed: Any, arrays: dict[str, NDArray[Any]], prefix: str = "") -> Any:
    """Return a NamedTuple with other arrays in some places."""
    changes: dict[str, Any] = {}
    for name, value in zip(packed._fields, packed, strict=True):
        if isinstance(value, tuple):
            changes[name] = _with_arrays(value, arrays, f"{prefix}{name}.")
        elif prefix + name in arrays:
            changes[name] = arrays[prefix + name]
    return packed._replace(**changes)


def _strides(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the strides of a C-contiguous array of words."""
    return tuple(WORD * int(np.prod(shape[axis + 1 :])) for axis in range(len(shape)))


def _aligned(rows: int, size: int) -> Array:
    """Return a block whose rows begin with a cache line; `size` is a multiple of one."""
    space = np.zeros(rows * size + LINE)
    first = -(space.ctypes.data // WORD) % LINE
    return space[first : first + rows * size].reshape(rows, size)
