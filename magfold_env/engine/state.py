"""The kernels' data: NamedTuples of arrays and scalars, in SI units.

Inside the engine a chain is indexed from its inner end, which may be pinned or held in the tube,
and a straight chain points along +x. ``simulation.pack`` converts a scene to this form.
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
# Shapes of arrays, which `engine.workspace.zeros` allocates.
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
    """The components of a chain as rigid bodies; each array has the shape (n,)."""

    mass: Array  # [kg]
    inertia: Array  # about the centre [kg m²]
    reach: Array  # inner hinge to centre [m]
    length: Array  # inner hinge to outer hinge [m]


@by_pointer
class Pose(NamedTuple):
    """The components' poses: cosines and sines of headings, and centres [m], each of shape (n,)."""

    cos: PerBody
    sin: PerBody
    x: PerBody
    y: PerBody


@by_pointer
class Magnets(NamedTuple):
    """Pole faces of a casing and their quadrature.

    A casing has eight pole faces, numbered 0-3 (the outer ones, front-left first) and 4-7 (their
    inner counterparts, with the opposite sign). *Ranks* are sets of nodes for whole casings,
    coarsest first; *levels* are sets for single pole faces; level 0 is the last rank. See
    `engine.magnets.pairs` for how they act together, and `simulation.near_table` for the tables.
    """

    strips: bool  # upright charged rectangles; else point charges
    even: bool  # all have the same height
    far_order: int  # of expansions
    # The numbers that follow from sizes are side by side.
    height2: float  # H² of the first face [m²]
    far_radius: float  # casings farther apart use expansions, see `magnets.multipoles` [m]
    group_radius: float  # so do segments of k components farther apart than k times this [m]
    nearest2: float  # least squared distance of nodes; smaller ones are replaced by it [m²]
    depth: float  # distance of the outermost face from the centre [m]
    reach: float  # centres farther apart than this have no near faces [m]
    rank_count: IntArray  # nodes per pole face at every rank, (ranks,)
    rank_radius: Annotated[Array, "ranks"]  # casings no farther apart give a rank full weight [m]
    face_moment: Annotated[Array, 4, 2, "terms"]  # for unit charge, casing's frame [√(µ0/4π) m^k]
    node_x: Annotated[Array, "ranks", "nodes a casing"]  # nodes in the casing's frame [m]
    node_y: Annotated[Array, "ranks", "nodes a casing"]
    node_weight: Array  # share of the face's charge, signed for inner faces
    face_x: Annotated[Array, 8]  # centres of the pole faces in the casing's frame [m]
    face_y: Annotated[Array, 8]
    face_tx: Annotated[Array, 8]  # vectors along their widths, of the same length [m]
    face_ty: Annotated[Array, 8]
    face_half: Annotated[Array, 8]  # half their heights [m]
    level_count: IntArray  # nodes per face at every level, (levels,); then in `sheets.between`
    level_node: Array  # offsets along the width, in widths, (levels, most nodes in whole lanes)
    level_weight: Array  # shares of the charge
    level_radius: Annotated[Array, "levels"]  # within it, level k has full weight [m], [0] unused
    graded: Annotated[IntArray, 8, 8]  # 1: faces that may be so near that they use `magnets.sheets`
    tables: Tables


@by_pointer
class Field(NamedTuple):
    """A uniform field and a fixed magnet with pole faces divided into strips of equal width."""

    present: bool
    x: float  # flux density of the uniform field [T]
    y: float
    strip_x: Array  # centres of the strips, (strips,) [m]
    strip_y: Array
    strip_tx: float  # vector along a strip's width, of the same length [m]
    strip_ty: float
    strip_q: Array  # charges, (strips,) [A·m]
    strip_half: float  # half the magnet's height [m]
    graded: IntArray  # 1: faces that may be so near to the magnet, (8,)


@by_pointer
class Tables(NamedTuple):
    """Splines of energies [J/(A·m)²] of unit faces i and j, at index 4 i + j; see `near_table`."""

    end: float  # joint angles from −end to end are covered [rad]; 0: no splines
    finest: float  # finest knot distance of ``one`` near the ends [rad]; 0: even knots
    one: Array  # (knots + 4, 16)
    two: Array  # (knots + 4, (knots + 4)·16)
    far: FarTable


