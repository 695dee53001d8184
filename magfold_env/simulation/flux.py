"""The magnetic flux density around a chain, from the pole faces of the engine and their law."""

import math

import numpy as np
import numpy.typing as npt

from magfold_env.engine.chain import articulated
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.magnets.laws import COULOMB, NEAREST2, node_force
from magfold_env.engine.state import Array, Model, Pose
from magfold_env.engine.workspace import new_work
from magfold_env.scene import Scene
from magfold_env.simulation.pack import pack
from magfold_env.simulation.quadrature import graded_rule
from magfold_env.simulation.simulate import checked, places

NODES = 40
"""Nodes along a pole face to either side of the place that is nearest to a point.

0.1 mm from a pole face the error is about 1e-8 of the field, and 10 µm from it 1e-5.
"""


def field(scene: Scene, angles: npt.ArrayLike, points: npt.ArrayLike) -> Array:
    """Return the flux density of the chain's magnets [T] at points, shape (k, 2).

    The points lie in the plane at the mid-height of the chain, where the field has no component
    out of the plane. An external field is not included. Within a magnet of the model ``strips``,
    its magnetisation is.

    Parameters
    ----------
    scene
        The chain; its mount is ignored.
    angles
        Headings [rad], shape (n,), component 1 first.
    points
        Places [m], shape (k, 2); component 1's outer hinge is at the origin.

    Raises
    ------
    SceneError
        If ``scene`` is not a scene, a shape is another, or a number is not finite.
    """
    headings = checked("angles", angles, scene)
    at = places("points", points, "two for each point")
    model = pack(scene.alone())
    work = new_work(model._replace(contact=False, frictional=False))
    articulated.place(0, model.bodies, np.append(headings, [0.0, 0.0]), work.pose)
    node, weight = graded_rule(NODES)
    if not model.magnets.strips:
        count = int(model.magnets.level_count[0])
        node, weight = model.magnets.level_node[0, :count], model.magnets.level_weight[0, :count]
    found = np.zeros_like(at)
    add_flux(model, work.pose, node, weight, at, found)
    return found


@kernel
def add_flux(
    model: Model, pose: Pose, node: Array, weight: Array, points: Array, flux: Array
) -> None:
    """Add the flux density [T] at points [m], both (k, 2), of all pole faces.

    Strips are cut where they are nearest to a point, and the nodes (in widths) serve each part.
    """
    magnets, strips = model.magnets, model.magnets.strips
    for i in range(model.n):
        c, s = pose.cos[i], pose.sin[i]
        for f in range(8):
            q = model.charge[i, f % 4] * (1.0 if f < 4 else -1.0)
            if q == 0.0:
                continue
            x = pose.x[i] + c * magnets.face_x[f] - s * magnets.face_y[f]
            y = pose.y[i] + s * magnets.face_x[f] + c * magnets.face_y[f]
            tx = c * magnets.face_tx[f] - s * magnets.face_ty[f]
            ty = s * magnets.face_tx[f] + c * magnets.face_ty[f]
            width2, half2 = tx * tx + ty * ty, magnets.face_half[f] * magnets.face_half[f]
            # From the outer pole face to the inner one, and its length.
            g = (f + 4) % 8
            ix, iy = magnets.face_x[g] - magnets.face_x[f], magnets.face_y[g] - magnets.face_y[f]
            inx, iny = c * ix - s * iy, s * ix + c * iy
            thick2 = inx * inx + iny * iny
            for p in range(points.shape[0]):
                dx, dy = points[p, 0] - x, points[p, 1] - y
                along, deep = (dx * tx + dy * ty) / width2, (dx * inx + dy * iny) / thick2
                cut = min(max(along, -0.5), 0.5) if strips else 0.5
                gx, gy, begin = 0.0, 0.0, -0.5
                for end in (cut, 0.5):
                    length = end - begin
                    for m in range(node.size if length > 0.0 else 0):
                        at = begin + length * (0.5 + node[m])
                        ex, ey = dx - at * tx, dy - at * ty
                        r2 = max(ex * ex + ey * ey, NEAREST2)
                        # A point is a node without height.
                        force = length * weight[m] * node_force(strips, half2, half2, r2)
                        gx += force * ex
                        gy += force * ey
                    begin = end
                flux[p, 0] += COULOMB * q * gx
                flux[p, 1] += COULOMB * q * gy
                if strips and f < 4 and along == cut and 0.0 < deep < 1.0:
                    # µ0 times the magnetisation, from the south pole to the north.
                    dense = 4.0 * math.pi * COULOMB * q / math.sqrt(4.0 * half2 * width2 * thick2)
                    flux[p, 0] -= dense * inx
                    flux[p, 1] -= dense * iny
