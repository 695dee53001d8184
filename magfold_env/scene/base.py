"""What the groups of a scene are made of: their base class and the numbers they hold."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, cast

import numpy as np
from pydantic import BaseModel, ConfigDict, Discriminator, Field, Strict, Tag, ValidationError

from magfold_env.scene.errors import SceneError, problems_of

MU0 = 4e-7 * math.pi
"""Vacuum permeability [T m/A], the value the paper uses."""

# Strict: without it pydantic reads True as 1.0 and "3" as 3.0.
Number = Annotated[float, Strict()]
Positive = Annotated[float, Strict(), Field(gt=0)]
NonNegative = Annotated[float, Strict(), Field(ge=0)]
Fraction = Annotated[float, Strict(), Field(ge=0, lt=1)]
Flag = Annotated[bool, Strict()]


def number_or_list(value: object) -> str:
    """Return the tag of the branch by which one number or many are checked.

    Tags in angle brackets are not taken for keys: see `magfold_env.scene.errors.dotted`.
    """
    return "<list>" if isinstance(value, (list, tuple)) else "<number>"


PositiveEach = Annotated[
    Annotated[Positive, Tag("<number>")] | Annotated[tuple[Positive, ...], Tag("<list>")],
    Discriminator(number_or_list),
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

    def __init__(self, /, **data: Any) -> None:
        try:
            super().__init__(**plain(data))
        except ValidationError as error:
            # Nested groups raise here too; the outer group puts its own key before theirs.
            raise SceneError(problems_of(error, type(self))) from None
