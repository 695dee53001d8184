"""The group `magnets` of a scene: four magnets per component, one behind each face."""

from functools import cached_property, partial
from typing import Annotated, Any, Literal, Self, cast, get_args

import numpy as np
import numpy.typing as npt
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    Strict,
    Tag,
    model_validator,
)

from magfold_env.scene.base import (
    FrozenModel,
    Metres,
    MetresOrZero,
    Positive,
    Remanence,
    T,
    number_or_list,
)
from magfold_env.scene.errors import Problem, SceneError
from magfold_env.scene.numbers import face_charge

FACES = ("front-left", "back-left", "back-right", "front-right")
"""Faces in the order of their letters; normals at +45°, +135°, -135° and -45° to the heading."""

ROUNDING = 1e-12  # lengths that agree to this part of the side count as equal

Array = npt.NDArray[np.float64]
Length = Literal["width", "height", "thickness", "inset"]

_ONE_A_FACE = f"one a face ({', '.join(FACES)})"


def _four(values: tuple[float, ...], *, also: str = "") -> tuple[float, ...]:
    if len(values) != len(FACES):
        raise ValueError(f"must be one number, or four, {_ONE_A_FACE}{also}")
    return values


def _row(value: object) -> object:
    if number_or_list(value) != "<list>" or len(cast("list[object]", value)) != len(FACES):
        raise ValueError(f"must be four numbers, {_ONE_A_FACE}")
    return value


def _strength_branch(value: object) -> str:
    tag = number_or_list(value)
    if tag == "<list>" and "<list>" in map(number_or_list, cast("list[object]", value)):
        return "<rows>"
    return tag


One = Annotated[T, Tag("<number>")]
FOUR = Field(json_schema_extra={"minItems": len(FACES), "maxItems": len(FACES)})
"""The checks of `_four` and `_row`, as JSON schemas express them."""
Four = Annotated[tuple[T, ...], AfterValidator(_four), FOUR, Tag("<list>")]
EachFace = Annotated[One[T] | Four[T], Discriminator(number_or_list)]
"""One number for all faces, or one number per face, in the order of `FACES`."""
_ALSO = ", or a row of four for each component"
Strength = Annotated[
    One[T]
    | Annotated[tuple[T, ...], AfterValidator(partial(_four, also=_ALSO)), FOUR, Tag("<list>")]
    | Annotated[tuple[Annotated[tuple[T, ...], BeforeValidator(_row), FOUR], ...], Tag("<rows>")],
    Discriminator(_strength_branch),
]
"""One number, one per face, or a row of four numbers per component, component 1 first."""


