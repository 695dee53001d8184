"""The settings of a chain on a web page, and the kernel that sets up the chain from them.

Nothing is allocated here: `magfold_env.browser.memory` allocates chains of n components in advance,
and they already contain the scene's other groups, such as the casing. This module compiles the
rules of `scene.numbers`. It repeats the work of `simulation.pack` without its arrays, and tests
compare every bit.
"""

import math
from typing import Annotated, NamedTuple

from magfold_env.browser.view import BEFORE, IMPULSE, View
from magfold_env.engine import indices as ix
from magfold_env.engine.chain import tube
from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import boxes
from magfold_env.engine.elementary import sincos, total
from magfold_env.engine.state import Array, IntArray, Magnets, Model, PerBody, State, Work
from magfold_env.scene import numbers
from magfold_env.simulation import pack

MOST_OBSTACLES = 8

MOUNTS = ("free", "pinned", "tube")
FREE, PINNED, TUBE = range(3)
# `Settings.choice`: the mount, whether the feed is forward, whether magnets are loaded at the
# mouth, and the number of obstacles.
MOUNT, FORWARD, AT_MOUTH, OBSTACLES = range(4)
# `Settings.number`: gravity normal to the plane, entries of the scene and of its solver, and the
# time between two frames. FORCE_LIMIT is infinite if there is no limit, and INTERVAL is 0 if no
# frames are recorded.
NORMAL, DURATION, FORCE_LIMIT, BORE, WALL, INTERVAL, TOLERANCE, MAX_STEPS = range(8)
# `Settings.obstacles`: centre [m], lengths along and across the heading [m], heading [rad].
X, Y, LENGTH, WIDTH, HEADING = range(5)

_DIGITS = 1e15  # digits of an obstacle's axis
_ROUND = 1.5 * 2.0**52  # adding and then subtracting it rounds to a whole number
_TURNED = tuple(pack.TURNED)
_face_charge, _typical_rate = inlined(numbers.face_charge), inlined(numbers.typical_rate)
_square_inertia, _stop_overshoot = inlined(numbers.square_inertia), inlined(pack.stop_overshoot)
_friction_limit, _rectangle = inlined(numbers.friction_limit), inlined(numbers.rectangle)


@by_pointer
class Numbers(NamedTuple):
    """Writable views of a chain's numbers in memory; they change only between calls of kernels."""

    magnetic: IntArray  # one word each, as in `Model`
    frictional: IntArray
    tube: IntArray
    at_mouth: IntArray
    pinned: IntArray
    force_limit: Array
    typical_rate: Array
    fastest_rate: Array
    tolerance: Array
    max_steps: IntArray
    duration: Array
    side: Array
    rounding: Array
    friction_radius: Array
    stop_overshoot: Array
    interval: Array  # of `Record`
    obstacles: IntArray  # address and shape of the model's obstacles, (3,)
    boxes: IntArray  # addresses and lengths of the scratch space's boxes, (12,)
    probe: IntArray  # the same for the probe's scratch space


@by_pointer
class Settings(NamedTuple):
    """A chain of n components, component 1 first; see `magfold_env.scene`.

    Masses and feed speeds are written directly to the arrays that kernels read.
    """

    pole: Annotated[IntArray, "n", 4]  # outward poles of the faces, 1 N, −1 S, 0 no magnet
    remanence: Annotated[Array, "n", 4]  # [T]
    face: Array  # widths and heights of the pole faces, (2, 4) [m]
    friction: PerBody  # in the engine's order, like masses, speeds and the start
    start: Annotated[Array, 1, "n + 1"]  # joint angles [rad], or in a tube the hinges' offsets [m]
    obstacles: Annotated[Array, MOST_OBSTACLES, 5]
    choice: Annotated[IntArray, 4]
    number: Annotated[Array, 8]
    numbers: Numbers
    headings: Annotated[Array, 1, "n"]  # scratch: headings of a chain in the tube
    depth: Annotated[Array, 1]  # scratch: length of that chain


@inlined
def is_flipped(settings: Settings) -> bool:
    """Return whether the engine counts from component n, the end that a forward feed holds."""
    return settings.choice[MOUNT] == TUBE and settings.choice[FORWARD] == 1


