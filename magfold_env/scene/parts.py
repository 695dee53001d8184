"""The groups of a scene: small frozen models, one sentence a field, SI units and radians."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field as Limits
from pydantic import Strict, model_validator

from magfold_env.scene.base import (
    Each,
    Fraction,
    Metres,
    NonNegative,
    Number,
    Part,
    Positive,
    Remanence,
    Speed,
    Velocity,
)
from magfold_env.scene.errors import Problem, refuse
from magfold_env.scene.magnets import Array
from magfold_env.scene.numbers import face_charge
from magfold_env.scene.obstacles import Rectangle

MOST_STEPS = 10**12
"""Of steps, the largest number that may be allowed; no run takes as many."""

STEEPEST = 45.0
"""Largest tilt of a floor that is drawn [degrees]."""

Steps = Annotated[int, Strict(), Limits(ge=1, le=MOST_STEPS)]


class Casing(Part):
    """The square body of a component, hinged to its neighbours at opposite corners."""

    side: Metres = 0.0125
    """Edge length [m]."""
    mass: Each[Positive] = 0.0037
    """Mass of a component with its magnets [kg]; one number, or one a component."""
    inertia: Each[Positive] | None = None
    """Moment of inertia about the centre [kg m²]; None takes mass·side²/6, an even square."""
    corner_radius: Positive = 1e-5
    """Rounding of the corners where they meet other casings and the tube [m]."""
    hinge: Literal["corner"] = "corner"
    """Where neighbours are hinged; opposite corners is the only geometry there is."""

    @property
    def diagonal(self) -> float:
        """Distance between a component's two hinges [m]."""
        return self.side * math.sqrt(2.0)


class Schedule(Part):
    """How a feed goes, leg by leg, back and forth."""

    time: tuple[tuple[Positive, Velocity], ...] | None = None
    """Legs of a duration [s] at a speed [m/s], which pulls back where it is negative."""
    advance: tuple[tuple[NonNegative, Speed], ...] | None = None
    """Legs to how far the feed has gone [diagonals], each at a speed [m/s]."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        problems: list[Problem] = []
        if (self.time is None) == (self.advance is None):
            allowed = "must be given, or time, but not both"
            problems.append(Problem("advance", self.advance, allowed))
        if self.time is not None and not any(speed > 0.0 for _, speed in self.time):
            allowed = "must have a leg with a speed above 0; the feed begins at its stop"
            problems.append(Problem("time", self.time, allowed))
        if self.advance is not None:
            goals = (0.0, *(goal for goal, _ in self.advance))
            if len(goals) == 1 or any(a == b for a, b in pairwise(goals)):
                allowed = "every leg must lead elsewhere; the feed begins at an advance of 0"
                problems.append(Problem("advance", self.advance, allowed))
        refuse(problems)
        return self

    @property
    def speeds(self) -> Array:
        """How fast its legs are, whichever way [m/s]."""
        return np.array([abs(speed) for _, speed in (self.time or self.advance or ())])

    def scaled(self, factor: float) -> Schedule:
        """Return the schedule with all speeds times a factor."""
        legs = {name: getattr(self, name) for name in ("time", "advance")}
        return Schedule(
            **{
                name: value and tuple((goal, speed * factor) for goal, speed in value)
                for name, value in legs.items()
            }
        )


class Feed(Part):
    """The tube and how the chain is pushed out of it."""

    direction: Literal["forward", "backward"] = "forward"
    """`forward`: component 1 leaves first; `backward`: component n does."""
    speed: Each[Speed] = 0.05
    """Feed speed [m/s]; one number, or the speed each component leaves at, component 1 first."""
    schedule: Schedule | None = None
    """How the feed goes back and forth, in place of its speed; the tube may then keep components
    inside."""
    loading: Literal["preloaded", "at_mouth"] = "preloaded"
    """`at_mouth`: a component has magnets only while its leading hinge is outside the mouth."""
    force_limit: Positive | None = 20.0
    """Force that the drive can push or pull with [N]; beyond it, it slips. None: it slips only if
    the chain cannot move at that speed, or at a force far above any in a moving chain."""
    bore: Positive | None = None
    """Inner width of the tube [m], at least the casing's diagonal; None takes 1.05 of it."""
    wall: Positive = 0.001
    """Thickness of the tube's walls [m]."""


