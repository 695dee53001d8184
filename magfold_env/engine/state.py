"""What the kernels see: NamedTuples of arrays and scalars, in SI units.

Inside the engine a chain is indexed from its inner end, the one that is pinned or held in the
tube, and a straight chain points along +x. ``engine.pack`` turns a scene into this form.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.by_pointer import by_pointer

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


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

    cos: Array
    sin: Array
    x: Array
    y: Array


@by_pointer
class Magnets(NamedTuple):
    """Pole faces of a casing and the quadrature that replaces them.

    A casing has eight pole faces, numbered 0-3 (the outer ones, front-left first) and 4-7 (their
    inner counterparts, with the opposite sign). *Ranks* are sets of nodes for whole casings, the
    coarsest first, *levels* those for single pole faces; level 0 is the last rank. See
    ``engine.magnets`` for how they act together, and ``engine.pair_tables`` for the tables.
    """

    strips: bool  # charged rectangles standing on the plane; else point charges
    even: bool  # all of one height
    height2: float  # H² of the first face [m²]
    rank_count: IntArray  # nodes a pole face at every rank, (ranks,)
    rank_radius: Array  # distances of casings within which a rank is in full force, (ranks,) [m]
    far_radius: float  # casings farther apart are expanded, see ``engine.expansions`` [m]
    far_order: int
    group_radius: float  # segments of k components farther apart than k times this are, too [m]
    group_terms: int  # of their expansion, see ``engine.multipoles``
    face_moment: Array  # of a magnet with unit charge in the casing's frame, (4, 9) [√(µ0/4π) m^k]
    face_wide: Array  # those of ``engine.expansions``, (4, 2, terms)
    node_x: Array  # nodes in the casing's frame, (ranks, most nodes a casing) [m]
    node_y: Array
    node_weight: Array  # share of the face's charge, signed for inner faces
    depth: float  # of the outermost face: distance from the centre [m]
    face_x: Array  # centres of the pole faces in the casing's frame, (8,) [m]
    face_y: Array
    face_tx: Array  # vectors along their widths and as long, (8,) [m]
    face_ty: Array
    face_half: Array  # half their heights, (8,) [m]
    level_count: IntArray  # nodes a face at every level, (levels,)
    level_node: Array  # offsets along the width, in widths, (levels, most nodes in whole lanes)
    level_weight: Array  # shares of the charge
    level_radius: Array  # within it, level k is in full force; (levels,) [m], [0] unused
    reach: float  # centres farther apart than this have no near faces [m]
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
    solid: bool  # there is a magnet, which the chain can run into
    centre_x: float  # of the magnet [m]
    centre_y: float
    cos: float  # of its heading
    sin: float
    half_length: float  # half its size along the heading [m]
    half_width: float


@by_pointer
class Tables(NamedTuple):
    """Splines, see ``engine.pair_tables``: face pairs (4 i + j) of unit charge [J/(A·m)²]."""

    end: float  # joint angles from −end to end are covered [rad]; 0: there are none
    one: Array  # (knots + 4, 16)
    two: Array  # (knots + 4, (knots + 4)·16)


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
    past_stop: float  # how far beyond its stop a joint may be tried [rad]
    grip: Array  # largest friction force µ m g of a released component, (n,) [N]
    arm: float  # c of the friction ellipsoid (vx, vy, c·ω) [m]
    frictional: bool
    gravity_x: float  # in-plane [m/s²]
    gravity_y: float
    field: Field
    contact: bool  # joint stops and squares act
    tube: bool
    bore: float  # [m]
    wall: float  # thickness [m]
    pinned: bool  # the innermost hinge is fixed
    tolerance: float  # [rad]
    rate_scale: float  # a typical angular rate [rad/s]: errors of rates are judged by it
    light_rate: float  # that of the lightest component [rad/s]: short times are judged by it
    max_steps: int
    max_steps_per_second: int


@by_pointer
class State(NamedTuple):
    """The moving part; every array is updated in place.

    In ``counter``, `FRESH` (1) has the accelerations found anew, `TOUCHY` counts steps still to be
    taken by Moreau's scheme, `IN_VAIN` touches in a row with next to no time between; in ``clock``,
    `BRAKE` is how long the next step may be before a component stops, `LAST_STEP` 0 if there is
    none to compare with. `SECOND` and `SECOND_STEPS` are of when the present second began.
    """

    q: Array  # headings, then the base, (n + 2,) [rad, m]
    v: Array  # their rates, (n + 2,) [rad/s, m/s]
    lock: IntArray  # joint k joins components k-1 and k; -1, +1: at that stop, 0: not; (n,)
    stuck: IntArray  # 1: held by friction; (n,)
    counter: IntArray  # (9,)
    clock: Array  # (7,) [s]


LO, STEPS, EVALUATIONS, EVENTS, FRAMES, FRESH, TOUCHY, SECOND_STEPS, IN_VAIN = range(9)
TIME, STEP, FRAME_TIME, BRAKE, SECOND, LAST_STEP, LAST_ERROR = range(7)


@by_pointer
class Record(NamedTuple):
    """Frames of a run, taken every ``interval`` seconds; an interval of 0 records nothing."""

    interval: float
    time: Array  # (capacity,)
    q: Array  # (capacity, n + 2)
    v: Array  # (capacity, n + 2)
    lo: IntArray  # (capacity,)


@by_pointer
class Segments(NamedTuple):
    """Runs of 1, 2, 4, … components and what they feel from each other, see ``engine.segments``.

    Row i is component i, row ``start[l] + s`` segment s of level l.
    """

    start: IntArray  # first row of every level, (levels,)
    charged: IntArray  # 1: has magnets, (rows,)
    x: Array  # centres, (rows,) [m]
    y: Array
    body: Array  # moments in the components' own frames, (n, 9)
    moment: Array  # and in the world, (rows, 9)
    local: Array  # derivatives of the others' potential at the centres, (rows, 9)
    push: Array  # forces on the centres, (rows, 2) [N]
    stack: IntArray  # levels and segments of pairs yet to be looked at, (depth, 3)
    top: IntArray  # how many those are, (1,)
    pair: IntArray  # casings to be summed one by one, (batch, 2)
    turned: Array  # (4, 10), see `engine.multipoles.act_on_each_other`


@by_pointer
class Nodes(NamedTuple):
    """Scratch space of the magnets' sums and splines."""

    faces: IntArray  # charged faces a casing, (n,)
    along: Array  # nodes of charged faces in their casing's frame, (ranks, n, most a casing) [m]
    across: Array
    x: Array  # and in the world
    y: Array
    q: Array  # their charges [A·m]
    half: Array  # half the height of what they stand for [m]
    body: Array  # moments of ``engine.expansions`` in the casing's frame, (n, 2, terms)
    moment: Array  # and turned into the world's
    expanded: Array  # of the shape `engine.expansions.SCRATCH`
    segments: Segments
    lane_x: Array  # sums of the vectorised loops
    lane_y: Array
    lane_u: Array
    spline: Array  # (4, 6) weights of two splines and their slopes
    row: Array  # (96,) rows of a table, combined


