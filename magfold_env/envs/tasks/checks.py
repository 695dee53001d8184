"""Checks of the arguments of environments."""

import os
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar, cast, get_args

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

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


def whole(key: str, value: int, least: int, also: str = ", a whole number") -> int:
    """Return `value` if it is a whole number, `least` or more; `also` is added to what is allowed.

    Raises
    ------
    ValueError
        If it is not.
    """
    given: Any = value
    if isinstance(given, bool) or not isinstance(given, (int, np.integer)) or given < least:
        raise ValueError(f"{key}: {value!r} is not allowed; must be {least} or more{also}")
    return int(value)


def share_of(key: str, value: float) -> float:
    """Return `value` if it is above 0 and at most 1.

    Raises
    ------
    ValueError
        If it is not.
    """
    given: Any = value
    if not isinstance(given, (int, float)) or not 0.0 < given <= 1.0:
        raise ValueError(f"{key}: {value!r} is not allowed; must be above 0 and at most 1")
    return value


def refuse_unknown(options: Mapping[str, Any], known: type) -> None:
    """Refuse options that the typed dictionary `known` does not contain.

    Raises
    ------
    ValueError
        If there is one.
    """
    names = ("scene", *known.__annotations__, "render_mode")
    unknown = sorted(set(options) - set(names))
    if unknown:
        raise ValueError(f"{unknown[0]}: unknown option, must be one of {', '.join(names)}")


def autoreset_mode_of(mode: AutoresetMode | str) -> AutoresetMode:
    """Return Gymnasium's mode.

    Raises
    ------
    ValueError
        If there is no such mode.
    """
    try:
        return AutoresetMode(mode)
    except ValueError:
        names = ", ".join(each.value for each in AutoresetMode)
        raise ValueError(
            f"autoreset_mode: {mode!r} is not allowed; must be one of {names}"
        ) from None


def check_count(num_envs: int, render_mode: str | None) -> None:
    """Refuse too few environments, and modes that show the motion of a single one.

    Raises
    ------
    ValueError
        If there is nothing to step, or the mode is ``human`` or ``rgb_array_list``.
    """
    whole("num_envs", num_envs, 1)
    if render_mode in ("human", "rgb_array_list"):
        raise ValueError(
            f"render_mode: {render_mode!r} is not allowed with many environments; must be None, "
            "'rgb_array' or 'ansi'"
        )


def threads_of(threads: int | None) -> int:
    """Return the number of threads to use; None means one per core that the process may use.

    Raises
    ------
    ValueError
        If it is less than one.
    """
    if threads is None:
        usable = getattr(os, "sched_getaffinity", None)
        return len(usable(0)) if usable else os.cpu_count() or 1
    return whole("threads", threads, 1, ", or None")


def seeds_of(seed: int | Sequence[int | None] | None, count: int) -> list[int | None]:
    """Return a seed for each environment; a single number seeds the first, and the rest count up.

    Raises
    ------
    ValueError
        If the number of seeds is not the number of environments.
    """
    if seed is None:
        return [None] * count
    if isinstance(seed, (int, np.integer)):
        return [int(seed) + k for k in range(count)]
    if len(seed) != count:
        raise ValueError(
            f"seed: {len(seed)} seeds are not allowed; must be one, or {count}, one for each "
            "environment"
        )
    return list(seed)


def mask_of(options: Mapping[str, Any], count: int) -> NDArray[np.bool_]:
    """Return the mask of the environments that `reset` resets.

    Raises
    ------
    ValueError
        If the mask has the wrong length or selects no environment.
    TypeError
        If it is not an array of bool.
    """
    mask: Any = options.get("reset_mask")
    if mask is None:
        return np.ones(count, dtype=np.bool_)
    if not isinstance(mask, np.ndarray) or cast("Any", mask).dtype != np.bool_:
        raise TypeError(f"options['reset_mask']: {mask!r} is not allowed; must be an array of bool")
    found = cast("NDArray[np.bool_]", mask)
    if found.shape != (count,) or not found.any():
        raise ValueError(
            f"options['reset_mask']: {mask!r} is not allowed; must have shape ({count},) and be "
            "true somewhere"
        )
    return found


def given_for_each(
    options: Mapping[str, Any], keys: Sequence[str], count: int, kind: type
) -> list[Any] | None:
    """Return the value that the options of `reset` set for each environment; None to draw it.

    Parameters
    ----------
    options : mapping
        The options of `reset`.
    keys : sequence of str
        The allowed options; the first one is read.
    count : int
        Number of environments.
    kind : type
        Type of a single value, which applies to all; otherwise there must be one per environment.

    Raises
    ------
    ValueError
        For an unknown option, or another number of values.
    """
    unknown = sorted(set(options) - set(keys))
    if unknown:
        names = ", ".join(map(repr, keys))
        must = f"one of {names}" if len(keys) > 1 else names
        raise ValueError(f"options: {unknown[0]!r} is not allowed; must be {must}")
    if keys[0] not in options:
        return None
    given = options[keys[0]]
    if isinstance(given, kind) or not hasattr(given, "__len__"):
        return [given] * count
    found: list[Any] = list(given)
    if len(found) != count:
        raise ValueError(
            f"options[{keys[0]!r}]: {len(found)} {'words' if kind is str else 'numbers'} are not "
            f"allowed; must be one, or {count}, one for each environment"
        )
    return found
