"""What the kernels see: NamedTuples of arrays and scalars, in SI units.

Inside the engine a chain is indexed from its inner end, the one that is pinned or held in the
tube, and a straight chain points along +x. ``simulation.pack`` turns a scene into this form.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import inlined, kernel

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
# Of how many dimensions, and how long; `engine.workspace.zeros` makes them.
PerBody = Annotated[Array, "n"]
IntPerBody = Annotated[IntArray, "n"]
Coordinates = Annotated[Array, "n + 2"]
PerBox = Annotated[Array, "boxes"]
PerRow = Annotated[Array, "rows"]
IntPerRow = Annotated[IntArray, "rows"]
PerNode = Annotated[Array, "ranks", "n", "nodes a casing"]
PerLane = Annotated[Array, "lanes"]
Moments = Annotated[Array, "rows", 2, "terms"]  # see `engine.magnets.multipoles`


@by_pointer
class Bodies(NamedTuple):
    """The rigid parts of a chain, each array of shape (n,)."""

    mass: Array  # [kg]
    inertia: Array  # about the centre [kg m²]
    reach: Array  # inner hinge to centre [m]
    length: Array  # inner hinge to outer hinge [m]


@by_pointer
class Pose(NamedTuple):
    """Where the components are: heading cosines and centres [m], each of shape (n,)."""

    cos: PerBody
    sin: PerBody
    x: PerBody
    y: PerBody


@by_pointer
class Magnets(NamedTuple):
    """Pole faces of a casing and the quadrature that replaces them.

    A casing has eight pole faces, numbered 0-3 (the outer ones, front-left first) and 4-7 (their
    inner counterparts, with the opposite sign). *Ranks* are sets of nodes for whole casings, the
    coarsest first, *levels* those for single pole faces; level 0 is the last rank. See
    ``engine.magnets`` for how they act together, and `simulation.near_table` for the tables.
    """

    strips: bool  # charged rectangles standing on the plane; else point charges
    even: bool  # all of one height
    height2: float  # H² of the first face [m²]
    rank_count: IntArray  # nodes a pole face at every rank, (ranks,)
    rank_radius: Array  # distances of casings within which a rank is in full force, (ranks,) [m]
    far_radius: float  # casings farther apart are expanded, see `magnets.multipoles` [m]
    far_order: int
    group_radius: float  # segments of k components farther apart than k times this are, too [m]
    face_moment: Array  # with unit charge in the casing's frame, (4, 2, terms) [√(µ0/4π) m^k]
    node_x: Array  # nodes in the casing's frame, (ranks, most nodes a casing) [m]
    node_y: Array
    node_weight: Array  # share of the face's charge, signed for inner faces
    nearest2: float  # squared distance of the nearest that nodes come to each other [m²]
    depth: float  # of the outermost face: distance from the centre [m]
    face_x: Array  # centres of the pole faces in the casing's frame, (8,) [m]
    face_y: Array
    face_tx: Array  # vectors along their widths and as long, (8,) [m]
    face_ty: Array
    face_half: Array  # half their heights, (8,) [m]
    level_count: IntArray  # nodes a face at every level, (levels,); then those of `sheets.between`
    level_node: Array  # offsets along the width, in widths, (levels, most nodes in whole lanes)
    level_weight: Array  # shares of the charge
    level_radius: Array  # within it, level k is in full force; (levels,) [m], [0] unused
    reach: float  # centres farther apart than this have no near faces [m]
    graded: IntArray  # 1: faces that may be so near that `magnets.sheets` is for them, (8, 8)
    tables: Tables


@by_pointer
class Field(NamedTuple):
    """An even field and a fixed magnet, whose pole faces are cut into strips of equal width."""

    present: bool
    x: float  # flux density of the even field [T]
    y: float
    strip_x: Array  # centres of the strips, (strips,) [m]
    strip_y: Array
    strip_tx: float  # vector along a strip's width and as long [m]
    strip_ty: float
    strip_q: Array  # charges, (strips,) [A·m]
    strip_half: float  # half the magnet's height [m]
    graded: IntArray  # 1: faces that may be so near to it, (8,)


@by_pointer
class Tables(NamedTuple):
    """Splines, see `simulation.near_table`: face pairs (4 i + j) of unit charge [J/(A·m)²]."""

    end: float  # joint angles from −end to end are covered [rad]; 0: there are none
    finest: float  # how near to the ends the knots of ``one`` crowd [rad]; 0: they are even
    one: Array  # (knots + 4, 16)
    two: Array  # (knots + 4, (knots + 4)·16)
    far: FarTable


@by_pointer
class FarTable(NamedTuple):
    """Splines for casings farther apart, see `engine.magnets.far_table`.

    They are over 1/r and the directions to each other, seen from both; poles nearer than ``soft``
    act more softly in them.
    """

    end: float  # centres so far apart are covered [m]; 0: there are none
    density: float  # knots of 1/r, from 1/end on [m]
    energy: Array  # front-left faces of unit charge [J/(A·m)²], (knots + 2, turns + 3, turns + 12):
    # directions from the second casing a right angle apart side by side
    soft: float  # [m]
    soften: Array  # energy of nearer nodes [1/m], a polynomial in the rest of ρ², (4,)
    reach: float  # centres farther apart than this have no such nodes [m]


@by_pointer
class Model(NamedTuple):
    """One chain and its world, without its state."""

    n: int
    bodies: Bodies
    magnets: Magnets
    charge: Array  # signed charge of each outer pole face, (n, 4) [A·m]; 0 is no magnet
    magnetic: bool
    side: float  # of the casing [m]
    rounding: float  # radius of its corners [m]
    stop_overshoot: float  # how far beyond its stop a joint may be tried [rad]
    friction_limit: Array  # largest friction force µ m g of a released component, (n,) [N]
    friction_radius: float  # c of the friction ellipsoid (vx, vy, c·ω) [m]
    frictional: bool
    gravity_x: float  # in-plane [m/s²]
    gravity_y: float
    field: Field
    contact: bool  # joint stops and squares act
    tube: bool
    at_mouth: bool  # components have magnets only outside the tube
    force_limit: float  # of the drive [N]
    obstacles: Annotated[Array, "obstacles", 7]  # the tube's walls first, see `engine.indices`
    pinned: bool  # the innermost hinge is fixed
    bump_rate: float  # mean number of bumps a second [1/s]
    bump_speed: float  # by which each changes velocities [m/s]
    bump_seed: int
    bump_duration: float  # how long they go on [s]
    tolerance: float  # [rad]
    typical_rate: float  # a typical angular rate [rad/s]: errors of rates are judged by it
    fastest_rate: float  # that of the lightest component [rad/s]: short times are judged by it
    max_steps: int
    max_steps_per_second: int
    duration: float  # longest time to settle in [s], from the last release if there is a tube


@by_pointer
class State(NamedTuple):
    """The moving part; every array is updated in place. See `engine.indices`."""

    q: Coordinates  # headings, then the base [rad, m]
    v: Coordinates  # their rates [rad/s, m/s]
    lock: IntPerBody  # joint k joins components k-1 and k; -1, +1: at that stop, 0: not
    stuck: IntPerBody  # 1: held by friction
    counter: Annotated[IntArray, 16]
    clock: Annotated[Array, 10]  # [s]
    feed: Annotated[Array, 5]  # of its base and its drive
    account: Annotated[Array, 7]  # of its energy
    waiting: Annotated[Array, "n", 4]  # charges that components get at the mouth [A·m]
    speed: PerBody  # of the feed while each component is in the mouth [m/s]; below 0 it pulls back


@by_pointer
class Record(NamedTuple):
    """Frames of a run, taken every ``interval`` seconds; an interval of 0 records nothing."""

    interval: float
    time: Annotated[Array, "capacity"]
    q: Annotated[Array, "capacity", "n + 2"]
    v: Annotated[Array, "capacity", "n + 2"]
    lo: Annotated[IntArray, "capacity"]
    impulse: Annotated[Array, "capacity"]  # of the drive so far [N·s]


@by_pointer
class Segments(NamedTuple):
    """Runs of 1, 2, 4, … components and what they feel from each other.

    See `engine.magnets.multipole_tree`. Row i is component i, row ``start[l] + s`` segment s of
    level l.
    """

    start: Annotated[IntArray, "levels"]  # first row of every level
    charged: IntPerRow  # 1: has magnets
    x: PerRow  # centres [m]
    y: PerRow
    body: Annotated[Array, "n", 2, "terms"]  # moments in the components' own frames
    moment: Moments  # and in the world
    local: Moments  # derivatives of the others' potential at the centres
    push: Annotated[Array, "rows", 2]  # forces on the centres [N]
    stack: Annotated[IntArray, "depth", 3]  # levels and segments of pairs yet to be looked at
    top: Annotated[IntArray, 1]  # how many those are
    pair: Annotated[IntArray, "batch", 2]  # casings to be summed one by one
    scratch: Annotated[Array, 13, "terms"]  # of `engine.magnets.multipoles`


@by_pointer
class Stencils(NamedTuple):
    """The splines that are not zero at pairs' poses, with the charges folded in.

    A pair has the slot of its number, which others may share if the chain is long.
    """

    pair: Annotated[IntArray, "slots"]  # the number of whose it is; 0: nobody's
    cell: Annotated[IntArray, "slots"]  # of the table
    value: Annotated[
        Array, "slots", 4, 16
    ]  # by direction from the second casing; other two together [J]
    column: Annotated[Array, 31, 8]  # of pairs that are looked up together, see `far_table`
    here: Annotated[Array, 2, 16]  # combined at a heading, and their slopes
    sum: Annotated[Array, 16]
    product: Annotated[Array, 4, 16]  # of charges, by face of the first casing [A²·m²]
    begin: Annotated[IntArray, 4]  # where these faces begin in the table


@by_pointer
class Bends(NamedTuple):
    """The splines that are not zero at joints' angles, with the charges folded in.

    Row i is of component i and the next one, or the next but one; see `engine.magnets.near_table`.
    """

    one_cell: IntPerBody  # number of the space between knots, from 1 on; 0: none
    one: Annotated[Array, "n", 6]  # [J]
    two_cell: IntPerBody
    two: Annotated[Array, "n", 36]
    product: Annotated[Array, 16]  # of charges [A²·m²]
    part: Annotated[Array, 4]


@by_pointer
class Nodes(NamedTuple):
    """Scratch space of the magnets' sums and splines."""

    faces: IntPerBody  # charged faces a casing
    along: PerNode  # those of charged faces in their casing's frame [m]
    across: PerNode
    x: PerNode  # and in the world
    y: PerNode
    q: PerNode  # their charges [A·m]
    half: PerNode  # half the height of what they stand for [m]
    segments: Segments
    lane_x: PerLane  # sums of the vectorised loops
    lane_y: PerLane
    lane_u: PerLane
    spline: Annotated[Array, 4, "spline"]  # weights of two splines and their slopes
    bends: Bends
    stencils: Stencils


