"""Slow forces of pole faces down to contact: one face's exact field, summed over the other face.

A fixed magnet is two more pole faces.

The field and potential of a rectangle have closed forms (`laws.exact_magnets`). Unlike the engine,
this module sums along both sides of the other face, with double-exponential nodes between all
places where the field is singular. Behind a face, the field is the limit from outside.
"""

import numpy as np

from magfold_bench.laws import exact_magnets as exact

SPACING, REACH = 0.15, 3.4  # of double-exponential nodes


def double_exponential():
    """Return nodes on (0, 1) and weights for functions with logarithms at the ends."""
    u = np.arange(-REACH, REACH + SPACING / 2.0, SPACING)
    x = 1.0 / (1.0 + np.exp(-np.pi * np.sinh(u)))
    weight = np.cosh(u) / np.cosh(np.pi / 2.0 * np.sinh(u)) ** 2
    return x, weight / weight.sum()


def between(cuts):
    """Return nodes and weights for an interval that is split at sorted places (m,)."""
    x, weight = double_exponential()
    length = np.diff(cuts)[:, None]
    return (cuts[:-1, None] + length * x).ravel(), (length * weight).ravel()


def face_pair(offset, turn, size, source):
    """Energy, force (2,) and torque about its centre of a face, both of unit charge.

    Without µ0/4π. The face is of `size` (width, height) [m], its centre at `offset` (2,) [m] from
    that of another one of the size `source`, whose width lies along x and which looks along −y,
    and its width turned by `turn` [rad] from x.
    """
    along = np.array([np.cos(turn), np.sin(turn)])
    (half_a, tall_a), (half_b, tall_b) = np.array(size) / 2.0, np.array(source) / 2.0
    ends = np.array([[-half_b, 0.0], [half_b, 0.0]])
    cuts = [*((ends - offset) @ along), -half_a, half_a]
    if abs(along[1]) > 1e-12:
        cuts.append(-offset[1] / along[1])
    t, share = between(np.sort(np.clip(cuts, -half_a, half_a)))
    z, part = between(np.array([0.0, *([tall_b] if tall_b < tall_a else []), tall_a]))
    x, y = offset[0] + t * along[0], offset[1] + t * along[1]
    # Where faces look at each other, what is behind (y > 0) has gone through from the front.
    looks = along[0] < 0.0 and offset[1] < half_b
    past = np.where(looks & (y > 0.0) & (np.abs(x) < half_b), y, 0.0)[:, None]
    fx, fy, u = field(x[:, None], y[:, None] - past, z, 2.0 * half_b, 2.0 * tall_b)
    u = u - past * fy
    weights = share[:, None] * part / (2.0 * half_a * tall_a) / (4.0 * half_b * tall_b)
    force = np.array([np.sum(weights * fx), np.sum(weights * fy)])
    torque = np.sum(weights * t[:, None] * (along[0] * fy - along[1] * fx))
    return np.sum(weights * u), force, torque


def flush_force(scene):
    """Return the largest force [N] between flush opposite faces, which is the unit of errors."""
    found = []
    for face, inset in enumerate(scene.magnets.by_face("inset")):
        size = [scene.magnets.by_face(name)[face] for name in ("width", "height")]
        _, force, _ = face_pair(np.array([0.0, -2.0 * inset]), np.pi, size, size)
        charge = scene.magnets.charges(scene.n)[:, face].max()
        found.append(exact.COULOMB * charge**2 * np.hypot(*force))
    return max(found)


def field(x, y, z, width, height):
    """Field and potential of a rectangle in the plane y = 0 of one unit of charge an area.

    On the plane it is the limit from y < 0.
    """
    fx, fy, u = 0.0, 0.0, 0.0
    away, front = np.abs(y), np.where(y > 0.0, 1.0, -1.0)
    for i in (-1.0, 1.0):
        for k in (-1.0, 1.0):
            s, w = x - i * width / 2.0, z - k * height / 2.0
            r = np.sqrt(s * s + y * y + w * w)
            line, level = np.sqrt(s * s + y * y), np.sqrt(w * w + y * y)
            with np.errstate(divide="ignore", invalid="ignore"):
                by_line = np.where(line > 0.0, np.arcsinh(w / line), 0.0)
                by_level = np.where(level > 0.0, np.arcsinh(s / level), 0.0)
            angle = np.arctan2(s * w, away * r)
            fx = fx - i * k * by_line
            fy = fy + i * k * angle * front
            u = u + i * k * (s * by_line + w * by_level - away * angle)
    return fx, fy, u


def pair(scene, places, headings):
    """Energy [J], force (2,) [N] on the first of two casings and torque about its centre [N·m]."""
    faces, count = exact.faces_of(scene, places, headings), exact.FACES
    return between_bodies(faces, range(count), range(count, 2 * count), places[0])


def between_bodies(faces, one, other, place):
    """Return the sum over the faces of two bodies; the torque is about a place (2,)."""
    energy, force, torque = 0.0, np.zeros(2), 0.0
    for a in one:
        for b in other:
            charge = exact.COULOMB * faces.charge[a] * faces.charge[b]
            if charge == 0.0:
                continue
            u, v = faces.along[b], faces.along[a]
            offset = faces.centre[a] - faces.centre[b]
            # The outward normal of b is −y.
            side = np.array([-u[1], u[0]])
            seen = np.array([u @ offset, side @ offset])
            turn = np.arctan2(side @ v, u @ v)
            part, pull, moment = face_pair(seen, turn, faces.size[a], faces.size[b])
            world = pull[0] * u + pull[1] * side
            arm = faces.centre[a] - place
            energy += charge * part
            force += charge * world
            torque += charge * (moment + arm[0] * world[1] - arm[1] * world[0])
    return energy, force, torque


def both(one, other):
    """Return some faces, then others."""
    return exact.Faces(*map(np.concatenate, zip(one, other, strict=True)))


def faces_of_fixed(magnet):
    """Return the two pole faces of a fixed magnet, the north one first."""
    across = np.array([-np.sin(magnet.heading), np.cos(magnet.heading)])
    return exact.Faces(
        magnet.poles, np.tile(across, (2, 1)), np.tile([magnet.width, magnet.height], (2, 1)),
        np.array([magnet.charge, -magnet.charge]),
    )  # fmt: skip


def in_field(scene, places, headings):
    """Return forces (n, 2) [N] and torques (n,) [N·m] of the scene's field on casings.

    An even field pulls a magnet's two poles equally, and so only turns it.
    """
    faces, count, n = exact.faces_of(scene, places, headings), exact.FACES, len(headings)
    casing = np.arange(count * n) // count
    even = faces.charge[:, None] * np.array(scene.field.uniform)
    torque = np.bincount(casing, exact.cross(faces.centre - places[casing], even), n)
    force = np.zeros((n, 2))
    if scene.field.magnet is not None:
        everything = both(faces, faces_of_fixed(scene.field.magnet))
        # Faces look to the right of their widths.
        everything.along[-1] *= -1.0
        poles = range(count * n, count * n + 2)
        for i, place in enumerate(places):
            own = range(count * i, count * (i + 1))
            _, pull, moment = between_bodies(everything, own, poles, place)
            force[i] += pull
            torque[i] += moment
    return force, torque
