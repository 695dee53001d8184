"""Kinds of concrete scenes: ordinary scenes, and one kind per extreme."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from magfold_bench.laws.random_scenes import designed_sequence
from magfold_env.scene import (
    Casing,
    Feed,
    Gravity,
    Rectangle,
    Scene,
    Solver,
    chamber,
    channel,
    funnel,
)
from magfold_env.shapes import centres, headings, overlaps

T = TypeVar("T")

DURATION = 0.5  # [s] after the last release; most chains are at rest after 0.3 s
MAX_STEPS = 3000  # a fold of six components takes about 150
LONG_STEPS = 60
LONGEST, LONGEST_IN_CONTACT = 1000, 500
MARATHON_STEPS = 10_000_000
STOP = 0.5 * math.pi
NARROWEST, WIDEST = (times * Casing().diagonal for times in (1.001, 2.0))  # bores [m]

# There are few geometries, because the splines of each one are computed once and kept.
GAPS = (0.0, 5e-6, 5e-5)  # insets [m]; the magnets of touching faces are twice as far apart
DEVICES: tuple[Mapping[str, Any], ...] = (
    {},
    {"accuracy": 1e-5},
    {"model": "points"},
    {"model": "points", "nodes": 7, "inset": 5e-4},
    {"width": (4e-3, 6e-3, 5e-3, 4e-3), "height": (6e-3, 6e-3, 8e-3, 6e-3)},
)

Changes = dict[str, Any]


class Source:
    """Draws numbers and choices uniformly from a random stream, which has the key as its seed."""

    def __init__(self, *key: int) -> None:
        self._rng = np.random.default_rng(key)

    def integer(self, low: int, high: int) -> int:
        """Return an integer from ``low`` to ``high`` inclusive."""
        return int(self._rng.integers(low, high + 1))

    def number(self, low: float, high: float) -> float:
        """Return a number from ``low`` to ``high``."""
        return float(self._rng.uniform(low, high))

    def pick(self, options: Sequence[T]) -> T:
        """Return one of the options."""
        return options[self.integer(0, len(options) - 1)]


def logarithmic(source: Source, low: float, high: float) -> float:
    """Draw a positive number log-uniformly."""
    drawn = math.exp(source.number(math.log(low), math.log(high)))
    return min(max(drawn, low), high)


def numbers(source: Source, low: float, high: float, count: int) -> tuple[float, ...]:
    """Draw ``count`` values uniformly."""
    return tuple(source.number(low, high) for _ in range(count))


def changed(draw: Callable[[Source, int], Changes]) -> Callable[[Source], Scene]:
    """Return a function that draws a scene of few components and applies changes from ``draw``."""

    def make(source: Source) -> Scene:
        n = few(source)
        return scene(source, n, **draw(source, n))

    return make


class Kind(NamedTuple):
    """A kind of scene."""

    draws: str
    """The extreme property of these scenes."""
    make: Callable[[Source], Scene]
    share: int
    """Share of the cases in per cent; kinds with a share of 0 are tried only on request."""


def ordinary(source: Source) -> Scene:
    """Draw an ordinary scene."""
    return scene(source, few(source))


def few(source: Source) -> int:
    """Draw a small number of components."""
    return source.integer(1, source.pick((3, 5, 7, 12)))


def scene(source: Source, n: int, **changes: Any) -> Scene:
    """Return a scene of ``n`` components that is ordinary apart from the changes."""
    made: Changes = {
        "friction": source.pick((0.0, source.number(0.0, 1.0), 0.35)),
        "duration": DURATION,
        **changes,
    }
    made["solver"] = {"max_steps": MAX_STEPS, **made.get("solver", {})}
    if "sequence" not in made:
        made["sequence"] = sequence(source, n)
    if "mount" not in made:
        made |= mounted(source)
    if made["mount"] == "tube":
        bore = source.pick((None, WIDEST, logarithmic(source, NARROWEST, WIDEST)))
        made["feed"] = {"bore": bore, **made.get("feed", {})}
    if "start_angles" not in made and made["mount"] == "tube":
        made["start_offsets"] = held(source, Scene(**made))
    elif "start_angles" not in made:
        wide = source.pick((0.03, made.get("start_angle_spread", 0.5)))
        made["start_angles"] = numbers(source, -wide, wide, n - 1)
    return Scene(**made)


def held(source: Source, scene: Scene) -> tuple[float, ...]:
    """Draw the offsets of hinges in the tube, like `Scene.draw` or over the whole bore."""
    wide = min(source.pick((scene.start_offset_spread, scene.play)), 0.5 * scene.casing.side)
    return numbers(source, -wide, wide, scene.n + 1)


def sequence(source: Source, n: int) -> tuple[str, ...]:
    """Draw a random sequence, or one that is designed to fold."""
    if n > 2 and source.integer(0, 2) == 0:
        return designed_sequence(np.random.default_rng(source.integer(0, 2**31)), n)
    letters = source.pick(("NS", "NS", "NS-"))
    return tuple("".join(source.pick(letters) for _ in range(4)) for _ in range(n))


def mounted(source: Source, slowest: float = 0.01, fastest: float = 0.6) -> Changes:
    """Draw a mount and a feed."""
    mount = source.pick(("free", "pinned", "tube"))
    if mount != "tube":
        return {"mount": mount}
    return {"mount": mount, "feed": fed(source, logarithmic(source, slowest, fastest))}


def fed(source: Source, speed: float | tuple[float, ...]) -> Changes:
    """Draw a feed with the given speed [m/s]."""
    return {
        "direction": source.pick(("forward", "backward")),
        "loading": source.pick(("preloaded", "at_mouth")),
        "speed": speed,
    }


def uneven(source: Source, n: int) -> Changes:
    """Draw masses that differ by factors of up to a million, and unrelated inertias."""
    mass = tuple(logarithmic(source, 1e-6, 1.0) for _ in range(n))
    even = np.array(mass) * 0.0125**2 / 6.0
    factor = [logarithmic(source, 0.1, 10.0) for _ in range(n)]
    return {"casing": {"mass": mass, "inertia": source.pick((None, tuple(even * factor)))}}


def rubbing(source: Source, n: int) -> Changes:
    """Draw friction of 0, 10 or any magnitude in between, sometimes for each component."""
    each = tuple(logarithmic(source, 1e-4, 10.0) for _ in range(n))
    return {"friction": source.pick((0.0, 10.0, logarithmic(source, 1e-4, 10.0), each))}


def hurried(source: Source, n: int) -> Changes:
    """Draw feed speeds from 0.1 mm/s to 10 m/s, sometimes one for each component."""
    one = logarithmic(source, 1e-4, 10.0)
    each = tuple(logarithmic(source, 1e-4, 10.0) for _ in range(n))
    limit = source.pick((Feed().force_limit, None))
    feed = fed(source, source.pick((one, each))) | {"force_limit": limit}
    return {"mount": "tube", "feed": feed}


def retracted(source: Source, n: int) -> Changes:
    """Draw feeds that go back and forth; some of them jam."""
    count = source.integer(1, 6)
    pace = [logarithmic(source, 0.01, 0.6) for _ in range(count)]
    if source.integer(0, 1) == 0:
        drawn = [(source.number(0.001, n), speed) for speed in pace]
        # Drop legs that do not move the feed.
        legs = [leg for k, leg in enumerate(drawn) if k == 0 or leg[0] != drawn[k - 1][0]]
        schedule: Changes = {"advance": legs}
    else:
        schedule = {"time": [(logarithmic(source, 0.01, 1.0), pace[0])]}
        schedule["time"] += [
            (logarithmic(source, 0.01, 1.0), source.pick((0.0, -speed, speed)))
            for speed in pace[1:]
        ]
    limit = source.pick((Feed().force_limit, None, logarithmic(source, 0.05, 100.0)))
    feed = fed(source, 0.05) | {"schedule": schedule, "force_limit": limit}
    return {"mount": "tube", "feed": feed}


def crowded(source: Source, n: int) -> Changes:
    """Draw obstacles: single rectangles, channels, chambers and funnels."""
    pitch = Casing().diagonal
    tube = source.integer(0, 2) > 0
    mount = "tube" if tube else source.pick(("free", "pinned"))
    beside = 0.5 * pitch + 1e-4
    bore = pitch * source.pick((1.05, source.number(1.001, 1.5)))
    count = source.integer(0, 4)
    posts = [
        Rectangle(
            position=(
                source.number(1.5, n + 2.0) * pitch,
                side * (beside + source.number(0.0, 0.05)),
            ),
            size=(source.number(1e-3, 0.03), logarithmic(source, 2e-4, 0.02)),
            heading=source.pick((0.0, source.number(-0.1, 0.1))),
        )
        for side in (source.pick((-1.0, 1.0)) for _ in range(count))
    ]
    # In front of a wide bore, one casing's length must be free.
    widest = max(beside, 0.5 * bore)
    obstacles = [
        post
        for post in posts
        if abs(post.corners[:, 1]).min() > (beside if post.corners[:, 0].min() > pitch else widest)
    ]
    wide = 2.0 * beside + logarithmic(source, 1e-3, 0.1)
    start, end = (1.1 * pitch, 0.0), ((n + 1.0) * pitch, 0.0)
    closed = chamber(
        (1.1 * pitch, -0.5 * wide - 0.01),
        (source.number(1.0, n) * pitch + pitch, wide + 0.02),
        wide,
    )
    built: tuple[tuple[Rectangle, ...], ...] = ((), channel(start, end, wide))
    if tube:
        built += (closed, funnel(bore, source.number(0.005, 0.03), source.number(0.1, 1.4)))
    changes: Changes = {"mount": mount, "obstacles": (*obstacles, *source.pick(built))}
    changes["start_angle_spread"] = 0.03
    if tube:
        feed = retracted(source, n)["feed"] if source.integer(0, 1) == 0 else fed(source, 0.1)
        changes["feed"] = feed | {"bore": bore}
    return changes


def tilted(source: Source) -> Scene:
    """Draw floors tilted by up to 90°, with posts and plates at least 0.2 mm thick as obstacles."""
    n = few(source)
    tilt = source.pick((0.0, 0.5 * math.pi, source.number(0.0, 0.5 * math.pi)))
    down = source.number(-math.pi, math.pi)
    pull = Gravity().normal * math.sin(tilt)
    changes: Changes = {
        "gravity": {
            "normal": Gravity().normal * math.cos(tilt),
            "in_plane": (pull * math.cos(down), pull * math.sin(down)),
        },
        "friction": source.pick((0.0, 0.2, source.number(0.0, 0.6))),
        **mounted(source),
    }
    if source.integer(0, 2) == 0:
        changes["magnets"] = None
    alone = scene(source, n, **changes)
    built = source.pick(((), channel_around(source, n), chamber_around(source, n)))
    solids = [*built, *(post(source, n) for _ in range(source.integer(1, 8)))]
    return alone.replace(obstacles=[each for each in solids if leaves_room(each, alone)])


def post(source: Source, n: int) -> Rectangle:
    """Draw a post or a plate somewhere around a chain."""
    pitch = Casing().diagonal
    thick = logarithmic(source, 2e-4, 0.01)
    long = source.pick((thick, source.number(1.0, 4.0) * pitch))
    around = (source.number(-2.0, n + 3.0) * pitch, source.number(-5.0, 5.0) * pitch)
    return Rectangle(position=around, size=(long, thick), heading=source.number(-math.pi, math.pi))


def channel_around(source: Source, n: int) -> tuple[Rectangle, ...]:
    """Draw a channel along the straight chain."""
    pitch, wall = Casing().diagonal, logarithmic(source, 2e-4, 0.01)
    wide = pitch * source.number(1.01, 3.0)
    return channel((1.1 * pitch, 0.0), ((n + source.number(1.0, 4.0)) * pitch, 0.0), wide, wall)


def chamber_around(source: Source, n: int) -> tuple[Rectangle, ...]:
    """Draw a chamber in front of a tube's mouth."""
    pitch, wall = Casing().diagonal, logarithmic(source, 2e-4, 0.01)
    opening = pitch * source.number(1.01, 2.0)
    high = opening + 2.0 * source.number(0.1, 3.0) * pitch
    corner = (1.1 * pitch + wall, -0.5 * high)
    return chamber(corner, (source.number(1.0, n + 1.0) * pitch, high), opening, wall)


