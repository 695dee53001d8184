"""How much the physics varies from episode to episode."""

from typing import Literal, get_args

from magfold_env.scene import Scene
from magfold_env.scene_parts import Spreads

Randomisation = Literal["none", "nominal", "scene"]
"""``none``: the same physics every time. ``nominal``: the spreads below. ``scene``: the scene's."""

NOMINAL_SPREADS = Spreads(friction=0.10, remanence=0.05, feed_speed=0.05)
"""Relative half-widths of the uniform draws."""

NOMINAL_ANGLE = 0.03
"""Half-width of the uniform draw of each joint angle at release [rad]."""


def randomised(scene: Scene, randomisation: Randomisation) -> Scene:
    """Return `scene` with the spreads that `randomisation` stands for.

    Raises
    ------
    ValueError
        If `randomisation` is not one of the three names.
    """
    if randomisation == "scene":
        return scene
    if randomisation == "nominal":
        return scene.replace(
            spreads=NOMINAL_SPREADS, start_angle_spread=NOMINAL_ANGLE, start_angles=None
        )
    if randomisation == "none":
        return scene.replace(spreads=Spreads(), start_angle_spread=0.0)
    raise ValueError(
        f"randomisation: {randomisation!r} is not allowed; "
        f"must be one of {', '.join(get_args(Randomisation))}"
    )