@by_pointer
class Rigid(NamedTuple):
    """What pairs do to each other while all joints between them are at their stops."""

    charge: Array  # for which the rest is valid, (n, 4) [A·m]
    stop: IntArray  # joint k is at its left (1) or right (2) stop, or at none (0); (n,)
    reach: IntArray  # the last component to which each is rigidly joined, (n,)
    code: IntArray  # stops between i and i + 1 + k, to base 3; 0: nothing is kept; (n, spans)
    force: Array  # on i in its own frame [N], torque about its centre [N·m]; (n, spans, 3)
    pose: Pose  # of the two casings for which they are being found
    charges: Array  # (2, 4)
    nodes: Nodes


@by_pointer
class Newton(NamedTuple):
    """Scratch space of `engine.friction_solver`, where the names are explained."""

    factor: Array  # G, (rows, n + 2)
    hessian: Array  # (n + 2, n + 2)
    point: Array  # y, (n + 2,)
    gradient: Array  # (n + 2,)
    step: Array  # (n + 2,)
    scale: Array  # (rows,), as all that follow
    offset: Array  # w where y is 0
    rate: Array  # w
    force: Array  # λ
    projected: Array  # p
    normal: Array  # direction of t
    along: Array  # G step


@by_pointer
class Work(NamedTuple):
    """Scratch space of one run, so that steps allocate nothing.

    Rows are constraints: joint stops, then contacts, then three a component that friction may hold.
    """

    pose: Pose
    nodes: Nodes
    rigid: Rigid
    fx: Array  # (n,) forces and torques on the components
    fy: Array
    torque: Array
    vx: Array  # (n,) velocities and velocity-dependent accelerations of the centres
    vy: Array
    ax: Array
    ay: Array
    art: Array  # (n, 7) articulated inertias
    sweep: Array  # (ROWS, n) of `engine.recursion`
    hold: Array  # (n,) torques that keep locked joints
    open: IntArray  # (n,) zeros: the locks of a chain whose joints all turn
    force: Array  # (n + 2,) generalised, without constraints
    smooth: Array  # (n + 2,) accelerations without constraints
    stage_q: Array  # (n + 2,)
    stage_v: Array
    new_q: Array
    new_v: Array
    slope_q: Array  # (7, n + 2) Runge-Kutta stages
    slope_v: Array
    box_x: Array  # (n + 3,) squares, walls, fixed magnet: centre, axis and half sizes
    box_y: Array
    box_c: Array
    box_s: Array
    box_a: Array
    box_b: Array
    row_count: IntArray  # (4,) stops, stops and contacts, all; contacts just let go
    row_id: IntArray  # (rows, 4)
    jacobian: Array  # (rows, n + 2)
    response: Array  # (rows, n + 2) M⁻¹Jᵀ
    delassus: Array  # (rows, rows)
    bias: Array  # (rows,)
    gap: Array  # (rows,) of contacts, when the step begins [m]
    multiplier: Array  # (rows,)
    passive: IntArray  # (rows,)
    equality: IntArray  # (rows,)
    order: IntArray  # (rows,)
    mark: IntArray  # (n,)
    braking: Array  # (n,) when components may stop [s]
    slow: IntArray  # (n,) 1: friction is not among the smooth forces, but solved for
    trial: Array  # (rows,)
    update: Array  # (rows,)
    cholesky: Array  # (rows, rows)
    newton: Newton