@by_pointer
class FarTable(NamedTuple):
    """Splines for casings at least three joints apart; see `engine.magnets.far_table`.

    Their variables are 1/r and the direction of each casing as seen from the other. The interaction
    of poles nearer than ``soft`` is softened.
    """

    end: float  # largest covered distance of centres [m]; 0: no table
    density: float  # knots of 1/r, from 1/end on [m]
    soft: float  # [m]
    reach: float  # casings with centres farther apart have no such nodes [m]
    soften: Array  # energy of nearer nodes [1/m], a polynomial in ρ² − soft², (4,)
    energy: Array  # front-left faces of unit charge [J/(A·m)²], (knots + 2, turns + 3, turns + 12):
    # directions from the second casing that are right angles apart are side by side


@by_pointer
class Model(NamedTuple):
    """A chain and its surroundings, without the chain's state."""

    n: int
    bodies: Bodies
    magnets: Magnets
    charge: Array  # signed charge of each outer pole face, (n, 4) [A·m]; 0 is no magnet
    magnetic: bool
    side: float  # side of the casing [m]
    rounding: float  # radius of the casing's corners [m]
    stop_overshoot: float  # how far beyond its stop a joint may be in a trial [rad]
    friction_limit: Array  # largest friction force µ m g of a released component, (n,) [N]
    friction_radius: float  # c of the friction ellipsoid (vx, vy, c·ω) [m]
    frictional: bool
    gravity_x: float  # in-plane [m/s²]
    gravity_y: float
    field: Field
    contact: bool  # joint stops and contacts of squares act
    tube: bool
    at_mouth: bool  # components have magnets only outside the tube
    force_limit: float  # of the drive [N]
    obstacles: Annotated[Array, "obstacles", 7]  # the tube's walls first, see `engine.indices`
    pinned: bool  # the innermost hinge is fixed
    bump_rate: float  # mean number of bumps per second [1/s]
    bump_speed: float  # change of velocity by each bump [m/s]
    bump_seed: int
    bump_duration: float  # time after which bumps end [s]
    tolerance: float  # [rad]
    typical_rate: float  # a typical angular rate [rad/s], the scale for errors of rates
    fastest_rate: float  # the lightest component's typical rate [rad/s], the scale for short times
    max_steps: int
    max_steps_per_second: int
    duration: float  # longest time to settle [s], from the last release if there is a tube


@by_pointer
class State(NamedTuple):
    """The state of a run; every array is updated in place. See `engine.indices`."""

    q: Coordinates  # headings, then the base [rad, m]
    v: Coordinates  # rates of the coordinates [rad/s, m/s]
    lock: IntPerBody  # joint k joins components k-1 and k; -1, +1: at that stop, 0: not
    stuck: IntPerBody  # 1: held by friction
    counter: Annotated[IntArray, 16]
    clock: Annotated[Array, 10]  # [s]
    feed: Annotated[Array, 5]  # of the base and the drive
    account: Annotated[Array, 7]  # of impulses and energies
    waiting: Annotated[Array, "n", 4]  # charges that components get at the mouth [A·m]
    speed: PerBody  # of the feed while each component is in the mouth [m/s]; negative: inward


@by_pointer
class Record(NamedTuple):
    """Frames of a run, taken every ``interval`` seconds; an interval of 0 records nothing."""

    interval: float
    time: Annotated[Array, "capacity"]
    q: Annotated[Array, "capacity", "n + 2"]
    v: Annotated[Array, "capacity", "n + 2"]
    lo: Annotated[IntArray, "capacity"]
    impulse: Annotated[Array, "capacity"]  # of the drive up to each frame [N·s]


@by_pointer
class Segments(NamedTuple):
    """Segments of 1, 2, 4, … components, and their actions on each other.

    See `engine.magnets.multipole_tree`. Row i is component i, and row ``start[l] + s`` is segment s
    of level l.
    """

    start: Annotated[IntArray, "levels"]  # first row of every level
    charged: IntPerRow  # 1: has magnets
    x: PerRow  # centres [m]
    y: PerRow
    body: Annotated[Array, "n", 2, "terms"]  # moments in the components' own frames
    moment: Moments  # moments in the world's frame
    local: Moments  # derivatives of the other segments' potential at the centres
    push: Annotated[Array, "rows", 2]  # forces on the centres [N]
    stack: Annotated[IntArray, "depth", 3]  # levels and segments of pairs still to be visited
    top: Annotated[IntArray, 1]  # number of these pairs
    pair: Annotated[IntArray, "batch", 2]  # pairs of casings to sum one by one
    scratch: Annotated[Array, 13, "terms"]  # of `engine.magnets.multipoles`


