"""A scene's outer field -> arrays."""

from __future__ import annotations

import math

import numpy as np

from magfold_env.engine.state import Field
from magfold_env.scene import FixedMagnet, Scene
from magfold_env.simulation.quadrature import widest

_NONE = np.zeros(0)
NO_FIELD = Field(
    False, 0.0, 0.0, _NONE, _NONE, 0.0, 0.0, _NONE, 0.0, False, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0
)


def pack_field(scene: Scene, magnetic: bool) -> Field:
    """Return what acts on a chain from outside, if it is ``magnetic``, and may stand in its way."""
    field, part = scene.field, scene.magnets
    if field is None or not field.any:
        return NO_FIELD
    found = NO_FIELD
    if part is not None:
        found = found._replace(present=magnetic, x=field.uniform[0], y=field.uniform[1])
    magnet = field.magnet
    if magnet is None:
        return found
    if part is not None:
        found = _with_poles(found, magnet, widest(part))
    return found._replace(
        solid=True,
        centre_x=magnet.position[0],
        centre_y=magnet.position[1],
        cos=math.cos(magnet.heading),
        sin=math.sin(magnet.heading),
        half_length=magnet.thickness / 2.0,
        half_width=magnet.width / 2.0,
    )


def _with_poles(field: Field, magnet: FixedMagnet, widest_face: float) -> Field:
    """Return a field with a fixed magnet's pole faces, in strips no wider than the chain's.

    The same nodes then serve both.
    """
    strips = math.ceil(magnet.width / widest_face)
    along = np.array([-math.sin(magnet.heading), math.cos(magnet.heading)]) * magnet.width / strips
    place = (np.arange(strips) - 0.5 * (strips - 1))[:, None] * along
    centre = np.concatenate([pole + place for pole in magnet.poles])
    return field._replace(
        strip_x=np.ascontiguousarray(centre[:, 0]),
        strip_y=np.ascontiguousarray(centre[:, 1]),
        strip_tx=float(along[0]),
        strip_ty=float(along[1]),
        strip_q=np.repeat([1.0, -1.0], strips) * magnet.charge / strips,
        strip_half=magnet.height / 2.0,
    )