class FixedMagnet(Part):
    """A block magnet that does not move, centred on the plane.

    It acts on the chain's magnets, and casings collide with it where scenes have contact.
    """

    position: tuple[Number, Number]
    """Its centre [m]; the origin is the tube's mouth, else component 1's outer hinge at first."""
    heading: Number = 0.0
    """Direction of its magnetisation, from its south to its north pole [rad]; 0 is along +x."""
    width: Metres
    """Pole face in the plane [m]."""
    height: Metres
    """Pole face normal to the plane [m]."""
    thickness: Metres
    """Distance between its two pole faces, along its heading [m]."""
    remanence: Remanence = 1.2
    """Residual flux density [T]."""

    @property
    def charge(self) -> float:
        """Magnetic charge of its north face [A m]; that of its south face is its negative."""
        return face_charge(self.remanence, self.width, self.height)

    @property
    def outline(self) -> Rectangle:
        """The rectangle that it fills in the plane."""
        size = (self.thickness, self.width)
        return Rectangle(position=self.position, size=size, heading=self.heading)

    @property
    def poles(self) -> Array:
        """Centres of its north and its south face [m], shape (2, 2)."""
        along = 0.5 * self.thickness * self.outline.axis
        return np.array(self.position) + np.array([along, -along])


class Field(Part):
    """An external magnetic field: even everywhere, that of a fixed magnet, or both."""

    uniform: tuple[Number, Number] = (0.0, 0.0)
    """Flux density along x and y [T]; it turns the chain's magnets and does not pull them."""
    magnet: FixedMagnet | None = None
    """A fixed magnet outside the tube."""

    @property
    def any(self) -> bool:
        """Whether there is something that acts."""
        return self.magnet is not None or any(self.uniform)


class Gravity(Part):
    """Gravity: what presses the chain on the floor, and what acts along it."""

    normal: NonNegative = 9.8
    """Acceleration towards the floor [m/s²]; it acts through friction alone."""
    in_plane: tuple[Number, Number] = (0.0, 0.0)
    """Acceleration along x and y [m/s²]."""


class Bumps(Part):
    """A train of bumps, as of a shaken table.

    Each changes the velocity of all components outside the tube at once, in a direction drawn
    evenly from all, as far as hinges and stops let it. The times between bumps are drawn evenly
    from 0 to twice their mean.
    """

    rate: Positive
    """Mean number of bumps a second [1/s]."""
    speed: Speed
    """By how much each changes velocities [m/s]."""
    duration: Positive = 1.0
    """How long bumps go on, from the beginning [s]; a chain that rests meanwhile waits for them."""
    seed: Annotated[int, Strict(), Limits(ge=1, le=2**31 - 2)] | None = None
    """What the train is drawn with; None leaves it to chance."""


class Factors(NamedTuple):
    """What draws multiply the values of a scene by, a row each."""

    friction: Array  # (m,)
    mass: Array  # and inertia, (m, n)
    strength: Array  # of magnets, (m,), or (m, n, 4) where they are drawn one by one
    speed: Array  # of the feed, (m,), or (m, n) where it jitters