@by_pointer
class Stencils(NamedTuple):
    """The splines that are nonzero at pairs' poses, weighted with the charges and summed.

    A pair's number determines its slot, which other pairs may share if the chain is long.
    """

    pair: Annotated[IntArray, "slots"]  # number of the pair that owns the slot; 0: none
    cell: Annotated[IntArray, "slots"]  # of the table
    value: Annotated[
        Array, "slots", 4, 16
    ]  # by direction from the second casing; other two together [J]
    column: Annotated[Array, 31, 8]  # of pairs looked up together, see `far_table`
    here: Annotated[Array, 2, 16]  # values combined at a direction, and their slopes
    sum: Annotated[Array, 16]
    product: Annotated[Array, 4, 16]  # of charges, by face of the first casing [A²·m²]
    begin: Annotated[IntArray, 4]  # first column of each face in the table


@by_pointer
class Bends(NamedTuple):
    """The splines that are nonzero at joints' angles, weighted with the charges and summed.

    Row i is for components i and i + 1, or i and i + 2; see `engine.magnets.near_table`.
    """

    one_cell: IntPerBody  # number of the interval between knots, from 1; 0: none
    one: Annotated[Array, "n", 6]  # [J]
    two_cell: IntPerBody
    two: Annotated[Array, "n", 36]
    product: Annotated[Array, 16]  # of charges [A²·m²]
    part: Annotated[Array, 4]


@by_pointer
class Nodes(NamedTuple):
    """Scratch space of the magnets' sums and splines."""

    faces: IntPerBody  # charged faces per casing
    along: PerNode  # nodes of charged faces in their casing's frame [m]
    across: PerNode
    x: PerNode  # nodes in the world [m]
    y: PerNode
    q: PerNode  # their charges [A·m]
    half: PerNode  # half the heights of their lines [m]
    segments: Segments
    lane_x: PerLane  # sums of the vectorised loops
    lane_y: PerLane
    lane_u: PerLane
    spline: Annotated[Array, 4, "spline"]  # weights of two splines and their slopes
    bends: Bends
    stencils: Stencils


@by_pointer
class Rigid(NamedTuple):
    """Stored interactions of pairs of components between which all joints are at their stops."""

    charge: Annotated[Array, "n", 4]  # for which the other fields are valid [A·m]
    stop: IntPerBody  # joint k is at its left (1) or right (2) stop, or at neither (0)
    reach: IntPerBody  # the last component to which each one is rigidly joined
    code: Annotated[IntArray, "n", "spans"]  # see `engine.magnets.chain`; 0: none stored
    force: Annotated[Array, "n", "spans", 3]  # on i in its own frame [N], torque about its centre
    pose: Pose  # of the two casings of the pair being computed
    charges: Annotated[Array, 2, 4]
    nodes: Nodes


@by_pointer
class Loads(NamedTuple):
    """Loads on the components: forces at their centres, torques about the centres, each (n,)."""

    fx: PerBody  # [N]
    fy: PerBody
    torque: PerBody  # [N·m]


@by_pointer
class Centres(NamedTuple):
    """The motion of the components' centres, each of shape (n,)."""

    vx: PerBody  # [m/s]
    vy: PerBody
    ax: PerBody  # accelerations at zero accelerations of the coordinates [m/s²]
    ay: PerBody


@by_pointer
class Recursion(NamedTuple):
    """Scratch space of the chain's recursions; see `engine.chain`."""

    articulated: Annotated[Array, "n", 7]  # inertias, see `articulated.factor`
    sweep: Annotated[Array, "sweep", "n"]  # of `recursion.accelerate`
    hold: PerBody  # torques that hold locked joints [N·m]
    base: Annotated[Array, 3]  # see `engine.indices`
    unlocked: IntPerBody  # zeros: the locks of a chain with all joints free
    force: Coordinates  # generalised, without constraints


