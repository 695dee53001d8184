"""The groups of a scene: frozen models with values in SI units and radians."""

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
    FrozenModel,
    Metres,
    NonNegative,
    Number,
    Place,
    Positive,
    Remanence,
    Size,
    Speed,
    Velocity,
)
from magfold_env.scene.errors import Problem, refuse
from magfold_env.scene.magnets import Array
from magfold_env.scene.numbers import face_charge
from magfold_env.scene.obstacles import Rectangle

MOST_STEPS = 10**12
"""Largest step limit that a scene may set; no run reaches it."""

STEEPEST = 45.0
"""Largest allowed tilt of a floor [degrees]."""

Steps = Annotated[int, Strict(), Limits(ge=1, le=MOST_STEPS)]


class Casing(FrozenModel):
    """The square body of a component, hinged to its neighbours at opposite corners."""

    side: Metres = 0.0125
    """Edge length [m]."""
    mass: Each[Positive] = 0.0037
    """Mass of a component with its magnets [kg]; one number, or one per component."""
    inertia: Each[Positive] | None = None
    """Moment of inertia about the centre [kg m²]; None means a uniform square's, mass·side²/6."""
    corner_radius: Positive = 1e-5
    """Radius of the corners in contacts with other casings, the tube and obstacles [m]."""
    hinge: Literal["corner"] = "corner"
    """Position of the two hinges: at opposite corners, the only choice."""

    @property
    def diagonal(self) -> float:
        """Distance between a component's two hinges [m]."""
        return self.side * math.sqrt(2.0)


class Schedule(FrozenModel):
    """The stages of a feed (legs), each of which moves the chain out of the tube or back."""

    time: tuple[tuple[Positive, Velocity], ...] | None = None
    """Legs as pairs of a duration [s] and a speed [m/s]; a negative speed pulls back, 0 pauses."""
    advance: tuple[tuple[NonNegative, Speed], ...] | None = None
    """Legs as pairs of the feed's position at the end [diagonals] and a speed [m/s]."""

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
        """Absolute speeds of the legs [m/s]."""
        return np.array([abs(speed) for _, speed in (self.time or self.advance or ())])

    def scaled(self, factor: float) -> Schedule:
        """Return the schedule with all speeds multiplied by a factor."""
        legs = {name: getattr(self, name) for name in ("time", "advance")}
        return Schedule(
            **{
                name: value and tuple((goal, speed * factor) for goal, speed in value)
                for name, value in legs.items()
            }
        )


class Feed(FrozenModel):
    """The tube and how the chain is pushed out of it."""

    direction: Literal["forward", "backward"] = "forward"
    """`forward`: component 1 leaves first; `backward`: component n leaves first."""
    speed: Each[Speed] = 0.05
    """Feed speed [m/s]; one number, or the speed at which each component leaves."""
    schedule: Schedule | None = None
    """Feeding in stages (legs), out and back, instead of at `speed`; components may stay inside."""
    loading: Literal["preloaded", "at_mouth"] = "preloaded"
    """`at_mouth`: a component has magnets only while its leading hinge is outside the mouth."""
    force_limit: Positive | None = 20.0
    """Largest force of the drive, pushing or pulling [N]; beyond it, the drive slips. With None,
    the drive slips only if it cannot move the chain."""
    bore: Size | None = None
    """Inner width of the tube [m], at least the casing's diagonal; None means 1.05 diagonals."""
    wall: Size = 0.001
    """Thickness of the tube's walls [m]."""


class FixedMagnet(FrozenModel):
    """A fixed block magnet, centred on the plane.

    It acts on the chain's magnets, and casings collide with it if the scene has `contact`.
    """

    position: tuple[Place, Place]
    """Centre [m]; the origin is the tube's mouth, or component 1's outer hinge at release."""
    heading: Number = 0.0
    """Direction of the magnetisation, from the south to the north pole [rad]; 0 is along +x."""
    width: Metres
    """Width of a pole face, in the plane [m]."""
    height: Metres
    """Height of a pole face, normal to the plane [m]."""
    thickness: Metres
    """Distance between the two pole faces, along the heading [m]."""
    remanence: Remanence = 1.2
    """Residual flux density [T]."""

    @property
    def charge(self) -> float:
        """Magnetic charge of the north face [A m]; the south face has the opposite charge."""
        return face_charge(self.remanence, self.width, self.height)

    @property
    def outline(self) -> Rectangle:
        """The rectangle that the magnet occupies in the plane."""
        size = (self.thickness, self.width)
        return Rectangle(position=self.position, size=size, heading=self.heading)

    @property
    def poles(self) -> Array:
        """Centres of the north and the south face [m], shape (2, 2)."""
        along = 0.5 * self.thickness * self.outline.axis
        return np.array(self.position) + np.array([along, -along])


class Field(FrozenModel):
    """An external magnetic field: a uniform field, that of a fixed magnet, or both."""

    uniform: tuple[Number, Number] = (0.0, 0.0)
    """Flux density along x and y [T]; it turns the magnets but does not pull them."""
    magnet: FixedMagnet | None = None
    """A fixed magnet outside the tube."""

    @property
    def any(self) -> bool:
        """Whether any field acts."""
        return self.magnet is not None or any(self.uniform)


class Gravity(FrozenModel):
    """Gravity: the acceleration towards the floor, and the acceleration along it."""

    normal: NonNegative = 9.8
    """Acceleration towards the floor [m/s²]; it acts only through friction."""
    in_plane: tuple[Number, Number] = (0.0, 0.0)
    """Acceleration along x and y [m/s²]."""