@kernel
def resize(
    kit: pack.Sizing, magnets: Magnets, rounding: float, settings: Settings, model: Model
) -> None:
    """Fill in what depends on the sizes of casings and magnets, before `set_up` reads it."""
    # The four magnets are equal, and opposite outer faces come nearest.
    words, touching = settings.numbers, magnets.graded[0, 0] != 0
    side, width, inset = kit.size[pack.SIDE, 0], kit.size[pack.WIDTH, 0], kit.size[pack.INSET, 0]
    for f in range(4):
        settings.face[0, f], settings.face[1, f] = kit.size[pack.WIDTH, f], kit.size[pack.HEIGHT, f]
    words.side[0], words.rounding[0] = side, rounding
    words.friction_radius[0] = numbers.FRICTION_ARM * side
    words.stop_overshoot[0] = _stop_overshoot(side, inset, width, touching)
    for k in range(model.n):
        model.bodies.length[k] = side * math.sqrt(2.0)
        model.bodies.reach[k] = model.bodies.length[k] / 2.0


@kernel
def set_up(settings: Settings, model: Model, state: State, view: View) -> None:
    """Set up a chain from its settings, at the start of its run.

    State and scratch space must be as allocated: zero except for what never changes.
    """
    # Words written here are not read back, because the compiler may assume that they are constant.
    tube = settings.choice[MOUNT] == TUBE
    number, words = settings.number, settings.numbers
    at_mouth = tube and settings.choice[AT_MOUTH] == 1
    largest, any_charge = put_charges(settings, model.charge)
    words.magnetic[0] = int(at_mouth or any_charge)
    words.at_mouth[0] = int(at_mouth)
    words.tube[0] = int(tube)
    words.pinned[0] = int(settings.choice[MOUNT] == PINNED)
    words.force_limit[0] = number[FORCE_LIMIT]
    words.duration[0] = number[DURATION]
    words.tolerance[0] = number[TOLERANCE]
    words.max_steps[0] = int(number[MAX_STEPS])
    words.interval[0] = number[INTERVAL]
    mean, least, rubs = put_masses(settings, model)
    words.frictional[0] = int(rubs)
    words.typical_rate[0] = typical_rate(settings, model, largest, mean)
    fastest_rate = typical_rate(settings, model, largest, least)
    words.fastest_rate[0] = fastest_rate
    put_obstacles(settings, model)
    begin(settings, model, state, fastest_rate)
    put_start(settings, model, state)
    view.feed[BEFORE], view.feed[IMPULSE] = -number[INTERVAL], 0.0


@inlined
def face_charge(settings: Settings, i: int, f: int) -> float:
    """Return the charge of a pole face that has a magnet [A·m]."""
    return _face_charge(settings.remanence[i, f], settings.face[0, f], settings.face[1, f])


@kernel
def put_charges(settings: Settings, charge: Array) -> tuple[float, bool]:
    """Fill in the signed charges of the pole faces in the engine's order, (n, 4) [A·m].

    Returns the largest charge that any face could have, and whether any face has one.
    """
    n, flip = charge.shape[0], is_flipped(settings)
    largest, any_charge = 0.0, False
    for i in range(n):
        for f in range(4):
            strength = face_charge(settings, i, f)
            largest = max(largest, strength)
            any_charge = any_charge or settings.pole[i, f] != 0
            # Seen from the chain's other end, a casing is turned by 180°.
            k, g = (n - 1 - i, _TURNED[f]) if flip else (i, f)
            charge[k, g] = float(settings.pole[i, f]) * strength
    return largest, any_charge


@kernel
def put_masses(settings: Settings, model: Model) -> tuple[float, float, bool]:
    """Fill in moments of inertia and friction limits.

    Returns the mean and the least mass [kg], and whether there is friction.
    """
    mass, friction, normal = model.bodies.mass, settings.friction, settings.number[NORMAL]
    least, rubs = math.inf, False
    for k in range(model.n):
        least = min(least, mass[k])
        model.bodies.inertia[k] = _square_inertia(mass[k], model.side)
        rubs = rubs or (friction[k] > 0.0 and normal > 0.0)
        model.friction_limit[k] = _friction_limit(friction[k], normal, mass[k])
    return total(mass) / mass.size, least, rubs


@inlined
def typical_rate(settings: Settings, model: Model, charge: float, mass: float) -> float:
    """Return the typical rate of one component under the strongest force [rad/s]."""
    widest = 0.0
    for f in range(4):
        widest = max(widest, settings.face[0, f])
    return _typical_rate(
        charge, widest, 0.0, mass, model.gravity_x, model.gravity_y, model.bodies.length[0]
    )