@by_pointer
class Rigid(NamedTuple):
    """What pairs do to each other while all joints between them are at their stops."""

    charge: Annotated[Array, "n", 4]  # for which the rest is valid [A·m]
    stop: IntPerBody  # joint k is at its left (1) or right (2) stop, or at none (0)
    reach: IntPerBody  # the last component to which each is rigidly joined
    code: Annotated[IntArray, "n", "spans"]  # see `engine.magnets.chain`; 0: none kept
    force: Annotated[Array, "n", "spans", 3]  # on i in its frame [N], torque about its centre
    pose: Pose  # of the two casings for which they are being found
    charges: Annotated[Array, 2, 4]
    nodes: Nodes


@by_pointer
class Loads(NamedTuple):
    """What acts on the components: forces at their centres, torques about them, each (n,)."""

    fx: PerBody  # [N]
    fy: PerBody
    torque: PerBody  # [N·m]


@by_pointer
class Centres(NamedTuple):
    """How the components' centres move, each of shape (n,)."""

    vx: PerBody  # [m/s]
    vy: PerBody
    ax: PerBody  # accelerations that remain when those of the coordinates are zero [m/s²]
    ay: PerBody


@by_pointer
class Recursion(NamedTuple):
    """Scratch space of the chain's recursions, see `engine.chain`."""

    articulated: Annotated[Array, "n", 7]  # inertias, see `articulated.factor`
    sweep: Annotated[Array, "sweep", "n"]  # of `recursion.accelerate`
    hold: PerBody  # torques that keep locked joints [N·m]
    base: Annotated[Array, 3]  # see `engine.indices`
    unlocked: IntPerBody  # zeros: the locks of a chain whose joints all turn
    force: Coordinates  # generalised, without constraints