def leaves_room(solid: Rectangle, alone: Scene) -> bool:
    """Return whether a solid is clear of a chain's start and of a tube's bore."""
    casing = alone.casing
    if alone.mount == "tube":
        half = 0.5 * alone.bore + alone.feed.wall
        # Scenes refuse solids in line with the bore, however far behind the tube they are.
        behind = min(-alone.n * casing.diagonal, float(solid.corners[:, 0].min()))
        deep = behind - casing.diagonal
        bore = np.array(
            [(deep, -half), (casing.diagonal, -half), (casing.diagonal, half), (deep, half)]
        )
        return not solid.overlaps(bore)
    assert alone.start_angles is not None
    turns = headings(alone.start_angles)
    places, size = centres(turns, casing.side), (casing.side, casing.side)
    squares = (
        Rectangle(position=tuple(centre), size=size, heading=turn + 0.25 * math.pi)
        for centre, turn in zip(places, turns, strict=True)
    )
    return not any(solid.overlaps(square.corners) for square in squares)


def shaken(source: Source, n: int) -> Changes:
    """Draw trains of bumps, from weak and frequent bumps to rare ones that throw a chain around."""
    bumps = {
        "rate": logarithmic(source, 0.5, 1e3),
        "speed": logarithmic(source, 1e-5, 1.0),
        "seed": source.integer(1, 2**31 - 2),
    }
    return {"bumps": bumps}


