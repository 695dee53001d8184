"""The same physics seen in a mirror, from another side, or from the chain's other end."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from magfold_env.scene import Scene
from magfold_env.shapes import centres, headings

Floats = npt.NDArray[np.float64]

MIRRORED = (3, 2, 1, 0)  # faces: front-left <-> front-right, back-left <-> back-right
OTHER_END = (2, 3, 0, 1)
SIZES = ("width", "height", "thickness", "inset")


def mirrored(scene: Scene) -> Scene:
    """Return the mirror image: left is right, y is −y."""
    assert scene.start_angles is not None
    changes = faces(scene, MIRRORED, 1)
    changes["start_angles"] = [-angle for angle in scene.start_angles]
    return _around(scene.replace(**changes), np.diag([1.0, -1.0]))


def turned(scene: Scene, angle: float) -> Scene:
    """Return the scene whose surroundings are turned by an angle [rad] about the origin.

    Nothing in a scene says which way a chain heads at first: its headings are to be turned too.
    """
    c, s = math.cos(angle), math.sin(angle)
    return _around(scene, np.array([[c, -s], [s, c]]))


def seen_from_other_end(scene: Scene) -> Scene:
    """Return a free or fed chain with components counted from the other end.

    A free chain then begins along +x with the other end at the origin: its surroundings move.
    """
    assert scene.start_angles is not None
    assert scene.mount != "pinned"
    changes = faces(scene, OTHER_END, -1)
    changes["start_angles"] = [-angle for angle in scene.start_angles[::-1]]
    changes["casing"] = {
        name: value[::-1]
        for name in ("mass", "inertia")
        if isinstance(value := getattr(scene.casing, name), tuple)
    }
    direction = "backward" if scene.feed.direction == "forward" else "forward"
    speed = scene.feed.speed
    changes["feed"] = {
        "direction": direction,
        "speed": speed[::-1] if isinstance(speed, tuple) else speed,
    }
    other = scene.replace(**changes)
    if scene.mount == "tube":
        return other
    chain = headings(scene.start_angles)
    last = centres(chain, scene.casing.side)[-1]
    tip = last + 0.5 * scene.casing.diagonal * np.array([np.cos(chain[-1]), np.sin(chain[-1])])
    return turned(_moved(other, -tip), -(float(chain[-1]) + math.pi))


def faces(scene: Scene, order: Sequence[int], step: int) -> dict[str, Any]:
    """Return the changes that put faces, and if ``step`` is −1 components, in another order."""
    changes: dict[str, Any] = {
        "sequence": ["".join(each[k] for k in order) for each in scene.sequence[::step]]
    }
    if scene.magnets is None:
        return changes
    magnets: dict[str, Any] = {}
    for name in (*SIZES, scene.magnets.strength_name):
        value = np.asarray(getattr(scene.magnets, name), dtype=np.float64)
        if value.ndim:
            rows = value[::step] if value.ndim > 1 else value
            magnets[name] = rows[..., list(order)]
    changes["magnets"] = magnets
    return changes


def _around(scene: Scene, matrix: Floats) -> Scene:
    """Return the scene with an orthogonal matrix applied to gravity and fields."""
    changes: dict[str, Any] = {"gravity": {"in_plane": matrix @ scene.gravity.in_plane}}
    if scene.field is not None:
        field: dict[str, Any] = {"uniform": matrix @ scene.field.uniform}
        if (magnet := scene.field.magnet) is not None:
            along = matrix @ [math.cos(magnet.heading), math.sin(magnet.heading)]
            field["magnet"] = {
                "position": matrix @ magnet.position,
                "heading": math.atan2(along[1], along[0]),
            }
        changes["field"] = field
    return scene.replace(**changes)


def _moved(scene: Scene, way: Floats) -> Scene:
    """Return the scene with its fixed magnet moved [m]."""
    if scene.field is None or scene.field.magnet is None:
        return scene
    return scene.replace(field={"magnet": {"position": way + scene.field.magnet.position}})
