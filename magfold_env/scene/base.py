"""The base class of a scene's groups, and the types of the numbers in them."""

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
"""Vacuum permeability [T m/A], with the value that the paper uses."""

# Strict, because pydantic otherwise reads True as 1.0 and "3" as 3.0.
Number = Annotated[float, Strict()]
Positive = Annotated[float, Strict(), Field(gt=0)]
NonNegative = Annotated[float, Strict(), Field(ge=0)]
Fraction = Annotated[float, Strict(), Field(ge=0, lt=1)]
Flag = Annotated[bool, Strict()]


class Most(NamedTuple):
    """The largest allowed value of a quantity, and other units that users may give by mistake."""

    most: float
    unit: str
    usual: tuple[float, float]
    """The smallest and the largest plausible value."""
    others: dict[str, float]
    """Other units by name, each expressed in this unit. The message suggests the first one with
    which the value is plausible."""

    def check(self, value: object) -> object:
        """Return the value; if it is too large, raise a `ValueError` that may suggest a unit."""
        if not is_number(value) or not self.most < value <= sys.float_info.max:
            return value
        message = f"must be at most {self.most:.6g} {self.unit}"
        for name, size in self.others.items():
            if self.usual[0] <= value * size <= self.usual[1]:
                message += f"; {value:.6g} {name} are {value * size:.6g}"
                break
        raise ValueError(message)


LENGTH = Most(0.5, "m", (0.0, 0.5), {"mm": 1e-3})
"""Limits on the sides of casings and magnets."""
PLACE = Most(1000.0, "m", (0.0, 1.0), {"mm": 1e-3})
"""Limits on coordinates of fixed bodies, and on the sizes of tubes and obstacles."""
REMANENCE = Most(10.0, "T", (0.05, 1.6), {"mT": 1e-3, "kG": 0.1, "G": 1e-4})
"""Limits on the remanence. No magnet has more than 1.6 T, and draws at most quadruple that."""
SPEED = Most(20.0, "m/s", (0.0, 20.0), {"mm/s": 1e-3})
"""Limits on the feed speed; no drive is faster."""

Metres = Annotated[Positive, Field(le=LENGTH.most), BeforeValidator(LENGTH.check)]
MetresOrZero = Annotated[NonNegative, Field(le=LENGTH.most), BeforeValidator(LENGTH.check)]
Size = Annotated[Positive, Field(le=PLACE.most), BeforeValidator(PLACE.check)]
Place = Annotated[Number, Field(ge=-PLACE.most, le=PLACE.most), BeforeValidator(PLACE.check)]
Remanence = Annotated[Positive, Field(le=REMANENCE.most), BeforeValidator(REMANENCE.check)]
Speed = Annotated[Positive, Field(le=SPEED.most), BeforeValidator(SPEED.check)]
Velocity = Annotated[Number, Field(ge=-SPEED.most, le=SPEED.most), BeforeValidator(SPEED.check)]


def number_or_list(value: object) -> str:
    """Return the tag of the branch that validates a value: a single number or a list.

    `magfold_env.scene.errors.dotted` distinguishes tags from keys by their angle brackets.
    """
    return "<list>" if isinstance(value, (list, tuple)) else "<number>"


T = TypeVar("T")
Each = Annotated[
    Annotated[T, Tag("<number>")] | Annotated[tuple[T, ...], Tag("<list>")],
    Discriminator(number_or_list),
]
"""One number for all components, or one number per component, component 1 first."""


def plain(value: Any) -> Any:
    """Convert NumPy arrays and scalars, at any depth, to Python values that models accept."""
    if isinstance(value, (np.ndarray, np.generic)):
        return cast("Any", value.tolist())
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in cast("Mapping[Any, Any]", value).items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in cast("list[Any]", value)]
    return value


def by_key(value: Any, key: str = "", *, lists: bool = True) -> dict[str, Any]:
    """Return the values of nested groups by their dotted keys.

    With ``lists``, each item of a list has a key, which ends with its position: ``friction_2``.
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
    """Base class of all groups: frozen models that raise a `SceneError` for any wrong entry."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __init__(self, /, **data: Any) -> None:
        try:
            super().__init__(**plain(data))
        except ValidationError as error:
            # Nested groups raise this error too; the outer group adds its own key in front.
            raise SceneError(problems_of(error, type(self))) from None
