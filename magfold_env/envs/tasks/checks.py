"""Checks of what users give."""

from collections.abc import Mapping
from typing import Any, TypeVar, get_args

T = TypeVar("T")


def one_of(key: str, value: T, kind: Any) -> T:
    """Return `value` if it is one of the values of the literal type `kind`.

    Raises
    ------
    ValueError
        If it is not.
    """
    if value not in get_args(kind):
        raise ValueError(
            f"{key}: {value!r} is not allowed; must be one of {', '.join(get_args(kind))}"
        )
    return value


def share_of(key: str, value: float) -> float:
    """Return `value` if it is above 0 and at most 1.

    Raises
    ------
    ValueError
        If it is not.
    """
    if not 0.0 < value <= 1.0:
        raise ValueError(f"{key}: {value!r} is not allowed; must be above 0 and at most 1")
    return value


def refuse_unknown(options: Mapping[str, Any], known: type) -> None:
    """Refuse options that the typed dictionary `known` does not have.

    Raises
    ------
    ValueError
        If there is one.
    """
    names = ("scene", *known.__annotations__, "render_mode")
    unknown = sorted(set(options) - set(names))
    if unknown:
        raise ValueError(f"{unknown[0]}: unknown option, must be one of {', '.join(names)}")