def strong(source: Source, n: int) -> Changes:
    """Draw magnets of 0 to 1.5 T in several shapes, sometimes of unequal strengths, or none."""
    if source.integer(0, 9) == 0:
        return {"magnets": None}
    one = logarithmic(source, 1e-6, 1.5)
    rows = tuple(tuple(logarithmic(source, 1e-6, 1.5) for _ in range(4)) for _ in range(n))
    strength = source.pick((1.5, one, rows))
    return {"magnets": {**source.pick(DEVICES), "remanence": strength}}


def close(source: Source, n: int) -> Changes:
    """Draw magnets at the faces or just below them, which touch or come as close as 10 µm."""
    points = {"model": "points", "inset": logarithmic(source, 5e-6, 5e-4)}
    strips = {"inset": source.pick(GAPS)}
    summed = {"inset": logarithmic(source, 5e-6, 5e-4), "nodes": source.integer(1, 8)}
    magnets = source.pick((points, strips, summed))
    return {"magnets": {**magnets, "remanence": logarithmic(source, 0.01, 1.5)}}


def rounded(source: Source, n: int) -> Changes:
    """Draw magnets at the faces, or just below them, of casings with all kinds of corners."""
    return close(source, n) | {"casing": {"corner_radius": logarithmic(source, 1e-7, 1e-3)}}


