"""Files of results: tables of players, tasks and episodes.

`magfold score` and the commands of `agents` that compare players write this format. Each writes its
own kind of table, called a view. A row contains a player's summary and its episodes.
"""

import json
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationError, model_validator

from magfold_env.files import reading_json, write_text
from magfold_env.reporting.intervals import share
from magfold_env.scene import Problem, SceneError
from magfold_env.scene.base import FrozenModel
from magfold_env.scene.errors import problems_of, refuse

FORMAT = "magfold_env results 1"

SHA256 = r"^[0-9a-f]{64}$"
NAME = re.compile(r"[\w .+-]{1,80}")
"""Allowed names of submissions, which the scoreboard shows."""

View = Literal["score", "evaluation", "ablation", "admission", "generalisation"]


class File(FrozenModel):
    """The file from which a player was read."""

    name: str
    """Path of the file, or a name such as ``random`` if there is none."""
    sha256: Annotated[str, Field(pattern=SHA256)] | None = None
    """SHA-256 of the file."""


class Run(FrozenModel):
    """Columns of a player's episodes, one entry per episode; omitted columns are empty."""

    task: tuple[int, ...] = ()
    """Number of each episode's task, if the tasks alternate."""
    success: Annotated[str, Field(pattern=r"^[01]+$")]
    """A character per episode: 1 for a success, 0 otherwise."""
    score: tuple[float, ...] = ()
    energy: tuple[float | None, ...] = ()
    """Energies at the end [J], which are equal for identical motions; None for failures."""
    details: dict[str, tuple[Any, ...]] = Field(default_factory=dict)
    """Further columns of a view."""

    @model_validator(mode="after")
    def _of_one_length(self) -> Self:
        columns = {name: getattr(self, name) for name in ("task", "score", "energy")}
        columns |= {f"details.{name}": column for name, column in self.details.items()}
        allowed = f"must have {len(self.success)} entries, as success has"
        wrong = [
            Problem(name, len(column), allowed)
            for name, column in columns.items()
            if column and len(column) != len(self.success)
        ]
        refuse(wrong)
        return self

    @classmethod
    def of(cls, success: Iterable[Any], **columns: Any) -> Self:
        """Return a run with a sequence of successes and other columns."""
        return cls(success="".join(str(int(each)) for each in success), **columns)


class Row(FrozenModel):
    """The results of a player, as a row of the table."""

    success: tuple[float, float, float]
    """Share of successes, and the lower and upper end of its interval."""
    score: float | None = None
    """Mean score of the episodes."""
    kind: Literal["policy", "actions"] | None = None
    """Kind of the submission; actions may have been chosen with knowledge of the draws."""
    files: tuple[File, ...] = ()
    """Files of the player, one per run."""
    runs: tuple[Run, ...] = ()
    """Episodes of the player, if they are stored."""
    figures: dict[str, Any] = Field(default_factory=dict)
    """Further values of a view."""


class Results(FrozenModel):
    """The content of a file of results."""

    format: Literal["magfold_env results 1"] = FORMAT
    view: View
    id: str
    """The environment's ID in Gymnasium."""
    env: dict[str, Any] = Field(default_factory=dict)
    """Settings that differ from the environment's defaults."""
    confidence: float = 0.95
    """Confidence level of all intervals."""
    draws: int
    """Version of the draws, see `magfold_env.envs.tasks.draws`."""
    seed: int | None = None
    """Seed that sets the draws of a score."""
    tasks: tuple[str, ...] = ()
    """The targets, in the order in which they are played."""
    seeds: tuple[int, ...] = ()
    """Seeds of each target's draws, in the order of the episodes of every run."""
    physics: Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]
    """Hash of the physics; see `magfold_env.files.physics_digest`."""
    provenance: dict[str, Any] = Field(default_factory=dict)
    """Software, time, machine and duration of the run."""
    figures: dict[str, Any] = Field(default_factory=dict)
    """Further values of a view that concern all players."""
    rows: Annotated[dict[str, Row], Field(min_length=1)]
    """Rows by player."""

    @model_validator(mode="after")
    def _scored(self) -> Self:
        """Raise a `SceneError` if a score disagrees with its episodes."""
        if self.view == "score":
            refuse(list(self._wrong_scores()))
        return self

    def _wrong_scores(self) -> Iterator[Problem]:
        (name, row), *others = self.rows.items()
        if others:
            yield Problem("rows", list(self.rows), "must be one player")
        if not NAME.fullmatch(name):
            yield Problem("rows", name, "must have a name of letters, digits, spaces and .+-_")
        if self.seed is None:
            yield Problem("seed", None, "must be given")
        if row.kind is None or len(row.files) != 1 or row.files[0].sha256 is None:
            yield Problem(f"rows.{name}.files", len(row.files), "must be one, its kind given")
        if len(row.runs) != 1 or not (row.runs[0].task and row.runs[0].score):
            yield Problem(f"rows.{name}.runs", len(row.runs), "must be one, with task and score")
            return
        found = summed(row.runs[0])
        for key, own in found.items():
            there = getattr(row, key)
            if there is None or not np.allclose(there, own, rtol=0.0, atol=1e-9):
                yield Problem(f"rows.{name}.{key}", there, f"must be that of the episodes, {own}")

    def write(self, path: str | Path) -> None:
        """Write results to `path` through a temporary file, with lists of values on one line."""
        kept = {"format": FORMAT, "confidence": self.confidence}
        kept |= self.model_dump(mode="json", exclude_defaults=True)
        text = one_line_lists(json.dumps(kept, indent=1, allow_nan=False))
        write_text(path, f"{text}\n")

    @classmethod
    def read(cls, path: str | Path, *views: View) -> Self:
        """Read results that `write` wrote.

        Raises
        ------
        ValueError
            If the file does not contain results, or if its view is none of the given ones.
        """
        with reading_json(path, "a file of results", FORMAT) as data:
            content = data
        try:
            found = cls.model_validate(content)
            if views and found.view not in views:
                refuse([Problem("view", found.view, f"must be {' or '.join(views)}")])
        except ValidationError as error:
            raise SceneError(problems_of(error, cls), str(path)) from None
        except SceneError as error:
            raise SceneError(error.problems, str(path)) from None
        return found


def one_line_lists(text: str) -> str:
    """Return JSON with each list of values on one line."""
    return re.sub(r"\[\n\s*([^][{}]*?)\n\s*\]", _on_one_line, text)


def _on_one_line(found: re.Match[str]) -> str:
    return "[" + re.sub(r",\n\s*", ", ", found[1]) + "]"


def summed(run: Run) -> dict[str, Any]:
    """Return a run's share of successes, with its Wilson interval, and its mean score."""
    found = share(run.success.count("1"), len(run.success))
    return {
        "success": (found.rate, found.low, found.high),
        "score": sum(run.score) / len(run.score),
    }
