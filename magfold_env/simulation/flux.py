"""The magnetic flux density around a chain, computed from the engine's pole faces and their law."""

import math

import numpy as np
import numpy.typing as npt

from magfold_env.engine.chain import articulated
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.magnets.laws import COULOMB, NEAREST2, node_force
from magfold_env.engine.state import Array, Magnets
from magfold_env.engine.workspace import new_work
from magfold_env.scene import Scene
from magfold_env.simulation.pack import pack
from magfold_env.simulation.quadrature import graded_rule
from magfold_env.simulation.simulate import checked, places

ComplexArray = npt.NDArray[np.complex128]

NODES = 40
"""Number of nodes along a pole face on either side of the place that is nearest to a point.

At 0.1 mm from a pole face, the error is about 1e-8 of the field, and at 10 µm about 1e-5.
"""


def field(scene: Scene, angles: npt.ArrayLike, points: npt.ArrayLike) -> Array:
    """Return the flux density of the chain's magnets [T] at points, shape (k, 2).

    The points lie in the plane at the mid-height of the chain, where the field has no component out
    of the plane. An external field is not included. Inside a magnet of the model ``strips``, the
    magnet's magnetisation is included.

    Parameters
    ----------
    scene
        The chain; its mount is ignored.
    angles
        Headings [rad], shape (n,), component 1 first.
    points
        Positions [m], shape (k, 2); component 1's outer hinge is at the origin.

    Raises
    ------
    SceneError
        If ``scene`` is not a scene, a shape is wrong, or a number is not finite.
    """
    headings, at = checked("angles", angles, scene), places("points", points, "two for each point")
    model = pack(scene.alone())
    work, magnets = new_work(model._replace(contact=False, frictional=False)), model.magnets
    articulated.place(0, model.bodies, np.append(headings, [0.0, 0.0]), work.pose)
    node, weight = magnets.level_node[0], magnets.level_weight[0]
    if magnets.strips:
        node, weight = graded_rule(NODES)
    # Points of the plane are complex numbers.
    centre = np.ascontiguousarray(magnets.face_x + 1j * magnets.face_y)
    along = magnets.face_tx + 1j * magnets.face_ty
    turn = work.pose.cos + 1j * work.pose.sin
    found = np.zeros(len(at), dtype=np.complex128)
    for i, middle in enumerate(work.pose.x + 1j * work.pose.y):
        away = (at[:, 0] + 1j * at[:, 1] - middle) / turn[i]
        own = np.zeros_like(found)
        add_flux(magnets, model.charge[i], centre, along, node, weight, away, own)
        found += own * turn[i]
    return np.stack([found.real, found.imag], axis=1)


@kernel
def add_flux(
    magnets: Magnets, charge: Array, centre: ComplexArray, along: ComplexArray, node: Array,
    weight: Array, points: ComplexArray, flux: ComplexArray,
) -> None:  # fmt: skip
    """Add the flux density [T] of a casing's pole faces at points [m], both (k,), in its frame.

    Strips are cut where they are nearest to a point; the nodes (in widths) are used in each part.
    """
    strips = magnets.strips
    for f in range(8):
        q = charge[f % 4] * (1.0 if f < 4 else -1.0)
        if q == 0.0:
            continue
        half2 = magnets.face_half[f] * magnets.face_half[f]
        inward = centre[(f + 4) % 8] - centre[f]
        for p in range(points.size):
            away = points[p] - centre[f]
            place = (away / along[f]).real
            cut, begin = min(max(place, -0.5), 0.5) if strips else 0.5, -0.5
            total = 0j
            for end in (cut, 0.5):
                length = end - begin
                for m in range(node.size if length > 0.0 else 0):
                    d = away - (begin + length * (0.5 + node[m])) * along[f]
                    r2 = max(d.real * d.real + d.imag * d.imag, NEAREST2)
                    # A point is a node without height.
                    total += length * weight[m] * node_force(strips, half2, half2, r2) * d
                begin = end
            flux[p] += COULOMB * q * total
            if strips and f < 4 and place == cut and 0.0 < (away / inward).real < 1.0:
                # µ0 times the magnetisation, from the south pole to the north.
                area = 2.0 * magnets.face_half[f] * abs(along[f])
                flux[p] -= 4.0 * math.pi * COULOMB * q / area * inward / abs(inward)
