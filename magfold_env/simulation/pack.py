"""Convert scenes to arrays for the kernels: the chain, its initial pose, magnets and the field."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from threading import Lock
from typing import NamedTuple, ParamSpec, TypeVar, get_args

import numpy as np

from magfold_env.engine.elementary import sincos
from magfold_env.engine.magnets.laws import NEAREST2
from magfold_env.engine.magnets.multipoles import ComplexArray, moments
from magfold_env.engine.magnets.pairs import BLEND, LANES
from magfold_env.engine.state import (
    Array,
    Bodies,
    FarTable,
    Field,
    IntArray,
    Magnets,
    Model,
    Tables,
)
from magfold_env.scene import Casing, FixedMagnet, Scene
from magfold_env.scene import Magnets as MagnetsPart
from magfold_env.scene.magnets import Length
from magfold_env.scene.numbers import (
    FRICTION_ARM,
    friction_limit,
    narrowest,
    rectangle,
    typical_rate,
)
from magfold_env.shapes import headings
from magfold_env.simulation.far_table import build_far_table
from magfold_env.simulation.near_table import build_near_table
from magfold_env.simulation.quadrature import (
    TABLE_GAP,
    TABLE_RULE,
    Rule,
    choose_rule,
    graded_rule,
    single_rule,
    widest,
    width_rule,
)

# Share of the accuracy that the error of splines may use.
TABLE_SHARE = 0.05
FAR_ACCURACY = 1e-3  # the finest accuracy for which the far table is used
FAR_SHARE = 0.7  # of the accuracy: the far table's largest estimated error
PAST_STOP = 0.2  # of the further turn at which flush magnets would meet

# [m²] Nodes of touching faces are no closer, because sums that round differently must cancel.
TOUCHING2 = 1e-12

P = ParamSpec("P")
T = TypeVar("T")

_NONE = np.zeros(0)
NO_FIELD = Field(False, 0.0, 0.0, _NONE, _NONE, 0.0, 0.0, _NONE, 0.0, np.zeros(8, dtype=np.int64))
NO_FAR_TABLE = FarTable(0.0, 0.0, np.zeros((0, 0, 0)), 0.0, np.zeros(4), 0.0)
NO_TABLES = Tables(0.0, 0.0, np.zeros((0, 16)), np.zeros((0, 16)), NO_FAR_TABLE)
TURNED = [2, 3, 0, 1]  # faces of a casing turned by 180°
# The faces point along the diagonals.
FACE_X, FACE_Y = math.sqrt(0.5) * np.array([[1.0, -1.0, -1.0, 1.0], [1.0, 1.0, -1.0, -1.0]])


def reversed_inside(scene: Scene) -> bool:
    """Whether the engine indexes a scene's chain from component n.

    The engine counts from the held end. In forward feed, component n is held.
    """
    return scene.mount == "tube" and scene.feed.direction == "forward"


def inner_offsets(scene: Scene) -> Array:
    """Return how far each hinge is initially to the left of the tube's axis [m], (n + 1,).

    The scene must have a tube and be concrete. The inner end comes first.
    """
    turn = reversed_inside(scene)
    if scene.start_offsets is not None:
        offsets = np.array(scene.start_offsets)
        return offsets[::-1].copy() if turn else offsets
    # They are summed from the inner end, so that a chain seen from either end gets the same bits.
    joints = np.array(scene.start_angles)
    sines, cosines = zip(*map(sincos, headings(-joints[::-1] if turn else joints)), strict=True)
    _, across = narrowest(np.array(cosines), np.array(sines))
    return scene.casing.diagonal * across


class Values(NamedTuple):
    """The drawn values of chains of one scene, one row per chain, component 1 first."""

    mass: Array  # (m, n) [kg]
    inertia: Array  # (m, n) [kg m²]
    friction: Array  # coefficients, (m, n)
    charge: Array  # largest possible charge of a pole face, (m,) [A·m]
    normal: Array  # gravity normal to the plane, (m,) [m/s²]
    pull: Array  # gravity in the plane, (m, 2) [m/s²]


class Numbers(NamedTuple):
    """Parts of `Model` that follow from drawn values, one row per chain, in the engine's order."""

    mass: Array
    inertia: Array
    friction_limit: Array
    pull: Array
    typical_rate: Array
    fastest_rate: Array


