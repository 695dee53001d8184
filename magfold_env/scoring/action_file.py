"""Actions chosen beforehand, for draws of a seed that is known: a file of JSON.

======= ===========================================================================================
key     value
======= ===========================================================================================
format  ``magfold_env actions 1``
id      the environment's name with Gymnasium
seed    of the draws, see `magfold_env.scoring.score.track_of`
actions a list for each episode: a number from −1 to 1 for each of its steps, as the environment's
        ``Box`` has it, up to the end of the episode; what comes after that is not read
======= ===========================================================================================
"""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationError

from magfold_env.files import reading_json
from magfold_env.scene import SceneError
from magfold_env.scene.base import Number, Part
from magfold_env.scene.errors import problems_of

FORMAT = "magfold_env actions 1"

_Action = Annotated[Number, Field(ge=-1, le=1)]


class ActionFile(Part):
    """What such a file holds."""

    format: Literal["magfold_env actions 1"]
    id: str
    seed: Annotated[int, Field(strict=True, ge=0)]
    actions: Annotated[
        tuple[Annotated[tuple[_Action, ...], Field(min_length=1)], ...], Field(min_length=1)
    ]


def read(path: str | Path) -> ActionFile:
    """Read actions.

    Raises
    ------
    ValueError
        If something in the file is not allowed.
    """
    with reading_json(path, "a file of actions", FORMAT) as data:
        content = data
    try:
        return ActionFile.model_validate(content)
    except ValidationError as error:
        raise SceneError(problems_of(error, ActionFile), str(path)) from None
