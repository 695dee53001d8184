"""Pictures and lines of text of an episode."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chain_state import ChainState
from magfold_env.scene import Scene

RENDER_MODES = ("rgb_array", "ansi")


def check_render_mode(mode: str | None) -> str | None:
    """Return `mode` if there is such a render mode, or None for none.

    Raises
    ------
    ValueError
        If there is not.
    """
    if mode is not None and mode not in RENDER_MODES:
        raise ValueError(
            f"render_mode: {mode!r} is not allowed; "
            f"must be None or one of {', '.join(RENDER_MODES)}"
        )
    return mode


def render_chain(
    mode: str | None,
    scene: Scene,
    state: ChainState,
    released: NDArray[np.bool_],
    target: str,
    caption: str,
) -> Any:
    """Return a chain as an image or as text, as `mode` says; None without one."""
    if mode is None:
        return None
    if mode == "ansi":
        return f"target {target}, {caption}\n"
    # Drawing needs the `render` extra, simulating does not.
    from magfold_env.render import frame  # noqa: PLC0415

    return frame(scene, state.angles, state.base, int(released.sum()), target, caption)
