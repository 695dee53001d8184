"""The groups of a scene: small frozen models, one sentence a field, SI units and radians."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self, cast

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    Strict,
    Tag,
    ValidationError,
    model_validator,
)

from magfold_env.errors import Problem, SceneError, problems_of

MU0 = 4e-7 * math.pi
"""Vacuum permeability [T m/A], the value the paper uses."""

# Strict: without it pydantic reads True as 1.0 and "3" as 3.0.
Number = Annotated[float, Strict()]
Positive = Annotated[float, Strict(), Field(gt=0)]
NonNegative = Annotated[float, Strict(), Field(ge=0)]
Fraction = Annotated[float, Strict(), Field(ge=0, lt=1)]
Flag = Annotated[bool, Strict()]


def _branch(value: object) -> str:
    return "<list>" if isinstance(value, (list, tuple)) else "<number>"


PositiveEach = Annotated[
    Annotated[Positive, Tag("<number>")] | Annotated[tuple[Positive, ...], Tag("<list>")],
    Discriminator(_branch),
]
"""One positive number for all components, or one for each, component 1 first."""


def plain(value: Any) -> Any:
    """Turn NumPy arrays and scalars, at any depth, into the Python values models are made of."""
    if isinstance(value, (np.ndarray, np.generic)):
        return cast("Any", value.tolist())
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in cast("Mapping[Any, Any]", value).items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in cast("list[Any]", value)]
    return value


class Part(BaseModel):
    """Base of all groups: frozen, closed to unknown keys, finite, and wrong with a `SceneError`."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __init__(self, **data: Any) -> None:
        try:
            super().__init__(**plain(data))
        except ValidationError as error:
            # Nested groups raise here too; the outer group puts its own key before theirs.
            raise SceneError(problems_of(error, type(self))) from None


class Casing(Part):
    """The square body of a component, hinged to its neighbours at opposite corners."""

    side: Positive = 0.0125
    """Edge length [m]."""
    mass: PositiveEach = 0.0037
    """Mass of a component with its magnets [kg]; one number, or one a component."""
    inertia: PositiveEach | None = None
    """Moment of inertia about the centre [kg m²]; None takes mass·side²/6, an even square."""
    corner_radius: Positive = 1e-5
    """Rounding of the corners where they meet other casings and the tube [m]."""
    hinge: Literal["corner"] = "corner"
    """Where neighbours are hinged; opposite corners is the only geometry there is."""

    @property
    def diagonal(self) -> float:
        """Distance between a component's two hinges [m]."""
        return self.side * math.sqrt(2.0)


class Magnets(Part):
    """The four equal magnets of a component, one behind each face."""

    model: Literal["strips", "points"] = "strips"
    """`strips`: evenly charged rectangles; `points`: the paper's charges on a line."""
    remanence: Positive | None = 0.6
    """Residual flux density [T]; None where `pole_charge` is given."""
    pole_charge: Positive | None = None
    """Magnetic charge of one pole face [A m]; given instead of `remanence`."""
    width: Positive = 0.006
    """Pole face along the casing's face, in the plane [m]."""
    height: Positive = 0.006
    """Pole face normal to the plane [m]."""
    thickness: Positive = 0.0025
    """Distance between a magnet's two pole faces [m]."""
    inset: NonNegative = 0.0005
    """How far the outer pole face lies inside the casing's face [m]."""
    nodes: Annotated[int, Strict(), Field(ge=1, le=128)] | None = None
    """Nodes along the width of a pole face; None lets `accuracy` choose (points: 3)."""
    accuracy: Annotated[float, Strict(), Field(ge=1e-12, le=0.1)] = 1e-3
    """Bound on a component's force error, relative to two flush opposite faces (`strips`)."""

    @model_validator(mode="before")
    @classmethod
    def _charge_replaces_remanence(cls, data: Any) -> Any:
        if isinstance(data, dict):
            entries = cast("dict[str, Any]", data)
            if entries.get("pole_charge") is not None and "remanence" not in entries:
                return {**entries, "remanence": None}
        return cast("Any", data)

    @model_validator(mode="after")
    def _one_strength(self) -> Self:
        if self.remanence is None and self.pole_charge is None:
            raise SceneError([Problem("remanence", None, "must be given, or pole_charge instead")])
        if self.remanence is not None and self.pole_charge is not None:
            allowed = f"must be left out when remanence ({self.remanence!r}) is given"
            raise SceneError([Problem("pole_charge", self.pole_charge, allowed)])
        return self

    @property
    def charge(self) -> float:
        """Magnetic charge of one pole face [A m]."""
        if self.pole_charge is not None:
            return self.pole_charge
        assert self.remanence is not None  # _one_strength
        return self.remanence * self.width * self.height / MU0


class Feed(Part):
    """The tube and how the chain is pushed out of it."""

    direction: Literal["forward", "backward"] = "forward"
    """`forward`: component 1 leaves first; `backward`: component n does."""
    speed: PositiveEach = 0.05
    """Feed speed [m/s]; one number, or the speed each component leaves at, component 1 first."""
    loading: Literal["preloaded", "at_mouth"] = "preloaded"
    """`at_mouth`: a component has no magnets until its leading hinge reaches the mouth."""
    bore: Positive | None = None
    """Inner width of the tube [m], at least the casing's diagonal; None takes 1.05 of it."""
    wall: Positive = 0.001
    """Thickness of the tube's walls [m]."""


class Gravity(Part):
    """Gravity: what presses the chain on the floor, and what acts along it."""

    normal: NonNegative = 9.8
    """Acceleration towards the floor [m/s²]; it acts through friction alone."""
    in_plane: tuple[Number, Number] = (0.0, 0.0)
    """Acceleration along x and y [m/s²]."""


class Spreads(Part):
    """Relative half-widths of the even draws that `Scene.draw` makes; 0 draws nothing."""

    friction: Fraction = 0.0
    """Of the friction coefficient, one factor a scene."""
    mass: Fraction = 0.0
    """Of the masses (and of inertias that are given), one factor a component."""
    remanence: Fraction = 0.0
    """Of the magnets' strength, one factor a scene."""
    feed_speed: Fraction = 0.0
    """Of the feed speeds, one factor a scene."""

    @property
    def any(self) -> bool:
        """Whether there is something to draw."""
        return max(self.friction, self.mass, self.remanence, self.feed_speed) > 0.0


class Solver(Part):
    """How time is stepped."""

    method: Literal["adaptive", "paper"] = "adaptive"
    """`paper` repeats the paper's fixed steps and snaps; it needs `mount: pinned`."""
    tolerance: Annotated[float, Strict(), Field(ge=1e-12, le=0.1)] = 1e-4
    """Local error allowed in an angle [rad] (`adaptive`)."""
    time_step: Positive = 1.0 / 1200.0
    """Step [s] (`paper`)."""
    max_steps: Annotated[int, Strict(), Field(ge=1)] = 200_000
    """Work cap: a chain still moving after so many steps is `unsettled`."""
    max_steps_per_second: Annotated[int, Strict(), Field(ge=1)] = 50_000
    """Work cap: so is one that needs more steps in one second of simulated time."""