class Bumps(FrozenModel):
    """A train of bumps, as on a shaken table.

    Each bump changes the velocities of all components outside the tube at once, as far as hinges
    and stops allow. The directions of the bumps are uniformly random, and the times between bumps
    are uniform from 0 to twice their mean.
    """

    rate: Positive
    """Mean number of bumps per second [1/s]."""
    speed: Speed
    """Change of velocity in each bump [m/s]."""
    duration: Positive = 1.0
    """Time from the start to the end of the bumps [s]; a chain at rest waits for the next bump."""
    seed: Annotated[int, Strict(), Limits(ge=1, le=2**31 - 2)] | None = None
    """Seed of the bumps; None draws a seed for each release."""


class Factors(NamedTuple):
    """Drawn factors that multiply the values of a scene, one row per draw."""

    friction: Array  # (m,)
    mass: Array  # and inertia, (m, n)
    strength: Array  # of magnets, (m,), or (m, n, 4) where they are drawn one by one
    speed: Array  # of the feed, (m,), or (m, n) where it jitters


class Spreads(FrozenModel):
    """Half-widths of uniform draws, relative unless the field states otherwise; 0 draws nothing."""

    friction: Fraction = 0.0
    """Friction coefficients, one factor for the scene."""
    friction_decades: Fraction = 0.0
    """Logarithm to base ten of another friction factor, from the random number of `friction`."""
    mass: Fraction = 0.0
    """Masses and given inertias, one factor per component."""
    remanence: Fraction = 0.0
    """Strength of the chain's magnets, one factor for the scene."""
    feed_speed: Fraction = 0.0
    """Feed speeds, one factor for the scene."""
    feed_jitter: Fraction = 0.0
    """Speed at which a component leaves the tube, one factor per component."""
    magnet: Fraction = 0.0
    """Strength of a magnet, one factor per magnet."""
    side: Fraction = 0.0
    """Side of the casings, one factor for the scene."""
    inset: Fraction = 0.0
    """Inset of the magnets, one factor for the scene."""
    obstacle_width: Fraction = 0.0
    """Distance of obstacles from the x axis, one factor for the scene."""
    obstacle_offset: NonNegative = 0.0
    """Offset of the obstacles along y, one for all obstacles [m]."""

    tilt: Annotated[float, Strict(), Limits(ge=0, le=STEEPEST)] = 0.0
    """How far the floor tilts [degrees]: uniform from 0 to this value, in a random direction."""

    @property
    def one_by_one(self) -> bool:
        """Whether feed speeds or magnets are drawn one by one."""
        return max(self.feed_jitter, self.magnet) > 0.0

    def factors(self, n: int, unit: Array) -> Factors:
        """Return factors for chains of n components.

        Each row of ``unit`` contains the numbers of one chain, drawn uniformly from [−1, 1) in the
        order of `Scene.draw`. The numbers of individual feed speeds and magnets, if any, are last.
        """
        strength = 1.0 + self.remanence * unit[:, n + 1]
        speed = 1.0 + self.feed_speed * unit[:, n + 2]
        each = unit[:, -5 * n :]
        if self.feed_jitter > 0.0:
            speed = speed[:, None] * (1.0 + self.feed_jitter * each[:, :n])
        if self.magnet > 0.0:
            magnets = 1.0 + self.magnet * each[:, n:].reshape(-1, n, 4)
            strength = strength[:, None, None] * magnets
        # Rounded, because the last bit of a power differs between machines.
        decades = np.round(10.0 ** (self.friction_decades * unit[:, 0]), 12)
        friction = (1.0 + self.friction * unit[:, 0]) * decades
        return Factors(friction, 1.0 + self.mass * unit[:, 1 : n + 1], strength, speed)

    @property
    def moves_obstacles(self) -> bool:
        """Whether the positions of obstacles are drawn."""
        return max(self.obstacle_width, self.obstacle_offset) > 0.0

    def obstacle_places(self, y: Array, unit: Array) -> Array:
        """Return m draws of the y coordinates of k obstacles [m], (m, k); ``unit`` is (m, 2)."""
        width = 1.0 + self.obstacle_width * unit[:, :1]
        return width * y + self.obstacle_offset * unit[:, 1:]

    def tilted(self, gravity: Gravity, unit: Array) -> tuple[Array, Array]:
        """Return gravity on tilted floors [m/s²]: normal to the plane (...), and in it (..., 2).

        ``unit`` (..., 2) contains numbers drawn uniformly from [−1, 1). The part of the normal
        gravity that acts along a tilted floor is added to the gravity in the plane.
        """
        angles = np.stack([math.radians(self.tilt) * unit[..., 0], math.pi * unit[..., 1]])
        # Rounded for the same reason as the factors of friction.
        sines: Array = np.sin(angles).round(12)
        cosines: Array = np.cos(angles).round(12)
        along = gravity.normal * sines[0] * np.stack([cosines[1], sines[1]])
        return gravity.normal * cosines[0], gravity.in_plane + np.moveaxis(along, 0, -1)

    @property
    def any(self) -> bool:
        """Whether anything is drawn."""
        return any(getattr(self, name) > 0.0 for name in type(self).model_fields)


class Solver(FrozenModel):
    """Time stepping."""

    method: Literal["adaptive", "paper"] = "adaptive"
    """`paper` reproduces the paper's fixed steps and snapping joints; it needs `mount: pinned`."""
    tolerance: Annotated[float, Strict(), Limits(ge=1e-12, le=0.1)] = 1e-4
    """Local error allowed in an angle [rad], for `adaptive`."""
    time_step: Positive = 1.0 / 1200.0
    """Time step [s], for `paper`."""
    max_steps: Steps = 200_000
    """Work cap: a chain that still moves after this number of steps is `unsettled`. A step that is
    repeated at a shorter length counts once."""
    max_steps_per_second: Steps = 50_000
    """Work cap: largest number of steps in each second of simulated time."""