def numbers(scene: Scene, values: Values) -> Numbers:
    """Return the `Numbers` of chains with values drawn from a scene."""
    mass, inertia, friction = values.mass, values.inertia, values.friction
    if reversed_inside(scene):
        mass, inertia = np.ascontiguousarray(mass[:, ::-1]), inertia[:, ::-1]
        friction = friction[:, ::-1]
    width, outer = math.inf, 0.0
    if scene.magnets is not None:
        width = widest(scene.magnets)
        if scene.field is not None:
            outer = _length(*scene.field.uniform)
            if (magnet := scene.field.magnet) is not None:
                outer += 1e-7 * magnet.charge / (magnet.width * magnet.width)
    length, (x, y) = scene.casing.diagonal, values.pull.T
    # Overflow gives infinity, not an error.
    with np.errstate(over="ignore"):
        rates = [
            typical_rate(values.charge, width, outer, each, x, y, length)
            for each in (mass.mean(axis=1), mass.min(axis=1))
        ]
    grip = friction_limit(friction, values.normal[:, None], mass)
    return Numbers(mass, inertia, grip, values.pull, *rates)


def pack(scene: Scene) -> Model:
    """Convert a scene to the arrays of the kernels.

    Random spreads are not applied here; draw them first with ``Scene.draw``.
    """
    n = scene.n
    casing, bumps, gravity = scene.casing, scene.bumps, scene.gravity
    length = np.full(n, casing.diagonal)
    magnets, tables = pack_magnets(scene), joint_tables(scene)
    every_charge = charges(scene)
    magnetic = _is_magnetic(scene, every_charge)
    charge = 0.0 if scene.magnets is None else scene.magnets.charge
    stated = scene.masses, scene.inertias, scene.frictions, charge, gravity.normal, gravity.in_plane
    one = numbers(scene, Values(*(np.array([each]) for each in stated)))
    return Model(
        n=n,
        bodies=Bodies(one.mass[0], np.ascontiguousarray(one.inertia[0]), length / 2.0, length),
        magnets=magnets if tables is NO_TABLES else magnets._replace(tables=tables),
        charge=every_charge,
        magnetic=magnetic,
        side=casing.side,
        rounding=casing.corner_radius,
        stop_overshoot=_stop_overshoot(scene, magnets),
        friction_limit=one.friction_limit[0],
        friction_radius=FRICTION_ARM * casing.side,
        frictional=bool(scene.frictions.any()) and gravity.normal > 0.0,
        gravity_x=gravity.in_plane[0],
        gravity_y=gravity.in_plane[1],
        field=pack_field(scene, magnetic),
        contact=scene.contact,
        tube=scene.mount == "tube",
        at_mouth=scene.mount == "tube" and scene.feed.loading == "at_mouth",
        force_limit=scene.feed.force_limit or math.inf,
        obstacles=pack_obstacles(scene),
        pinned=scene.mount == "pinned",
        bump_rate=bumps.rate if bumps is not None else 0.0,
        bump_speed=bumps.speed if bumps is not None else 0.0,
        bump_seed=(bumps.seed or 1) if bumps is not None else 1,
        bump_duration=bumps.duration if bumps is not None else 0.0,
        tolerance=scene.solver.tolerance,
        typical_rate=float(one.typical_rate[0]),
        fastest_rate=float(one.fastest_rate[0]),
        max_steps=scene.solver.max_steps,
        max_steps_per_second=scene.solver.max_steps_per_second,
        duration=scene.duration,
    )


def _is_magnetic(scene: Scene, charge: Array) -> bool:
    """Whether any component has magnets or may receive them at the mouth of the tube."""
    if scene.magnets is None:
        return False
    chosen_later = scene.mount == "tube" and scene.feed.loading == "at_mouth"
    return chosen_later or bool(charge.any())


def _stop_overshoot(scene: Scene, magnets: Magnets) -> float:
    """Return how far beyond a joint's stop forces still approximate those before it [rad]."""
    if scene.magnets is None:
        return math.inf
    gap = 2.0 * float(np.min(scene.magnets.inset))
    if magnets.graded.any():
        # Beyond the stop, the forces continue as before it.
        gap = TABLE_GAP * widest(scene.magnets)
    return PAST_STOP * gap / scene.casing.side


def charges(scene: Scene) -> Array:
    """Return the signed charge of each outer pole face in the engine's order, (n, 4) [A·m]."""
    charge = scene.charges
    if reversed_inside(scene):
        # Seen from the other end of the chain, a casing is turned by 180°.
        charge = charge[::-1, TURNED]
    return np.ascontiguousarray(charge)


