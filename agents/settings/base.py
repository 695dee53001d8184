"""What all settings have in common."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

from magfold_env.scene import Problem, SceneError

Count = Annotated[int, Field(ge=1)]
Unit = Annotated[float, Field(ge=0, le=1)]
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]


def word_or_other(value: Any) -> str:
    """Tell the branches of a union apart: a word, or the one other kind that is allowed."""
    return "<word>" if isinstance(value, str) else "<other>"


AutoOr = Annotated[
    Annotated[Literal["auto"], Tag("<word>")] | Annotated[float, Tag("<other>")],
    Discriminator(word_or_other),
]
"""A number, or ``auto`` to let the learner find it."""


class Group(BaseModel, frozen=True):
    """Settings that belong together; unknown keys are errors."""

    model_config = ConfigDict(allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _known(cls, given: Any) -> Any:
        """Refuse unknown keys, and say which ones this group has."""
        if isinstance(given, dict):
            allowed = f"unknown key, must be one of {', '.join(cls.model_fields)}"
            unknown = [key for key in given if key not in cls.model_fields]
            if unknown:
                raise SceneError([Problem(str(key), given[key], allowed) for key in unknown])
        return given