class Spreads(Part):
    """Half-widths of the even draws that `Scene.draw` makes, relative but for two; 0: no draw."""

    friction: Fraction = 0.0
    """Of the friction coefficients, one factor a scene."""
    friction_decades: Fraction = 0.0
    """Of its logarithm to base ten; both factors come of one number."""
    mass: Fraction = 0.0
    """Of the masses (and of inertias that are given), one factor a component."""
    remanence: Fraction = 0.0
    """Of the strength of the chain's magnets, one factor a scene."""
    feed_speed: Fraction = 0.0
    """Of the feed speeds, one factor a scene."""
    feed_jitter: Fraction = 0.0
    """Of the speed each component leaves at, one factor a component."""
    magnet: Fraction = 0.0
    """Of the strength of each of the chain's magnets, one factor a magnet."""
    side: Fraction = 0.0
    """Of the casings' side, one factor a scene: all come out of one mould."""
    inset: Fraction = 0.0
    """Of the magnets' inset, one factor a scene."""
    obstacle_width: Fraction = 0.0
    """Of how far obstacles lie from the x axis, one factor a scene: a chamber's width."""
    obstacle_offset: NonNegative = 0.0
    """How far all obstacles are moved along y, once for a scene [m]."""

    tilt: Annotated[float, Strict(), Limits(ge=0, le=STEEPEST)] = 0.0
    """How far the floor tilts [degrees], evenly from 0 to this, once for a scene, in a direction
    drawn evenly from all."""

    def friction_factor(self, unit: Array) -> Array:
        """Return factors of the friction coefficients for numbers drawn evenly from [−1, 1)."""
        # Rounded, so that machines whose powers differ in the last bit draw the same.
        decades = np.round(10.0 ** (self.friction_decades * unit), 12)
        return (1.0 + self.friction * unit) * decades

    @property
    def one_by_one(self) -> bool:
        """Whether feed speeds or magnets are drawn one by one."""
        return max(self.feed_jitter, self.magnet) > 0.0

    def factors(self, n: int, unit: Array) -> Factors:
        """Return factors for chains of n components.

        ``unit`` holds a row of numbers for each, drawn evenly from [−1, 1), in the order of
        `Scene.draw`; those of what is drawn one by one, if it is, come last.
        """
        strength = 1.0 + self.remanence * unit[:, n + 1]
        speed = 1.0 + self.feed_speed * unit[:, n + 2]
        each = unit[:, -5 * n :]
        if self.feed_jitter > 0.0:
            speed = speed[:, None] * (1.0 + self.feed_jitter * each[:, :n])
        if self.magnet > 0.0:
            magnets = 1.0 + self.magnet * each[:, n:].reshape(-1, n, 4)
            strength = strength[:, None, None] * magnets
        friction = self.friction_factor(unit[:, 0])
        return Factors(friction, 1.0 + self.mass * unit[:, 1 : n + 1], strength, speed)

    @property
    def moves_obstacles(self) -> bool:
        """Whether there is something to draw of where obstacles lie."""
        return max(self.obstacle_width, self.obstacle_offset) > 0.0

    def obstacle_places(self, y: Array, unit: Array) -> Array:
        """Return where obstacles lie along y [m], (m, k), for places (k,) and numbers (m, 2)."""
        width = 1.0 + self.obstacle_width * unit[:, :1]
        return width * y + self.obstacle_offset * unit[:, 1:]

    def tilted(self, gravity: Gravity, unit: Array) -> tuple[Array, Array]:
        """Return gravity [m/s²] on tilted floors for numbers (..., 2) drawn evenly from [−1, 1).

        Normal to the plane, (...), and in it, (..., 2). What the tilt takes from the former pulls
        along the floor, on top of what acts in the plane anyway.
        """
        angles = np.stack([math.radians(self.tilt) * unit[..., 0], math.pi * unit[..., 1]])
        # Rounded like the factors of friction.
        sines: Array = np.sin(angles).round(12)
        cosines: Array = np.cos(angles).round(12)
        along = gravity.normal * sines[0] * np.stack([cosines[1], sines[1]])
        return gravity.normal * cosines[0], gravity.in_plane + np.moveaxis(along, 0, -1)

    @property
    def any(self) -> bool:
        """Whether there is something to draw."""
        return any(getattr(self, name) > 0.0 for name in type(self).model_fields)


class Solver(Part):
    """How time is stepped."""

    method: Literal["adaptive", "paper"] = "adaptive"
    """`paper` repeats the paper's fixed steps and snaps; it needs the mount `pinned`."""
    tolerance: Annotated[float, Strict(), Limits(ge=1e-12, le=0.1)] = 1e-4
    """Local error allowed in an angle [rad] (`adaptive`)."""
    time_step: Positive = 1.0 / 1200.0
    """Step [s] (`paper`)."""
    max_steps: Steps = 200_000
    """Work cap: a chain still moving after so many steps is `unsettled`. A step that is tried again
    at a shorter length counts once."""
    max_steps_per_second: Steps = 50_000
    """Work cap: so is one that needs more steps in one second of simulated time."""