@kernel
def put_obstacles(settings: Settings, model: Model) -> None:
    """Fill in the solids: the walls of the tube, if there is one, then the obstacles."""
    words, number = settings.numbers, settings.number
    count = 0
    if settings.choice[MOUNT] == TUBE:
        # Walls longer than the chain, so that nothing reaches their inner end.
        length = 2.0 * model.n * model.bodies.length[0]
        middle = 0.5 * (number[BORE] + number[WALL])
        for y in (middle, -middle):
            put_rectangle(model, count, -0.5 * length, y, length, number[WALL], 0.0)
            count += 1
    for k in range(settings.choice[OBSTACLES]):
        each = settings.obstacles[k]
        put_rectangle(model, count, each[X], each[Y], each[LENGTH], each[WIDTH], each[HEADING])
        count += 1
    words.obstacles[1] = count
    for k in range(1, words.boxes.size, 2):
        words.boxes[k] = words.probe[k] = model.n + count


@kernel
def put_rectangle(
    model: Model, row: int, x: float, y: float, along: float, across: float, heading: float
) -> None:
    """Fill in a row of the obstacles."""
    s, c = sincos(heading)
    # Rounded like a scene's, so that the last bits of sines do not matter.
    filled = _rectangle(x, y, along, across, rounded(c), rounded(s), model.rounding)
    for k in range(len(filled)):
        model.obstacles[row, k] = filled[k]


@inlined
def rounded(x: float) -> float:
    """Round to 15 digits after the point, for |x| ≤ 1."""
    return (x * _DIGITS + _ROUND - _ROUND) / _DIGITS


@kernel
def begin(settings: Settings, model: Model, state: State, fastest_rate: float) -> None:
    """Fill in the initial state of every run; see `engine.workspace.new_state`."""
    tube = settings.choice[MOUNT] == TUBE
    state.clock[ix.BRAKE] = state.clock[ix.BUMP] = math.inf
    state.clock[ix.STEP] = 0.1 / fastest_rate
    state.clock[ix.END] = math.inf if tube else settings.number[DURATION]
    state.counter[ix.KEEP] = -1
    state.counter[ix.N_HELD] = model.n if tube else 0
    state.counter[ix.FRESH] = 1
    for i in range(model.n):
        for f in range(4):
            state.waiting[i, f] = model.charge[i, f]
            if tube and settings.choice[AT_MOUTH] == 1:
                # A component's magnets act as soon as its leading hinge reaches the mouth.
                model.charge[i, f] = 0.0


@kernel
def put_start(settings: Settings, model: Model, state: State) -> None:
    """Set the chain's initial pose from its joint angles or its hinges' offsets."""
    n, start = model.n, settings.start
    if settings.choice[MOUNT] != TUBE:
        for k in range(1, n):
            before = state.q[k - 1] if k > 1 else -0.0
            state.q[k] = before + start[0, k - 1]
        return
    tube.lie_in_tube(start, model.bodies.length, settings.headings, settings.depth)
    for k in range(n):
        state.q[k] = settings.headings[0, k]
    state.feed[ix.DEPTH] = settings.depth[0]
    state.q[n + 1] = start[0, n]


@kernel
def choose(settings: Settings, state: State, k: int) -> None:
    """Set the magnets of component k, the next to leave; the run pauses when it has left."""
    n, held = state.speed.size, state.counter[ix.N_HELD]
    i, turned = (n - 1 - k, True) if is_flipped(settings) else (k, False)
    for f in range(4):
        charge = float(settings.pole[k, f]) * face_charge(settings, k, f)
        state.waiting[i, _TURNED[f] if turned else f] = charge
    state.counter[ix.KEEP] = held - 1 if held > 1 else -1


@kernel
def draw(settings: Settings, model: Model, spread: float) -> None:
    """Scale uniform numbers from [−1, 1) in ``start`` to the start that `Scene.draw` would draw.

    ``spread`` is the scene's spread of start angles [rad].
    """
    n, scale = model.n, spread
    if settings.choice[MOUNT] == TUBE:
        diagonal = model.bodies.length[0]
        play = max(0.5 * (settings.number[BORE] - diagonal), 0.0)
        scale = min(play, 0.25 * spread * diagonal)
    for k in range(n + 1):
        settings.start[0, k] = scale * settings.start[0, k] + 0.0  # no −0


@kernel
def overlap(settings: Settings, model: Model, state: State, work: Work) -> int:
    """Return a code for the first overlap in the chain's initial pose; 0 if there is none.

    The code is 100 i + j for components i and j, and −i for component i and an obstacle. Components
    are numbered from 1.
    """
    if settings.choice[MOUNT] == TUBE:
        return 0
    tube.place_all(0, model, state.q, work.pose)
    boxes.place_boxes(0, model, work.pose, work)
    i, j = boxes.first_overlap(model, work)
    if i < 0:
        return 0
    return 100 * (i + 1) + j + 1 if j < model.n else -(i + 1)