@by_pointer
class Stages(NamedTuple):
    """Scratch space of a Runge-Kutta step; see `engine.stepping.stages`."""

    q: Coordinates  # at a stage
    v: Coordinates
    new_q: Coordinates  # at the end of the step
    new_v: Coordinates
    slope_q: Annotated[Array, "stages", "n + 2"]
    slope_v: Annotated[Array, "stages", "n + 2"]
    drive: Annotated[Array, "stages"]  # force by which the drive keeps its speed [N]


@by_pointer
class Boxes(NamedTuple):
    """The squares, followed by the obstacles; see `engine.contact.boxes`."""

    x: PerBox  # centres [m]
    y: PerBox
    c: PerBox  # axes
    s: PerBox
    a: PerBox  # half sizes along and across the axes [m]
    b: PerBox


@by_pointer
class Sweep(NamedTuple):
    """Scratch space of `engine.contact.sweep`; every motion lasts for a time of 1.

    Slots hold samples: the first sample has its own slot, and the others use two alternately.
    """

    path: Annotated[Array, 4, "n + 2"]  # coefficients of the coordinates' changes [rad, m]
    turn: PerBody  # bounds on the headings' rates [rad]
    twist: PerBody  # bounds on their accelerations
    way: PerBody  # bounds on the centres' speeds [m]
    bend: PerBody  # bounds on their accelerations
    turns: PerBody  # sums of bounds on joint rates, up to each component's inner joint [rad]
    x: Annotated[Array, 3, "n"]  # centres of the squares [m]
    y: Annotated[Array, 3, "n"]
    c: Annotated[Array, 3, "n"]  # their first axes
    s: Annotated[Array, 3, "n"]


@by_pointer
class Rows(NamedTuple):
    """Constraints: joint stops, contacts, then three rows per component that friction may hold."""

    counts: Annotated[IntArray, 5]  # see `engine.indices`
    id: Annotated[IntArray, "rows", 4]  # joint and sign; box, other and its corner; component
    jacobian: Annotated[Array, "rows", "n + 2"]
    response: Annotated[Array, "rows", "n + 2"]  # M⁻¹Jᵀ
    delassus: Annotated[Array, "rows", "rows"]
    bias: PerRow
    gap: PerRow  # of contacts at the beginning of the step [m]
    multiplier: PerRow
    passive: IntPerRow
    equality: IntPerRow
    rate: PerRow  # w
    trial: PerRow
    update: PerRow
    diagonal: PerRow  # added to the matrix's diagonal
    cholesky: Annotated[Array, "rows", "rows"]
    inverse: PerRow  # reciprocals of the factor's diagonal
    hopping: IntPerBody  # joints that left their stops for almost no time


@by_pointer
class Newton(NamedTuple):
    """Scratch space of `engine.friction.solver`, where the names are explained."""

    factor: Annotated[Array, "rows", "n + 2"]  # G
    hessian: Annotated[Array, "n + 2", "n + 2"]
    point: Coordinates  # y
    gradient: Coordinates
    step: Coordinates
    inverse: Coordinates  # reciprocals of the factorised Hessian's diagonal
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
    """Scratch space for components that friction stops and holds; see `engine.friction`."""

    motion: IntPerBody  # a component's next motion, see `engine.friction.sticking`
    braking: PerBody  # when components may stop [s]
    slow: IntPerBody  # 1: friction is solved for and is not a smooth force
    before: Coordinates  # velocities before components were put to rest
    change: Coordinates  # of accelerations, as friction tears loose
    newton: Newton


@by_pointer
class Moreau(NamedTuple):
    """Scratch space of a Moreau step; see `engine.stepping.moreau`."""

    smooth: Coordinates  # accelerations without constraints, at the beginning of the step
    middle_q: Coordinates
    middle_v: Coordinates
    middle_smooth: Coordinates  # accelerations without constraints, in the middle
    new_q: Coordinates
    new_v: Coordinates
    force: Coordinates  # without inertia and constraints, in the middle


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
    """Copy the entries from ``first`` on, because assigning whole arrays would allocate memory."""
    for k in range(first, source.size):
        target[k] = source[k]


@kernel
def is_finite(values: Array) -> bool:
    """Whether every number is finite."""
    for value in values:
        if not math.isfinite(value):
            return False
    return True
