"""Base class of the groups of a scene, and the numbers in them."""

import math
import sys
from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple, TypeVar, cast

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Strict,
    Tag,
    ValidationError,
)

from magfold_env.scene.errors import SceneError, is_number, problems_of

MU0 = 4e-7 * math.pi
"""Vacuum permeability [T m/A], the value the paper uses."""

# Strict, because pydantic otherwise reads True as 1.0 and "3" as 3.0.
Number = Annotated[float, Strict()]
Positive = Annotated[float, Strict(), Field(gt=0)]
NonNegative = Annotated[float, Strict(), Field(ge=0)]
Fraction = Annotated[float, Strict(), Field(ge=0, lt=1)]
Flag = Annotated[bool, Strict()]


class Most(NamedTuple):
    """The largest value of a quantity, and units that are used by mistake."""

    most: float
    unit: str
    usual: tuple[float, float]
    """The smallest and the largest plausible number."""
    others: dict[str, float]
    """Other units by name, each in this unit. The message names the first that gives a plausible
    number."""

    def check(self, value: object) -> object:
        """Return the value; raise a `ValueError` that suggests another unit if it is too large."""
        if not is_number(value) or not self.most < value <= sys.float_info.max:
            return value
        message = f"must be at most {self.most:.6g} {self.unit}"
        for name, size in self.others.items():
            if self.usual[0] <= value * size <= self.usual[1]:
                message += f"; {value:.6g} {name} are {value * size:.6g}"
                break
        raise ValueError(message)


LENGTH = Most(0.5, "m", (0.0, 0.5), {"mm": 1e-3})
"""Limits of the sides of casings and magnets."""
REMANENCE = Most(10.0, "T", (0.05, 1.6), {"mT": 1e-3, "kG": 0.1, "G": 1e-4})
"""No magnet has more than 1.6 T; draws of its strength at most quadruple that."""
SPEED = Most(20.0, "m/s", (0.0, 20.0), {"mm/s": 1e-3})
"""Limits of the feed speed; no drive is faster."""

Metres = Annotated[Positive, Field(le=LENGTH.most), BeforeValidator(LENGTH.check)]
MetresOrZero = Annotated[NonNegative, Field(le=LENGTH.most), BeforeValidator(LENGTH.check)]
Remanence = Annotated[Positive, Field(le=REMANENCE.most), BeforeValidator(REMANENCE.check)]
Speed = Annotated[Positive, Field(le=SPEED.most), BeforeValidator(SPEED.check)]
Velocity = Annotated[Number, Field(ge=-SPEED.most, le=SPEED.most), BeforeValidator(SPEED.check)]


def number_or_list(value: object) -> str:
    """Return the tag of the branch that checks one number or many.

    Tags in angle brackets are not taken for keys: see `magfold_env.scene.errors.dotted`.
    """
    return "<list>" if isinstance(value, (list, tuple)) else "<number>"


T = TypeVar("T")
Each = Annotated[
    Annotated[T, Tag("<number>")] | Annotated[tuple[T, ...], Tag("<list>")],
    Discriminator(number_or_list),
]
"""One number for all components, or one for each, component 1 first."""


def plain(value: Any) -> Any:
    """Convert NumPy arrays and scalars, at any depth, to Python values for models."""
    if isinstance(value, (np.ndarray, np.generic)):
        return cast("Any", value.tolist())
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in cast("Mapping[Any, Any]", value).items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in cast("list[Any]", value)]
    return value


def by_key(value: Any, key: str = "", *, lists: bool = True) -> dict[str, Any]:
    """Return the values in nested groups by their dotted keys.

    With ``lists``, their values have keys too, which end in places from 1: ``friction_2``.
    """
    if isinstance(value, Mapping):
        named = cast("Mapping[str, Any]", value).items()
        parts = [(f"{key}.{name}" if key else name, each) for name, each in named]
    elif lists and isinstance(value, (list, tuple)):
        parts = [(f"{key}_{k}", each) for k, each in enumerate(cast("list[Any]", value), 1)]
    else:
        return {key: value}
    found = (by_key(each, part, lists=lists) for part, each in parts)
    return {name: leaf for leaves in found for name, leaf in leaves.items()}


class FrozenModel(BaseModel):
    """Base of all groups: frozen, without unknown keys, finite; errors raise a `SceneError`."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __init__(self, /, **data: Any) -> None:
        try:
            super().__init__(**plain(data))
        except ValidationError as error:
            # Nested groups raise here too; the outer group prefixes its own key.
            raise SceneError(problems_of(error, type(self))) from None