def at_stops(source: Source, n: int) -> Changes:
    """Draw starts at the stops, where squares touch; some overlap and are refused."""
    at = tuple(source.pick((-STOP, STOP, 0.0, source.number(-STOP, STOP))) for _ in range(n - 1))
    return {"start_angles": at, "mount": source.pick(("free", "pinned"))}


def overlapping(source: Source) -> Scene:
    """Draw starts with overlapping squares, which are refused."""
    n = source.integer(5, 9)
    turns = "".join(source.pick("LSR") for _ in range(n - 1))
    if not overlaps(turns):
        turns = source.pick("LR") * (n - 1)
    off = numbers(source, 0.0, 0.02, n - 1)
    at = [STOP * "RSL".index(t) - STOP for t in turns]
    angles = tuple(angle - math.copysign(o, angle) for angle, o in zip(at, off, strict=True))
    return scene(source, n, mount=source.pick(("free", "pinned")), start_angles=angles)


def symmetric(source: Source, n: int) -> Changes:
    """Draw chains that are their own mirror image, exactly straight or nearly straight."""
    halves = [(source.pick("NS-"), source.pick("NS-")) for _ in range(n)]
    off = source.pick((0.0, 0.0, 1e-15, 1e-9))
    return {
        "sequence": tuple(front + back + back + front for front, back in halves),
        "start_angles": tuple(off * source.pick((-1.0, 1.0)) for _ in range(n - 1)),
    }


def tolerances(source: Source) -> Scene:
    """Draw tolerances from 1e-1 to 1e-12 rad."""
    solver = {"tolerance": logarithmic(source, 1e-12, 1e-1)}
    return scene(source, source.integer(1, 6), solver=solver)


