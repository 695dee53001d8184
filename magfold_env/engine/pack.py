"""Scene -> arrays. The only room of the engine, with ``session``, that knows what a scene is."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from magfold_env.engine.near_faces import BLEND, LANES
from magfold_env.engine.pair_tables import build_tables
from magfold_env.engine.quadrature import Rule, choose_rule, table_rule
from magfold_env.engine.state import Array, Bodies, IntArray, Magnets, Model, Tables
from magfold_env.scene import Scene
from magfold_env.scene_parts import Casing
from magfold_env.scene_parts import Magnets as MagnetsPart

# c of the friction ellipsoid, as a share of the side: mean distance of a square's points from
# its centre, so that pure spin of an evenly pressed square feels its exact friction torque.
FRICTION_ARM = 0.3826

# Share of the accuracy that splines may use up.
TABLE_SHARE = 0.05

NO_TABLES = Tables(0.0, np.zeros((0, 16)), np.zeros((0, 16)))
FACE_ANGLES = np.array([0.25, 0.75, -0.75, -0.25]) * math.pi


def reversed_inside(scene: Scene) -> bool:
    """Whether the engine indexes this scene's chain from component n.

    The engine counts from the held end. In forward feed component n is held.
    """
    return scene.mount == "tube" and scene.feed.direction == "forward"


def pack(scene: Scene) -> Model:
    """Turn a scene into the arrays of the kernels.

    Random spreads are not applied here: draw them first (``Scene.draw``).
    """
    n = scene.n
    casing = scene.casing
    pitch = casing.diagonal
    mass, inertia = scene.masses, scene.inertias
    flip = reversed_inside(scene)
    if flip:
        mass, inertia = mass[::-1].copy(), inertia[::-1].copy()
    bodies = Bodies(
        mass=mass,
        inertia=inertia,
        reach=np.full(n, pitch / 2.0),
        length=np.full(n, pitch),
    )
    gravity_x, gravity_y = scene.gravity.in_plane
    return Model(
        n=n,
        bodies=bodies,
        magnets=pack_magnets(scene)._replace(tables=joint_tables(scene)),
        charge=charges(scene),
        magnetic=scene.magnets is not None,
        side=casing.side,
        rounding=casing.corner_radius,
        grip=scene.friction * scene.gravity.normal * mass,
        arm=FRICTION_ARM * casing.side,
        frictional=scene.friction > 0.0 and scene.gravity.normal > 0.0,
        gravity_x=gravity_x,
        gravity_y=gravity_y,
        contact=scene.contact,
        tube=scene.mount == "tube",
        bore=scene.bore,
        wall=scene.feed.wall,
        pinned=scene.mount == "pinned",
        tolerance=scene.solver.tolerance,
        rate_scale=_rate_scale(scene, float(mass.mean()), pitch),
        max_steps=scene.solver.max_steps,
        max_steps_per_second=scene.solver.max_steps_per_second,
    )


def charges(scene: Scene) -> Array:
    """Signed charge of each outer pole face in the engine's order, shape (n, 4) [A·m]."""
    if scene.magnets is None:
        return np.zeros((scene.n, 4))
    rows = [face_charges(faces, scene) for faces in scene.sequence]
    return np.ascontiguousarray(rows[::-1] if reversed_inside(scene) else rows)


def face_charges(faces: str, scene: Scene) -> Array:
    """Signed charges (4,) [A·m] of one component, its faces in the engine's order."""
    if scene.magnets is None:
        return np.zeros(4)
    charge = scene.magnets.charge
    signs = np.array([charge if letter == "N" else -charge for letter in faces])
    # Seen from the other end of the chain a casing is turned by half a turn.
    return signs[[2, 3, 0, 1]] if reversed_inside(scene) else signs


def pack_magnets(scene: Scene) -> Magnets:
    """Quadrature nodes of a casing's eight pole faces."""
    magnets = scene.magnets
    if magnets is None:
        rule = Rule.single(1)
        return _build(rule, strips=False, width=1.0, height=1.0, outer=0.0, inner=0.0)
    return quadrature_of(scene.casing, magnets, choose_rule(magnets))