@by_pointer
class Stages(NamedTuple):
    """Scratch space of a Runge-Kutta step, see `engine.stepping.stages`."""

    q: Coordinates  # within the step
    v: Coordinates
    new_q: Coordinates  # at its end
    new_v: Coordinates
    slope_q: Annotated[Array, "stages", "n + 2"]
    slope_v: Annotated[Array, "stages", "n + 2"]
    drive: Annotated[Array, "stages"]  # force with which the drive keeps its speed [N]


@by_pointer
class Boxes(NamedTuple):
    """Squares, then obstacles, see `engine.contact.boxes`."""

    x: PerBox  # centres [m]
    y: PerBox
    c: PerBox  # axes
    s: PerBox
    a: PerBox  # half sizes along them and across [m]
    b: PerBox


@by_pointer
class Sweep(NamedTuple):
    """Scratch space of `engine.contact.sweep`, where a motion takes a time of 1.

    A look has a slot each: the first one, and two that take turns.
    """

    path: Annotated[Array, 4, "n + 2"]  # coefficients of the coordinates' changes [rad, m]
    turn: PerBody  # bounds of headings' rates [rad]
    twist: PerBody  # and of their accelerations
    way: PerBody  # bounds of the centres' speeds [m]
    bend: PerBody  # and of their accelerations
    turns: PerBody  # sums of the bounds of joints' rates, up to each component's inner joint [rad]
    x: Annotated[Array, 3, "n"]  # centres of the squares [m]
    y: Annotated[Array, 3, "n"]
    c: Annotated[Array, 3, "n"]  # their first axes
    s: Annotated[Array, 3, "n"]