def outside(source: Source, n: int) -> Changes:
    """Draw fields, in-plane gravity, and fixed magnets beside the straight chain."""
    pull = source.pick(((0.0, 0.0), numbers(source, -20.0, 20.0, 2)))
    size = {name: source.number(0.005, 0.03) for name in ("width", "height", "thickness")}
    beside = source.pick((-1.0, 1.0)) * (0.04 + 0.3 * 0.0177 * n + source.number(0.0, 0.1))
    magnet = {
        "position": (source.number(0.0, 0.0177 * n), beside),
        "heading": source.number(-math.pi, math.pi),
        **size,
    }
    even = source.pick(((0.0, 0.0), numbers(source, -0.1, 0.1, 2)))
    return {
        "field": {"uniform": even, "magnet": source.pick((None, magnet))},
        "gravity": {"in_plane": pull},
        "start_angle_spread": 0.03,
    }


def paper(source: Source) -> Scene:
    """Draw scenes for the paper's solver, with time steps of up to 20 ms."""
    solver = {"method": "paper", "time_step": logarithmic(source, 1e-5, 0.02)}
    return scene(source, few(source), mount="pinned", solver=solver)


def long(source: Source) -> Scene:
    """Draw chains of up to 1,000 components, which the work limit stops."""
    n = round(logarithmic(source, 13, LONGEST))
    free = {"contact": False, "friction": 0.0} if n > LONGEST_IN_CONTACT else {}
    letters = tuple("".join(source.pick("NS") for _ in range(4)) for _ in range(n))
    return scene(source, n, sequence=letters, solver={"max_steps": LONG_STEPS}, **free)


def mixed(source: Source, n: int) -> Changes:
    """Draw all extremes at once."""
    changes = uneven(source, n) | rubbing(source, n)
    changes |= source.pick(({}, outside(source, n)))
    changes |= source.pick((strong(source, n), close(source, n)))
    changes["solver"] = {"tolerance": logarithmic(source, 1e-8, 1e-2)}
    return changes | mounted(source, 1e-3, 10.0)


def marathon(source: Source) -> Scene:
    """Draw a pendulum that swings for ten million steps."""
    n = source.integer(1, 3)
    return Scene(
        sequence=("NNNN",) * n,
        magnets=None,
        mount="pinned",
        friction=0.0,
        gravity=Gravity(in_plane=(0.0, -9.8)),
        contact=False,
        start_angles=numbers(source, -0.5, 0.5, n - 1),
        duration=1e9,
        solver=Solver(tolerance=logarithmic(source, 1e-9, 1e-4), max_steps=MARATHON_STEPS),
    )


KINDS: dict[str, Kind] = {
    "ordinary": Kind("what users simulate, 1 to 12 components", ordinary, 11),
    "masses": Kind("masses a million times apart", changed(uneven), 6),
    "friction": Kind("friction 0, 10 and all orders between", changed(rubbing), 6),
    "feed": Kind("feed of 0.1 mm/s to 10 m/s, some without force limit", changed(hurried), 6),
    "retraction": Kind("feeds that go back and forth", changed(retracted), 8),
    "obstacles": Kind("rectangles, channels, chambers and funnels", changed(crowded), 6),
    "tilted": Kind("tilted floors, posts of at least 0.2 mm", tilted, 6),
    "bumps": Kind("bumps of 0.01 mm/s to 1 m/s", changed(shaken), 5),
    "remanence": Kind("0 to 1.5 T, magnet by magnet", changed(strong), 6),
    "gaps": Kind("magnets that touch or nearly touch, all kinds of corners", changed(rounded), 6),
    "stops": Kind("starts at the stops", changed(at_stops), 6),
    "overlapping": Kind("overlapping starts", overlapping, 3),
    "straight": Kind("exactly straight, symmetric chains", changed(symmetric), 5),
    "tolerances": Kind("tolerances of 1e-1 to 1e-12 rad", tolerances, 5),
    "fields": Kind("fields, fixed magnets, in-plane gravity", changed(outside), 5),
    "paper": Kind("the paper's solver, steps up to 20 ms", paper, 3),
    "long": Kind("13 to 1,000 components, 60 steps", long, 1),
    "mixed": Kind("all of these at once", changed(mixed), 6),
    "marathon": Kind("ten million steps of a pendulum", marathon, 0),
}
