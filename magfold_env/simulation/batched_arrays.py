"""Many copies of a NamedTuple, side by side in memory; kernels access each through one pointer."""

from collections.abc import Collection, Sequence
from operator import attrgetter
from typing import Any, Generic, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.by_pointer import POINTERS, pointer_types
from magfold_env.engine.state import Array, IntArray

T = TypeVar("T", bound=tuple[Any, ...])

WORD = 8  # bytes
LINE = 8  # words in a cache line; arrays begin at one
_PLACES: dict[tuple[type, str], int] = {}  # places of numbers among the words


class BatchedArrays(Generic[T]):
    """Copies of originals, with the arrays of each copy in one row of a block.

    Parameters
    ----------
    originals
        NamedTuples marked with `by_pointer` that differ only in their values and whose arrays have
        entries of eight bytes. All copies begin as copies of the first.
    count
        Number of copies.
    own
        Names of the arrays that each copy owns, such as ``bodies.mass``; all by default. Copies
        share the original's other arrays.
    """

    def __init__(
        self, originals: Sequence[T], count: int, own: Collection[str] | None = None
    ) -> None:
        self._originals, self._count = list(originals), count
        self._places: dict[str, tuple[int, NDArray[Any]]] = {}
        size = 0
        for name, array in _arrays(originals[0]):
            if own is None or name in own:
                self._places[name] = size, array
                size += -(-array.size // LINE) * LINE
        self._images = np.zeros((len(originals), size))
        for image, original in zip(self._images, originals, strict=True):
            self._fill(image, original)
        self._block = _aligned(count, size)
        self.references: Any = self._words_of_rows() if POINTERS else Rows(self, count)
        """Addresses of the copies for kernels; see `by_pointer.reference`."""
        self.restore(np.arange(count))

    def _fill(self, image: Array, original: T) -> None:
        for name, (start, array) in self._places.items():
            values = attrgetter(name)(original)
            image[start : start + array.size] = values.ravel().view(np.float64)

    def become(self, original: T) -> None:
        """Replace the original of all copies by another with arrays of the same sizes."""
        self._originals = [original]
        self._fill(self._images[0], original)
        if POINTERS:
            words = pointer_types.words_of(original)
            np.copyto(self._word_images[0], words, where=~self._moved)
        self.restore(np.arange(self._count))

    def _words_of_rows(self) -> IntArray:
        """Allocate the words of all copies, and return the address of each."""
        words_of = pointer_types.words_of
        # Words that differ from the original's are addresses in the first row; those of later rows
        # are offset by whole rows.
        images = [words_of(self.row(0, k)) for k in range(len(self._originals))]
        self._word_images = np.array(images)
        self._moved = self._word_images[0] != words_of(self._originals[0])
        self._words = np.empty((self._count, len(images[0])), dtype=np.int64)
        return self._words.ctypes.data + np.arange(self._count) * self._words.strides[0]

    def row(self, row: int, original: int = 0) -> T:
        """Return the copy in a row of the block, with the numbers of one of the originals."""
        arrays = {name: self[name][row] for name in self._places}
        return _with_arrays(self._originals[original], arrays)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return an array of all copies, shape (count, …)."""
        start, array = self._places[name]
        part = self._block[:, start : start + array.size].view(array.dtype)
        return part.reshape(self._count, *array.shape)  # a view, as only the last axis is split

    def number(self, name: str) -> Array:
        """Return one number of every copy, (count,), which may be set between kernel calls."""
        if POINTERS:
            original = self._originals[0]
            if (type(original), name) not in _PLACES:  # finding them is slow
                _PLACES[type(original), name] = pointer_types.place_of(original, name)
            return self._words[:, _PLACES[type(original), name]].view(np.float64)
        return self.references.number(name)

    def restore(self, rows: IntArray, original: int = 0) -> None:
        """Reset some copies to an original."""
        self._block[rows] = self._images[original]
        if POINTERS:
            shift = rows[:, None] * (self._moved * self._block.strides[0])
            self._words[rows] = self._word_images[original] + shift
        else:
            self.references.restore(rows, original)

    def get_state(self) -> Array:
        """Return the contents of the arrays of all copies, (count, size), without numbers."""
        return self._block.copy()

    def set_state(self, state: Array) -> None:
        """Restore all arrays from the result of `get_state`."""
        self._block[:] = state


class Rows:
    """The copies as tuples, for kernels that do not take addresses."""

    def __init__(self, batched: BatchedArrays[Any], count: int) -> None:
        self._batched = batched
        self._rows = [batched.row(k) for k in range(count)]
        self._numbers: dict[str, Array] = {}

    def __getitem__(self, k: int) -> Any:
        """Return a copy with its current numbers."""
        return self._rows[k]._replace(
            **{name: float(values[k]) for name, values in self._numbers.items()}
        )

    def number(self, name: str) -> Array:
        """Return one number of every copy, (count,), which may be set between kernel calls."""
        if name not in self._numbers:
            self._numbers[name] = np.array([getattr(row, name) for row in self._rows])
        return self._numbers[name]

    def restore(self, rows: IntArray, original: int) -> None:
        """Reset some copies to an original."""
        for k in rows.tolist():
            self._rows[k] = self._batched.row(k, original)
            for name, values in self._numbers.items():
                values[k] = getattr(self._rows[k], name)


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
    """Return a NamedTuple with some of its arrays replaced."""
    changes: dict[str, Any] = {}
    for name, value in zip(packed._fields, packed, strict=True):
        if isinstance(value, tuple):
            changes[name] = _with_arrays(value, arrays, f"{prefix}{name}.")
        elif prefix + name in arrays:
            changes[name] = arrays[prefix + name]
    return packed._replace(**changes)


def _aligned(rows: int, size: int) -> Array:
    """Return a block whose rows begin at a cache line; `size` is a multiple of a line."""
    space = np.zeros(rows * size + LINE)
    first = -(space.ctypes.data // WORD) % LINE
    return space[first : first + rows * size].reshape(rows, size)
