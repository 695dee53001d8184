"""Parts of actions as they were given: read, or refused."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.spaces.actions import PATTERNS


def as_integers(values: Any, sizes: tuple[int, ...]) -> NDArray[np.integer] | None:
    """Return `values` as integers from 0 to below `sizes`; None if they are no such."""
    try:
        found = np.asarray(values)
    except ValueError:  # rows of unequal lengths
        return None
    if found.shape != (len(sizes),) or found.dtype.kind not in "iu":
        return None
    for value, size in zip(found.tolist(), sizes, strict=True):
        if not 0 <= value < size:
            return None
    return found


def as_numbers(values: Any, size: int) -> NDArray[np.float64] | None:
    """Return `values` as `size` numbers from −1 to 1; None if they are no such."""
    try:
        found = np.asarray(values)
    except ValueError:
        return None
    if found.shape != (size,) or found.dtype.kind not in "fiu":
        return None
    found = found.astype(np.float64)
    return found if bool((np.abs(found) <= 1.0).all()) else None


def read_catalogue(catalogue: Sequence[str] | None) -> tuple[int, ...]:
    """Return the numbers of the patterns in `catalogue`, ascending; None stands for all 16.

    Raises
    ------
    ValueError
        If it is empty or holds anything but such patterns.
    """
    if catalogue is None:
        return tuple(range(len(PATTERNS)))
    text = isinstance(catalogue, str)
    wrong = [] if text else [faces for faces in catalogue if faces not in PATTERNS]
    if text or wrong or not catalogue:
        raise ValueError(
            f"catalogue: {(wrong[0] if wrong else catalogue)!r} is not allowed; must be a list "
            "of components of four letters N or S, such as ['NSNS', 'NNSS']"
        )
    return tuple(sorted({PATTERNS.index(faces) for faces in catalogue}))
