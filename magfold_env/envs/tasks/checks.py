"""Checks of the arguments that users give to environments.

A value that is not allowed raises a `ValueError` that names the argument, the value given and the
allowed values.
"""

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar, cast, get_args

import numpy as np
from numpy.typing import NDArray

from magfold_env.scene.errors import (
    Problem,
    nearest,
    refuse,
    unless_one_of,
    unless_whole,
)

T = TypeVar("T")


class UnknownOptionError(TypeError, ValueError):
    """An option that an environment does not have.

    It is a `TypeError` with Python's own wording, from which libraries find out what an environment
    accepts, and also a `ValueError`, like all errors about options.
    """


def require(right: bool, key: str, value: object, allowed: str) -> None:
    """Raise an error unless `right`; `allowed` completes the message, as in ``must be 'tube'``."""
    if not right:
        refuse([Problem(key, value, allowed)])


def one_of(key: str, value: T, kind: Any) -> T:
    """Return `value` if a literal type or a sequence contains it; otherwise raise an error."""
    refuse(unless_one_of(key, value, get_args(kind) or kind))
    return value


def whole(key: str, value: int, least: int, most: int | None = 100_000) -> int:
    """Return `value` if it is a whole number within limits; otherwise raise an error."""
    refuse(unless_whole(key, value, least, most))
    return int(value)


def refuse_unknown(options: Mapping[str, Any], known: type) -> None:
    """Raise an error for options that the typed dictionary `known` does not contain."""
    names = ("scene", *known.__annotations__, "render_mode")
    unknown = sorted(set(options) - set(names))
    if unknown:
        raise UnknownOptionError(
            f"got an unexpected keyword argument {unknown[0]!r}; must be one of "
            f"{', '.join(names)}{nearest(unknown[0], names)}"
        )


def seeds_of(seed: int | Sequence[int | None] | None, count: int) -> list[int | None]:
    """Return one seed per environment; from a single number, the seeds count up."""
    if seed is None:
        return [None] * count
    if not hasattr(seed, "__len__"):
        return [whole("seed", cast("int", seed), 0, None) + k for k in range(count)]
    each = _one_each("seed", "seeds", cast("Any", seed), count)
    return [None if one is None else whole("seed", one, 0, None) for one in each]


def mask_of(options: Mapping[str, Any], count: int) -> NDArray[np.bool_]:
    """Return which environments to reset; a mask of another type raises a `TypeError`."""
    key, mask = "options['reset_mask']", cast("Any", options.get("reset_mask"))
    if mask is None:
        return np.ones(count, dtype=np.bool_)
    if not isinstance(mask, np.ndarray) or cast("Any", mask).dtype != np.bool_:
        raise TypeError(f"{key}: {mask!r} is not allowed; must be an array of bool")
    found = cast("NDArray[np.bool_]", mask)
    right = found.shape == (count,) and bool(found.any())
    require(right, key, found, f"must have shape ({count},) and be true somewhere")
    return found


def given_for_each(
    options: Mapping[str, Any], keys: Sequence[str], count: int, kind: type
) -> list[Any] | None:
    """Return the value of option ``keys[0]`` for each environment; None if it is not given.

    A single value, of type `kind`, counts for all environments. Other `keys` are allowed too.
    """
    for key in options:
        one_of("options", key, keys)
    if keys[0] not in options:
        return None
    given = options[keys[0]]
    if isinstance(given, kind) or not hasattr(given, "__len__"):
        return [given] * count
    noun = "words" if kind is str else "numbers"
    return _one_each(f"options[{keys[0]!r}]", noun, given, count)


def _one_each(key: str, noun: str, given: Sequence[Any], count: int) -> list[Any]:
    if len(given) != count:
        raise ValueError(
            f"{key}: {len(given)} {noun} are not allowed; must be one, or {count}, one for each "
            "environment"
        )
    return list(given)
