"""What users of vector environments may give, checked."""

import os
from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from magfold_env.envs.tasks.targets import pick_target


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
    """Refuse too few environments, and windows.

    Raises
    ------
    ValueError
        If there is nothing to step, or many would be shown in windows.
    """
    if num_envs < 1:
        raise ValueError(f"num_envs: {num_envs!r} is not allowed; must be 1 or more")
    if render_mode == "human":
        raise ValueError(
            "render_mode: 'human' is not allowed with many environments; must be None, "
            "'rgb_array' or 'ansi'"
        )


def threads_of(threads: int | None) -> int:
    """Return how many threads to use; None stands for as many as the process may use cores.

    Raises
    ------
    ValueError
        If it is less than one.
    """
    if threads is None:
        usable = getattr(os, "sched_getaffinity", None)
        return len(usable(0)) if usable else os.cpu_count() or 1
    if threads < 1:
        raise ValueError(f"threads: {threads!r} is not allowed; must be 1 or more, or None")
    return threads


def seeds_of(seed: int | Sequence[int | None] | None, count: int) -> list[int | None]:
    """Return a seed for each environment: one number is the first's, and the others follow on.

    Raises
    ------
    ValueError
        If there are not as many as environments.
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
    """Return which environments `reset` is to reset.

    Raises
    ------
    ValueError
        If the mask says of too few or too many, or of none.
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


def targets_of(options: Mapping[str, Any], targets: Sequence[str], count: int) -> list[int] | None:
    """Return the numbers of the targets that `reset` is told to take; None where it is to draw.

    Raises
    ------
    ValueError
        For an unknown option, or a word that is not among the targets.
    """
    unknown = sorted(set(options) - {"target", "reset_mask"})
    if unknown:
        raise ValueError(
            f"options: {unknown[0]!r} is not allowed; must be one of 'target', 'reset_mask'"
        )
    if "target" not in options:
        return None
    given = options["target"]
    words = [given] * count if isinstance(given, str) else list(given)
    if len(words) != count:
        raise ValueError(
            f"options['target']: {len(words)} words are not allowed; must be one, or {count}, one "
            "for each environment"
        )
    numbers = {word: number for number, word in reversed(list(enumerate(targets)))}
    return [numbers[pick_target(word, targets)] for word in words]
