"""JSON files of actions that were chosen in advance for the draws of a known seed.

======= ===========================================================================================
key     value
======= ===========================================================================================
format  ``magfold_env actions 1``
id      the environment's ID in Gymnasium
seed    the seed of the draws, see `magfold_env.scoring.score.track_of`
actions a list for each episode, with a number for each step; numbers after the end of the episode
        are ignored. If only the feed speed is free, the numbers are those of the environment's
        ``Box``, from −1 to 1; in environments with a tray, they are ``discrete`` actions
======= ===========================================================================================
"""

from pathlib import Path
from typing import Annotated, Any, Literal

from gymnasium import Space, spaces
from pydantic import Field, ValidationError

from magfold_env.files import reading_json
from magfold_env.scene import Problem, SceneError
from magfold_env.scene.base import FrozenModel, Number
from magfold_env.scene.errors import problems_of, refuse

FORMAT = "magfold_env actions 1"

MOST_TOLD = 10
"""Largest number of wrong actions in an error message."""


class ActionFile(FrozenModel):
    """The contents of a file of actions."""

    format: Literal["magfold_env actions 1"]
    id: str
    seed: Annotated[int, Field(strict=True, ge=0)]
    actions: Annotated[
        tuple[Annotated[tuple[Number, ...], Field(min_length=1)], ...], Field(min_length=1)
    ]


def read(path: str | Path) -> ActionFile:
    """Read a file of actions."""
    with reading_json(path, "a file of actions", FORMAT) as data:
        content = data
    try:
        return ActionFile.model_validate(content)
    except ValidationError as error:
        raise SceneError(problems_of(error, ActionFile), str(path)) from None


def check(entry: ActionFile, space: Space[Any]) -> None:
    """Raise a `SceneError` if actions lie outside `space`, whose actions are single numbers."""
    if isinstance(space, spaces.Discrete):
        last = int(space.n) - 1
        allowed = f"must be a whole number from 0 to {last}"
    else:
        last, allowed = None, "must be a number from -1 to 1"

    def fits(action: float) -> bool:
        return abs(action) <= 1.0 if last is None else action in range(last + 1)

    refuse(
        [
            Problem(f"actions[{row}][{step}]", action, allowed)
            for row, actions in enumerate(entry.actions)
            for step, action in enumerate(actions)
            if not fits(action)
        ][:MOST_TOLD]
    )