def joint_tables(scene: Scene) -> Tables:
    """Splines of the energies of nearby casings, where angles are bounded and splines exact enough.

    Rows of points, and nodes whose number is given, are summed as they stand.
    """
    magnets = scene.magnets
    if (
        magnets is None
        or magnets.model == "points"
        or magnets.nodes is not None
        or not scene.contact
        or scene.solver.method == "paper"
    ):
        return NO_TABLES
    tables, error = _tables_of(
        scene.casing.side, magnets.width, magnets.height, magnets.thickness, magnets.inset
    )
    return tables if error <= TABLE_SHARE * magnets.accuracy else NO_TABLES


@lru_cache(maxsize=16)
def _tables_of(
    side: float, width: float, height: float, thickness: float, inset: float
) -> tuple[Tables, float]:
    casing = Casing(side=side)
    magnets = MagnetsPart(width=width, height=height, thickness=thickness, inset=inset)
    return build_tables(quadrature_of(casing, magnets, table_rule(magnets)), casing.diagonal)


def quadrature_of(casing: Casing, magnets: MagnetsPart, rule: Rule) -> Magnets:
    """Return the nodes of a casing's eight pole faces for a given rule."""
    outer = casing.side / 2.0 - magnets.inset
    return _build(
        rule,
        strips=magnets.model == "strips",
        width=magnets.width,
        height=magnets.height,
        outer=outer,
        inner=outer - magnets.thickness,
    )


@lru_cache(maxsize=64)
def _build(
    rule: Rule, *, strips: bool, width: float, height: float, outer: float, inner: float
) -> Magnets:
    levels = len(rule.counts)
    most = -(-max(rule.counts) // LANES) * LANES
    node, weight = np.zeros((levels, most)), np.zeros((levels, most))
    for level, count in enumerate(rule.counts):
        node[level, :count], weight[level, :count] = _width_rule(strips, count, width)
    distance = np.repeat([outer, inner], 4)
    angle = np.tile(FACE_ANGLES, 2)
    face_x, face_y = distance * np.cos(angle), distance * np.sin(angle)
    tangent_x, tangent_y = -np.sin(angle), np.cos(angle)
    sign = np.repeat([1.0, -1.0], 4)
    ranks, widest = len(rule.ranks), 8 * max(rule.ranks)
    node_x, node_y, share = (np.zeros((ranks, widest)) for _ in range(3))
    node_face: IntArray = np.zeros((ranks, widest), dtype=np.int64)
    for rank, count in enumerate(rule.ranks):
        offset, part = _width_rule(strips, count, width)
        nodes = slice(0, 8 * count)
        node_x[rank, nodes] = (face_x[:, None] + np.outer(tangent_x, offset)).ravel()
        node_y[rank, nodes] = (face_y[:, None] + np.outer(tangent_y, offset)).ravel()
        share[rank, nodes] = np.outer(sign, part).ravel()
        node_face[rank, nodes] = np.repeat(np.tile(np.arange(4), 2), count)
    return Magnets(
        strips=strips,
        height2=height * height,
        rank_count=8 * np.array(rule.ranks, dtype=np.int64),
        rank_radius=np.array(rule.rank_radii),
        node_x=node_x,
        node_y=node_y,
        node_weight=share,
        node_face=node_face,
        depth=outer,
        face_x=face_x,
        face_y=face_y,
        face_tx=tangent_x,
        face_ty=tangent_y,
        level_count=np.array(rule.counts, dtype=np.int64),
        level_node=node,
        level_weight=weight,
        level_radius=np.array(rule.radii),
        reach=2.0 * outer + BLEND * rule.radii[1] if levels > 1 else 0.0,
        tables=NO_TABLES,
    )


def _width_rule(strips: bool, count: int, width: float) -> tuple[Array, Array]:
    """Offsets [m] and shares of the charge of ``count`` nodes across a pole face."""
    if strips:
        x, w = np.polynomial.legendre.leggauss(count)
        return x * width / 2.0, w / 2.0
    return np.linspace(-width / 2.0, width / 2.0, count) if count > 1 else np.zeros(1), np.full(
        count, 1.0 / count
    )


def _rate_scale(scene: Scene, mass: float, pitch: float) -> float:
    """Return a typical angular rate [rad/s]: what the strongest force makes of one component.

    Errors of rates are judged against it.
    """
    acceleration = math.hypot(*scene.gravity.in_plane)
    if scene.magnets is not None:
        # Two charges a magnet's width apart: the order of the force between touching faces.
        density = scene.magnets.charge / scene.magnets.width
        force = 1e-7 * density * density  # beyond the largest number: infinite, not an error
        acceleration += force / mass
    return max(math.sqrt(acceleration / pitch), 1.0)