def pack_magnets(scene: Scene) -> Magnets:
    """Return the quadrature nodes of a casing's eight pole faces."""
    magnets = scene.magnets
    if magnets is None:
        none = MagnetsPart(model="points")
        return quadrature_of(scene.casing, none, single_rule(1))
    return quadrature_of(scene.casing, magnets, choose_rule(magnets), reversed_inside(scene))


def _made_once(make: Callable[P, T]) -> Callable[P, T]:
    """Cache a function's last results; one thread makes a result, and others that need it wait."""
    lock_of, kept = lru_cache(maxsize=16)(lambda *_: Lock()), lru_cache(maxsize=16)(make)

    def get(*args: P.args, **named: P.kwargs) -> T:
        with lock_of(*args):
            return kept(*args, **named)

    return get


def joint_tables(scene: Scene) -> Tables:
    """Return splines of nearby casings' energies, if angles are bounded and splines exact enough.

    Magnets of the model ``points``, or with a given number of nodes, are summed without splines.
    """
    magnets = scene.magnets
    if (
        magnets is None
        or not magnets.bounded
        or not scene.contact
        or scene.solver.method == "paper"
    ):
        return NO_TABLES
    sizes = MagnetSizes.of(magnets, reversed_inside(scene))
    tables, error = _tables_of(scene.casing.side, sizes)
    if error > TABLE_SHARE * magnets.accuracy:
        return NO_TABLES
    if magnets.accuracy < FAR_ACCURACY or not magnets.even:
        return tables
    far, error = _far_table_of(scene.casing.side, sizes)
    return tables._replace(far=far) if error <= FAR_SHARE * magnets.accuracy else tables


@_made_once
def _tables_of(side: float, sizes: MagnetSizes) -> tuple[Tables, float]:
    magnets = _build(TABLE_RULE, True, side, sizes)
    return build_near_table(magnets, Casing(side=side).diagonal, NO_FAR_TABLE)


@_made_once
def _far_table_of(side: float, sizes: MagnetSizes) -> tuple[FarTable, float]:
    return build_far_table(_build(single_rule(1), True, side, sizes), side)


def quadrature_of(
    casing: Casing, magnets: MagnetsPart, rule: Rule, turned: bool = False
) -> Magnets:
    """Return the nodes of a casing's eight pole faces, optionally ``turned`` by 180°."""
    return _build(rule, magnets.model == "strips", casing.side, MagnetSizes.of(magnets, turned))


class MagnetSizes(NamedTuple):
    """Sizes of a casing's magnets, four numbers each in the engine's order of faces [m]."""

    width: tuple[float, ...]
    height: tuple[float, ...]
    thickness: tuple[float, ...]
    inset: tuple[float, ...]

    @classmethod
    def of(cls, magnets: MagnetsPart, turned: bool) -> MagnetSizes:
        """Return the sizes of a scene's magnets, optionally for a casing turned by 180°."""
        lengths = (magnets.lengths[name] for name in get_args(Length))
        return cls(*((each[2:] + each[:2] if turned else each) for each in lengths))

    @property
    def depth(self) -> Array:
        """Depths of all eight pole faces in the casing [m]."""
        return np.append(self.inset, np.add(self.inset, self.thickness))

    def near(self, gap: Array, bounded: bool) -> IntArray:
        """Return 1 for ``bounded`` gaps [m] below `TABLE_GAP` face widths, and 0 for other gaps."""
        near = gap < (1.0 - 1e-9) * TABLE_GAP * max(self.width)
        return (near & bounded).astype(np.int64)


