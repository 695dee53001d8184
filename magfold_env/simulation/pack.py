"""Convert scenes to arrays for the kernels: the chain, its initial pose, magnets and the field."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from threading import Lock
from typing import Annotated, NamedTuple, ParamSpec, TypeVar, get_args

import numpy as np

from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import interpreted
from magfold_env.engine.elementary import sincos
from magfold_env.engine.magnets.laws import NEAREST2
from magfold_env.engine.magnets.multipoles import HIGHEST, MOST, moments
from magfold_env.engine.magnets.pairs import BLEND, LANES
from magfold_env.engine.state import (
    Array,
    Bodies,
    FarTable,
    Field,
    Magnets,
    Model,
    Tables,
)
from magfold_env.engine.workspace import zeros
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
NO_FAR_TABLE = FarTable(0.0, 0.0, 0.0, 0.0, np.zeros(4), np.zeros((0, 0, 0)))
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
    inset, width = float(np.min(scene.magnets.inset)), widest(scene.magnets)
    return stop_overshoot(scene.casing.side, inset, width, bool(magnets.graded.any()))


def stop_overshoot(side: float, inset: float, width: float, touching: bool) -> float:
    """Return `Model.stop_overshoot`, for the least inset and the largest width of magnets [m]."""
    # Beyond the stop, the forces of faces that may touch continue as before it.
    return PAST_STOP * (TABLE_GAP * width if touching else 2.0 * inset) / side


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


SIDE, WIDTH, HEIGHT, THICKNESS, INSET = range(5)
"""Rows of `Sizing.size`."""
SIZED = "height2", "far_radius", "group_radius", "nearest2", "depth", "reach"
"""Numbers of `Magnets` that follow from sizes."""
NEAR_GAP = (1.0 - 1e-9) * TABLE_GAP
"""Gap in widths of the widest face below which faces may touch."""


@by_pointer
class Sizing(NamedTuple):
    """The data with which `size_magnets` finds the nodes of magnets of any size by one rule."""

    size: Annotated[Array, 5, 4]  # by face, see `SIDE` [m]
    offset: Array  # of a face's nodes, in widths, (ranks, most nodes)
    room: Array  # radii of ranks, in widths, (ranks,)
    radius: Array  # radii of levels, in widths, (levels,)
    beyond: Array  # radii of expansions of casings and of segments, in diagonals, (2,)
    pole: Array  # nodes behind a face and their charges: offsets, charges, x and y [m], (4, 8)
    powers: Annotated[Array, 4, HIGHEST + 1, 8]  # scratch of `moments`
    number: Annotated[Array, len(SIZED)]


def new_sizing(rule: Rule, strips: bool) -> tuple[Sizing, Magnets]:
    """Allocate magnets without sizes, and the data to size them."""
    # Level 0 is the last rank; after the levels come the nodes of faces that may touch.
    counts = (rule.ranks[-1], *rule.levels, rule.graded)
    levels, most = len(counts) - 1, -(-max(counts) // LANES) * LANES
    node, weight = np.zeros((2, levels + 1, most))
    for level, count in enumerate(counts[:-1]):
        node[level, :count], weight[level, :count] = width_rule(strips, count)
    if rule.graded > 0:
        node[levels, : rule.graded], weight[levels, : rule.graded] = graded_rule(rule.graded)
    ranks, most = len(rule.ranks), max(rule.ranks)
    offset, share = np.zeros((ranks, most)), np.zeros((ranks, 8 * most))
    for rank, count in enumerate(rule.ranks):
        offset[rank, :count], part = width_rule(strips, count)
        share[rank, : 8 * count] = np.outer(np.repeat([1.0, -1.0], 4), part).ravel()
    # Four nodes give exact moments up to the seventh order.
    four, part = width_rule(True, 4)
    kit = zeros(
        Sizing, {}, offset=offset,
        room=np.array([math.inf, *rule.rooms]), radius=np.array([math.inf, *rule.radii]),
        beyond=np.array([rule.far, rule.groups]),
        pole=np.stack([np.tile(four, 2), np.concatenate([part, -part]), np.zeros(8), np.zeros(8)]),
    )  # fmt: skip
    sizes = {"ranks": ranks, "terms": MOST, "nodes a casing": 8 * most, "levels": levels}
    magnets = zeros(
        Magnets, sizes, strips=strips, even=True, far_order=rule.order,
        **dict.fromkeys(SIZED, 0.0), rank_count=np.array(rule.ranks, dtype=np.int64),
        node_weight=share, level_count=np.array(counts, dtype=np.int64), level_node=node,
        level_weight=weight, tables=NO_TABLES,
    )  # fmt: skip
    return kit, magnets


@interpreted
def size_magnets(kit: Sizing, magnets: Magnets) -> None:
    """Fill in the arrays of magnets and the numbers that follow from their sizes."""
    size, number = kit.size, kit.number
    side, widest, depth, nearest2 = size[SIDE, 0], 0.0, 0.0, NEAREST2
    for f in range(4):
        widest = max(widest, size[WIDTH, f])
    for f in range(8):
        g = f % 4
        outer, width = side / 2.0 - size[INSET, g], size[WIDTH, g]
        depth = max(depth, outer)
        distance = outer if f < 4 else outer - size[THICKNESS, g]
        magnets.face_x[f], magnets.face_y[f] = distance * FACE_X[g], distance * FACE_Y[g]
        magnets.face_tx[f], magnets.face_ty[f] = -FACE_Y[g] * width, FACE_X[g] * width
        magnets.face_half[f] = size[HEIGHT, g] / 2.0
        for rank in range(magnets.rank_count.size):
            count = magnets.rank_count[rank]
            for k in range(count):
                offset, here = kit.offset[rank, k], count * f + k
                magnets.node_x[rank, here] = magnets.face_x[f] + magnets.face_tx[f] * offset
                magnets.node_y[rank, here] = magnets.face_y[f] + magnets.face_ty[f] * offset
        for other in range(8):
            gap = size[INSET, g] + (0.0 if f < 4 else size[THICKNESS, g])
            gap += size[INSET, other % 4] + (0.0 if other < 4 else size[THICKNESS, other % 4])
            near = magnets.level_count[magnets.level_count.size - 1] > 0 and gap < NEAR_GAP * widest
            magnets.graded[f, other] = int(near)
            nearest2 = TOUCHING2 if near else nearest2
    for f in range(4):
        for k in range(8):
            face = f if k < 4 else f + 4
            kit.pole[2, k] = magnets.face_x[face] + kit.pole[0, k] * magnets.face_tx[face]
            kit.pole[3, k] = magnets.face_y[face] + kit.pole[0, k] * magnets.face_ty[face]
        pole, out = kit.pole, magnets.face_moment[f]
        moments(pole[2], pole[3], pole[1], size[HEIGHT, f], kit.powers, out)
    for k in range(kit.room.size):
        magnets.rank_radius[k] = kit.room[k] * widest
    for k in range(kit.radius.size):
        magnets.level_radius[k] = kit.radius[k] * widest
    number[0] = size[HEIGHT, 0] * size[HEIGHT, 0]
    number[1] = kit.beyond[0] * side * math.sqrt(2.0)
    number[2] = kit.beyond[1] * side * math.sqrt(2.0)
    number[3], number[4] = nearest2, depth
    number[5] = 2.0 * depth + BLEND * magnets.level_radius[1] if kit.radius.size > 1 else 0.0


@lru_cache(maxsize=64)
def _build(rule: Rule, strips: bool, side: float, sizes: MagnetSizes) -> Magnets:
    kit, magnets = new_sizing(rule, strips)
    kit.size[:] = (side,) * 4, *sizes
    size_magnets(kit, magnets)
    even = min(sizes.height) == max(sizes.height)
    return magnets._replace(even=even, **dict(zip(SIZED, kit.number.tolist(), strict=True)))


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
    depth = np.append(sizes.inset, np.add(sizes.inset, sizes.thickness))
    near = (depth < NEAR_GAP * widest(part)) & part.bounded
    found = found._replace(graded=near.astype(np.int64))
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