@by_pointer
class Rows(NamedTuple):
    """Constraints: joint stops, then contacts, then three a component that friction may hold."""

    counts: Annotated[IntArray, 5]  # see `engine.indices`
    id: Annotated[IntArray, "rows", 4]  # joint and sign; box, other and its corner; component
    jacobian: Annotated[Array, "rows", "n + 2"]
    response: Annotated[Array, "rows", "n + 2"]  # M⁻¹Jᵀ
    delassus: Annotated[Array, "rows", "rows"]
    bias: PerRow
    gap: PerRow  # of contacts, when the step begins [m]
    multiplier: PerRow
    passive: IntPerRow
    equality: IntPerRow
    rate: PerRow  # w
    trial: PerRow
    update: PerRow
    diagonal: PerRow  # what is added to that of the matrix
    cholesky: Annotated[Array, "rows", "rows"]
    inverse: PerRow  # reciprocals of its diagonal
    hopping: IntPerBody  # joints that left their stops for next to no time


@by_pointer
class Newton(NamedTuple):
    """Scratch space of `engine.friction.solver`, where the names are explained."""

    factor: Annotated[Array, "rows", "n + 2"]  # G
    hessian: Annotated[Array, "n + 2", "n + 2"]
    point: Coordinates  # y
    gradient: Coordinates
    step: Coordinates
    inverse: Coordinates  # of the factorised hessian's diagonal
    scale: PerRow
    friction_limit: PerRow  # largest friction force, in a component's first row
    offset: PerRow  # w where y is 0
    rate: PerRow  # w
    force: PerRow  # λ
    projected: PerRow  # p
    normal: PerRow  # direction of t
    along: PerRow  # G step


@by_pointer
class Friction(NamedTuple):
    """Scratch space of what friction stops and holds, see `engine.friction`."""

    motion: IntPerBody  # of a component: what becomes of it, see `engine.friction.sticking`
    braking: PerBody  # when components may stop [s]
    slow: IntPerBody  # 1: friction is not among the smooth forces, but solved for
    before: Coordinates  # velocities before components were put to rest
    change: Coordinates  # of accelerations, by friction that tears loose
    newton: Newton


@by_pointer
class Moreau(NamedTuple):
    """Scratch space of a step of Moreau's, see `engine.stepping.moreau`."""

    smooth: Coordinates  # accelerations without constraints, when the step begins
    middle_q: Coordinates
    middle_v: Coordinates
    middle_smooth: Coordinates  # accelerations without constraints, in the middle
    new_q: Coordinates
    new_v: Coordinates
    force: Coordinates  # of all but inertia and constraints, in the middle


@by_pointer
class Work(NamedTuple):
    """Scratch space of one run, so that steps allocate nothing."""

    pose: Pose
    nodes: Nodes
    rigid: Rigid
    loads: Loads
    centres: Centres
    chain: Recursion
    stages: Stages
    boxes: Boxes
    sweep: Sweep
    rows: Rows
    friction: Friction
    moreau: Moreau


@inlined
def copy(source: Array, target: Array, first: int) -> None:
    """Copy the entries from ``first`` on: an assignment of whole arrays would allocate."""
    for k in range(first, source.size):
        target[k] = source[k]


@kernel
def is_finite(values: Array) -> bool:
    """Whether every number is."""
    for value in values:
        if not math.isfinite(value):
            return False
    return True