@lru_cache(maxsize=64)
def _build(rule: Rule, strips: bool, side: float, sizes: MagnetSizes) -> Magnets:
    # Level 0 is the last rank; after the levels come the nodes of faces that may touch.
    counts = (rule.ranks[-1], *rule.levels, rule.graded)
    levels, widest_face = len(counts) - 1, max(sizes.width)
    most = -(-max(counts) // LANES) * LANES
    node, weight = np.zeros((levels + 1, most)), np.zeros((levels + 1, most))
    for level, count in enumerate(counts[:-1]):
        node[level, :count], weight[level, :count] = width_rule(strips, count)
    if rule.graded > 0:
        node[levels, : rule.graded], weight[levels, : rule.graded] = graded_rule(rule.graded)
    outer = side / 2.0 - np.array(sizes.inset)
    distance = np.concatenate([outer, outer - np.array(sizes.thickness)])
    look_x, look_y = np.tile(FACE_X, 2), np.tile(FACE_Y, 2)
    width = np.tile(sizes.width, 2)
    face_x, face_y = distance * look_x, distance * look_y
    tangent_x, tangent_y = -look_y * width, look_x * width
    sign = np.repeat([1.0, -1.0], 4)
    ranks, widest = len(rule.ranks), 8 * max(rule.ranks)
    node_x, node_y, share = (np.zeros((ranks, widest)) for _ in range(3))
    for rank, count in enumerate(rule.ranks):
        offset, part = width_rule(strips, count)
        nodes = slice(0, 8 * count)
        node_x[rank, nodes] = (face_x[:, None] + np.outer(tangent_x, offset)).ravel()
        node_y[rank, nodes] = (face_y[:, None] + np.outer(tangent_y, offset)).ravel()
        share[rank, nodes] = np.outer(sign, part).ravel()
    faces = face_x + 1j * face_y, tangent_x + 1j * tangent_y
    graded = sizes.near(sizes.depth[:, None] + sizes.depth, rule.graded > 0)
    rooms, radii = (np.array([math.inf, *each]) * widest_face for each in (rule.rooms, rule.radii))
    return Magnets(
        strips=strips,
        even=min(sizes.height) == max(sizes.height),
        height2=sizes.height[0] * sizes.height[0],
        rank_count=np.array(rule.ranks, dtype=np.int64),
        rank_radius=rooms,
        far_radius=rule.far * side * math.sqrt(2.0),
        far_order=rule.order,
        group_radius=rule.groups * side * math.sqrt(2.0),
        face_moment=_moments(faces, sizes),
        node_x=node_x,
        node_y=node_y,
        node_weight=share,
        nearest2=TOUCHING2 if graded.any() else NEAREST2,
        depth=float(outer.max()),
        face_x=face_x,
        face_y=face_y,
        face_tx=tangent_x,
        face_ty=tangent_y,
        face_half=np.tile(sizes.height, 2) / 2.0,
        level_count=np.array(counts, dtype=np.int64),
        level_node=node,
        level_weight=weight,
        level_radius=radii,
        reach=2.0 * float(outer.max()) + BLEND * float(radii[1]) if levels > 1 else 0.0,
        graded=graded,
        tables=NO_TABLES,
    )


def _moments(faces: tuple[ComplexArray, ComplexArray], sizes: MagnetSizes) -> Array:
    """Return the moments of the magnet behind each outer face, for unit charge on that face."""
    centre, along = faces
    # Four nodes are exact up to the seventh order.
    offset, part = width_rule(True, 4)
    share = np.concatenate([part, -part])
    poles = [np.concatenate([centre[g] + offset * along[g] for g in (f, f + 4)]) for f in range(4)]
    return np.array([moments(poles[f], share, sizes.height[f]) for f in range(4)])


def pack_field(scene: Scene, magnetic: bool) -> Field:
    """Return the external field that acts on a chain, if the chain is ``magnetic``."""
    field, part = scene.field, scene.magnets
    if field is None or not field.any or part is None:
        return NO_FIELD
    found = NO_FIELD._replace(present=magnetic, x=field.uniform[0], y=field.uniform[1])
    magnet = field.magnet
    if magnet is None:
        return found
    # The magnet's poles are on its outline and have no inset.
    sizes = MagnetSizes.of(part, reversed_inside(scene))
    found = found._replace(graded=sizes.near(sizes.depth, part.bounded))
    return _with_poles(found, magnet, widest(part))


def pack_obstacles(scene: Scene) -> Array:
    """Return the obstacles of a scene, one row each; see `engine.indices`."""
    found: list[tuple[float, ...]] = []
    for each in scene.solids:
        cos, sin = each.axis.tolist()
        found.append(rectangle(*each.position, *each.size, cos, sin, scene.casing.corner_radius))
    return np.array(found).reshape(len(found), 7)


def _with_poles(field: Field, magnet: FixedMagnet, widest_face: float) -> Field:
    """Return a field with a fixed magnet's pole faces in strips no wider than the chain's.

    The nodes for the chain's faces then also suit the strips.
    """
    strips = math.ceil(magnet.width / widest_face)
    cos, sin = magnet.outline.axis
    along = np.array([-sin, cos]) * magnet.width / strips
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


def _length(x: float, y: float) -> float:
    """Return the length of a vector, which unlike `math.hypot` rounds the same on all machines."""
    return math.sqrt(x * x + y * y)
