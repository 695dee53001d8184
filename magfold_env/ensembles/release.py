"""The ways a chain is released."""

from __future__ import annotations

from typing import get_args

from magfold_env.minimiser import Mode
from magfold_env.scene import Problem, Scene, SceneError


def release(scene: Scene, mode: Mode, speed: float | None = None) -> Scene:
    """Return a scene whose chain is let go in one of the paper's deployment modes.

    Parameters
    ----------
    scene
        What to release.
    mode
        `free`: all components at once, without a tube. `forward`, `backward`: out of the tube,
        component 1 or component n first.
    speed
        Feed speed [m/s]; None keeps the scene's.

    Raises
    ------
    SceneError
        If an argument is none of these.
    """
    if mode not in get_args(Mode):
        raise SceneError([Problem("mode", mode, f"must be one of {', '.join(get_args(Mode))}")])
    feed = {} if speed is None else {"speed": speed}
    if mode == "free":
        return scene.replace(mount="free", feed=feed)
    return scene.replace(mount="tube", feed={"direction": mode, **feed})