class Magnets(FrozenModel):
    """The magnets of a component, one behind each face that the sequence does not leave empty.

    A length is one number, or four in the order of `FACES`, and is the same in every component. A
    strength may also have a row of four numbers per component.
    """

    model: Literal["strips", "points"] = "strips"
    """`strips`: uniformly charged pole faces; `points`: the paper's point charges on a line."""
    remanence: Strength[Remanence] | None = 0.6
    """Residual flux density [T]; None if `pole_charge` is given."""
    pole_charge: Strength[Positive] | None = None
    """Magnetic charge of one pole face [A m], instead of `remanence`."""
    width: EachFace[Metres] = 0.006
    """Width of a pole face, along the casing's face in the plane [m]."""
    height: EachFace[Metres] = 0.006
    """Height of a pole face, normal to the plane [m]."""
    thickness: EachFace[Metres] = 0.0025
    """Distance between a magnet's two pole faces [m]."""
    inset: EachFace[MetresOrZero] = 0.0005
    """How far the outer pole face lies within the casing [m]; 0 needs `strips` without `nodes`."""
    nodes: Annotated[int, Strict(), Field(ge=1, le=128)] | None = None
    """Number of nodes along a pole face's width; if None, `accuracy` sets it (3 for `points`)."""
    accuracy: Annotated[float, Strict(), Field(ge=1e-12, le=0.1)] = 1e-3
    """For `strips`: bound on a component's force error, relative to the force of flush faces."""

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

    @model_validator(mode="after")
    def _nodes_keep_apart(self) -> Self:
        if min(self.lengths["inset"]) == 0.0 and not self.bounded:
            given = "model: points" if self.model == "points" else f"nodes: {self.nodes}"
            allowed = f"must be above 0 with {given}, whose forces in touch have no bound"
            raise SceneError([Problem("inset", self.inset, allowed)])
        return self

    @property
    def bounded(self) -> bool:
        """Whether `accuracy` bounds the errors; this needs `strips` and no given `nodes`."""
        return self.model == "strips" and self.nodes is None

    @property
    def strength_name(self) -> Literal["remanence", "pole_charge"]:
        """The key that sets the strength of the magnets."""
        return "remanence" if self.pole_charge is None else "pole_charge"

    @property
    def rows(self) -> int | None:
        """Number of components that have strengths of their own; None if all have the same."""
        strength: object = getattr(self, self.strength_name)
        if isinstance(strength, tuple) and isinstance(strength[0], tuple):
            return len(cast("tuple[object, ...]", strength))
        return None

    def by_face(self, name: Length) -> Array:
        """Return one of the lengths for each face [m], shape (4,), in the order of `FACES`."""
        return np.array(self.lengths[name])

    @cached_property
    def lengths(self) -> dict[Length, tuple[float, ...]]:
        """All lengths by name [m], each with one number per face in the order of `FACES`."""
        found: dict[Length, tuple[float, ...]] = {}
        for name in get_args(Length):
            given = getattr(self, name)
            found[name] = given if isinstance(given, tuple) else (given,) * 4
        return found

    def charges(self, n: int, factor: Array | float = 1.0) -> Array:
        """Return the magnetic charge of each pole face [A m], without sign, shape (n, 4).

        With uniform magnetisation along the thickness, the charge is remanence·area/µ0. ``factor``
        multiplies the strengths; its shape may be (m, 1, 1) or (m, n, 4), which gives (m, n, 4).

        Raises
        ------
        ValueError
            If strengths are given per component and their number of rows is not `n`.
        """
        if self.rows not in (None, n):
            raise ValueError(f"n: {n} is not allowed; {self.strength_name} has {self.rows} rows")
        strength = np.asarray(getattr(self, self.strength_name), dtype=np.float64) * factor
        if self.pole_charge is None:
            strength = face_charge(strength, self.by_face("width"), self.by_face("height"))
        charges = np.empty((*strength.shape[:-2], n, 4))
        charges[:] = strength
        return charges

    @cached_property
    def charge(self) -> float:
        """Largest magnetic charge of a pole face [A m], which scales energies and tolerances."""
        return float(self.charges(self.rows or 1).max())

    @property
    def even(self) -> bool:
        """Whether the four faces have equal widths, heights, thicknesses and insets."""
        return all(len(set(each)) == 1 for each in self.lengths.values())

    def misfits(self, side: float) -> list[Problem]:
        """Return the problems with magnets that do not fit into a casing with the given side [m].

        All four faces are checked, even empty ones, so that a scene stays valid when its sequence
        is replaced. A magnet is a rectangle as wide as its pole face. It lies between the depths
        `inset` and `inset` + `thickness` behind the casing's face.
        """
        width, depth = self.by_face("width"), self.by_face("inset") + self.by_face("thickness")
        room = side - 2.0 * depth  # for the width of a magnet beside this one
        slack = ROUNDING * side
        if self.even:
            if width[0] <= room[0] + slack:
                return []
            needed = f"casing.side at least {width[0] + 2.0 * depth[0]:.6g} m"
            allowed = f"no magnet so thick fits, must have {needed}"
            if room[0] > 0.0:
                bound = f"side - 2 (inset + thickness) = {room[0]:.6g} m"
                allowed = f"must be at most {bound}, or {needed}"
            return [Problem("width", self.width, f"the magnets of a casing overlap, {allowed}")]
        problems: list[Problem] = []
        for f, face in enumerate(FACES):
            g, opposite = (f + 1) % 4, (f + 2) % 4
            if width[f] > side + slack:
                allowed = f"{face}'s must be at most the casing's side, {side:.6g} m"
                problems.append(Problem("width", self.width, allowed))
            if width[f] > room[g] + slack and width[g] > room[f] + slack:
                allowed = (
                    f"the magnets of {face} and {FACES[g]} overlap, {face}'s must be at most "
                    f"{max(room[g], 0.0):.6g} m or {FACES[g]}'s at most {max(room[f], 0.0):.6g} m, "
                    "side - 2 (inset + thickness) of the other"
                )
                problems.append(Problem("width", self.width, allowed))
            if f < opposite and depth[f] + depth[opposite] > side + slack:
                allowed = (
                    f"the magnets of {face} and {FACES[opposite]} overlap, their insets and "
                    f"thicknesses must add up to at most the casing's side, {side:.6g} m"
                )
                problems.append(Problem("thickness", self.thickness, allowed))
        return problems
