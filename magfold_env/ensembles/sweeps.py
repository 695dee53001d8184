"""Sweeps: one ensemble of a scene for every value of one or two of its parameters."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from pathlib import Path
from typing import Any, NamedTuple, cast

from magfold_env.ensembles.releases import Ensemble, Run, most_first, outcome_row, released
from magfold_env.files import reading_json, write_json, write_text
from magfold_env.fold import FoldStatus
from magfold_env.parallel import Backend, Workers
from magfold_env.reporting.intervals import Share
from magfold_env.reporting.notebook import NotebookDisplay, short_table
from magfold_env.reporting.page import Block
from magfold_env.reporting.tables import Row, to_csv
from magfold_env.scene import Problem, Scene, SceneError, errors, unless_a_scene
from magfold_env.scene.base import plain
from magfold_env.shapes import parse_word

FORMAT = "magfold_env sweep 1"

MOST = 100
"""Largest number of values of a parameter."""

KEYS_AND_VALUES = "a mapping of a scene's keys to their values"

_LARGEST = 2.0**53  # up to here, floats represent whole numbers exactly


class Outcome(NamedTuple):
    """An outcome of a run: a word, a status, or both, such as `LRL`, `folded`, `LRL folded`."""

    word: str | None = None
    """Fold word; None for any word."""
    status: FoldStatus | None = None
    """Status; None for any status."""

    def __str__(self) -> str:
        """Return the outcome as text, the word first."""
        return " ".join(part for part in self if part)

    @classmethod
    def parse(cls, text: str, n: int) -> Outcome:
        """Return the outcome that a text names for `n` components, or raise a `SceneError`."""
        try:
            first, *more = text.split()
            if first in [*FoldStatus] and not more:
                return cls(None, FoldStatus(first))
            (status,) = more or (None,)
            return cls(parse_word(first, n), None if status is None else FoldStatus(status))
        except ValueError:
            statuses = ", ".join(FoldStatus)
            allowed = f"must be a word of {n - 1} letters L, S and R, one of {statuses}, or both"
            raise SceneError([Problem("outcome", text, allowed)]) from None


def outcomes(made: Ensemble) -> Counter[Outcome]:
    """Count the outcomes, most frequent first: folded runs by word, other runs by status."""
    counts = Counter[Outcome]()
    for (word, status), found in made.outcomes.items():
        folded = status is FoldStatus.FOLDED
        counts[Outcome(word if folded else None, status)] += found.successes
    return most_first(counts)


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(NotebookDisplay):
    """Ensembles of one scene on a grid of one or two parameters; all points use the same draws."""

    scene: Scene
    """The scene before its parameters are set."""
    seed: int
    """Seed of the draws: run i of every point uses the ensemble's ``generator(i)``."""
    over: dict[str, tuple[float, ...]]
    """Values of each parameter, by its dotted key."""
    ensembles: tuple[Ensemble, ...]
    """One ensemble per point, in the order of `points`."""

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.ensembles)

    def __repr__(self) -> str:
        """Return the varied parameters and the number of releases."""
        over = " × ".join(f"{key} ({len(values)} values)" for key, values in self.over.items())
        return f"<Sweep over {over}, runs={len(self.ensembles[0])}>"

    def _shown(self) -> list[Block]:
        rows: list[Row] = []
        for point, each in zip(self.points, self.ensembles, strict=True):
            first = next(iter(outcomes(each)))
            share = str(each.probability(*first))
            rows.append({**point, "most frequent": str(first), "share": share})
        title = f"{len(self)} points of {len(self.ensembles[0])} runs"
        return [short_table(title, rows, len(rows))]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each parameter."""
        return tuple(len(values) for values in self.over.values())

    @property
    def points(self) -> list[dict[str, float]]:
        """The parameters at each point of the grid; the last parameter varies fastest."""
        return points(self.over)

    @cached_property
    def leading(self) -> Counter[Outcome]:
        """Number of runs at all points by outcome, most frequent first; see `outcomes`."""
        return most_first(sum(map(outcomes, self.ensembles), Counter[Outcome]()))

    def probability(self, word: str | None = None, status: str | None = None) -> list[Share]:
        """Return the probability of a word, of a status, or of both together, at each point.

        Raises
        ------
        ValueError
            If there is no such status.
        """
        return [each.probability(word, status) for each in self.ensembles]

    def rows(self) -> list[Row]:
        """Return table rows, one per point and outcome, with the most frequent outcome first."""
        counts = Counter[tuple[str, FoldStatus]]()
        for each in self.ensembles:
            counts.update({ends: found.successes for ends, found in each.outcomes.items()})
        return [
            {**point, **outcome_row(*ends, each.probability(*ends))}
            for point, each in zip(self.points, self.ensembles, strict=True)
            for ends in most_first(counts)
        ]

    def to_csv(self, path: str | Path) -> None:
        """Write `rows` as CSV, through a temporary file."""
        write_text(path, to_csv(self.rows()))

    def to_dict(self) -> dict[str, Any]:
        """Return the sweep as JSON values; numbers that are not finite become None."""
        found: list[dict[str, Any]] = []
        for point, each in zip(self.points, self.ensembles, strict=True):
            content = each.to_dict()
            for common in ("format", "scene", "seed"):
                del content[common]
            found.append({"at": point, **content})
        return {
            "format": FORMAT,
            "scene": self.scene.model_dump(mode="json"),
            "seed": self.seed,
            "over": {key: list(values) for key, values in self.over.items()},
            "points": found,
        }

    def to_json(self, path: str | Path) -> None:
        """Write the sweep as JSON through a temporary file; `from_json` reads the file."""
        write_json(path, self.to_dict(), listed="points")

    @classmethod
    def from_json(cls, path: str | Path) -> Sweep:
        """Read a sweep that `to_json` wrote; the result equals it bit for bit.

        Raises
        ------
        ValueError
            If the file is not such a sweep.
        """
        with reading_json(path, "a sweep", FORMAT) as data:
            scene, seed, over = Scene(**data["scene"]), data["seed"], _checked(data["over"])
            ensembles = [
                Ensemble.of(each, seed, [Run.from_record(run, scene.n) for run in found["runs"]])
                for each, found in zip(scenes(scene, over), data["points"], strict=True)
            ]
            return cls(scene, seed, over, tuple(ensembles))


def sweep(
    scene: Scene,
    over: Mapping[str, Sequence[float]],
    runs: int = 100,
    seed: int = 0,
    *,
    workers: int | None = None,
    backend: Backend | None = None,
    state: str | Path | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Sweep:
    """Simulate an ensemble at every point of a grid of one or two of a scene's parameters.

    Run i uses the same random numbers at every point, so that only the parameters cause
    differences between points. Calling `ensemble` with a point's scene gives the same result, bit
    for bit.

    Parameters
    ----------
    scene
        The scene to release.
    over
        Increasing values of one or two parameters of the scene, by their dotted keys:
        ``{"friction": [0.1, 0.2, 0.4], "magnets.remanence": np.linspace(0.6, 1.4, 9)}``.
    runs
        Number of releases per point.
    seed
        Seed of all draws.
    workers, backend
        Number and kind of the parallel workers, as for `ensemble`.
    state
        Folder that stores completed runs every two seconds. A later call with the same folder makes
        only the missing runs, after an interruption or for more runs per point.
    progress
        Called with the number of completed runs at all points and the number of all runs.

    Raises
    ------
    SceneError
        If an argument is not allowed, or the scene is not valid at a point.
    CheckpointError
        If the contents of `state` are damaged or belong to another sweep or physics, or if another
        process uses the folder.
    ImportError
        If Ray is selected but not installed.
    """
    asked = Workers(workers, backend)
    errors.refuse(unless_a_scene(scene) + errors.unless_a("over", over, Mapping, KEYS_AND_VALUES))
    values = _checked(over)
    key = {"kind": "sweep", "scene": scene.model_dump(mode="json"), "over": list(values.items())}
    made = released(scenes(scene, values), runs, seed, asked, key, state, progress)
    return Sweep(scene, seed, values, tuple(made))


def points(over: Mapping[str, Sequence[float]]) -> list[dict[str, float]]:
    """Return the parameters at each point of a grid; the last parameter varies fastest."""
    return [dict(zip(over, values, strict=True)) for values in product(*over.values())]


def scenes(scene: Scene, over: Mapping[str, Sequence[float]]) -> list[Scene]:
    """Return a scene for each of the `points`; an error names the point.

    A key that has several numbers in the scene, such as one strength per magnet, raises an error,
    because one number would replace them all.
    """
    for key, values in over.items():
        given: Any = scene
        for name in key.split("."):
            given = getattr(given, name, None)
        if isinstance(given, tuple):
            allowed = f"must not stand for the several that the scene has, {given}"
            raise SceneError([Problem(key, list(values), allowed)])
    found: list[Scene] = []
    for point in points(over):
        try:
            found.append(scene.replace(**_nested(point)))
        except SceneError as error:
            at = ", ".join(f"{key}={value:.12g}" for key, value in point.items())
            raise SceneError(error.problems, f"at {at}") from None
    return found


def _checked(over: Mapping[str, Sequence[float]]) -> dict[str, tuple[float, ...]]:
    """Return the values of the parameters as floats, or raise a `SceneError`."""
    if not 1 <= len(over) <= 2:
        errors.refuse([Problem("over", list(over), "must name one or two numbers of the scene")])
    problems: list[Problem] = []
    checked: dict[str, tuple[float, ...]] = {}
    for key, given in over.items():
        values: Any = list(given) if isinstance(given, range) else plain(given)
        if not isinstance(cast("object", key), str):
            problems.append(Problem("over", key, "must be the key of a number of a scene"))
        elif not _increasing(values):
            allowed = f"must be 2 to {MOST} numbers, each larger than the one before"
            problems.append(Problem(key, values, allowed))
        else:
            checked[key] = tuple(map(float, values))
    errors.refuse(problems)
    return checked


def _increasing(values: Any) -> bool:
    if not isinstance(values, list) or not 2 <= len(cast("list[Any]", values)) <= MOST:
        return False
    numbers = cast("list[Any]", values)
    if not all(type(each) in {int, float} and abs(each) <= sys.float_info.max for each in numbers):
        return False
    return all(a < b for a, b in pairwise(map(float, numbers)))


def _nested(point: Mapping[str, float]) -> dict[str, Any]:
    """Return the changes that set the values of dotted keys in a scene."""
    changes: dict[str, Any] = {}
    for key, value in point.items():
        *groups, name = key.split(".")
        inner = changes
        for group in groups:
            inner = inner.setdefault(group, {})
        # A key for whole numbers does not accept floats; other keys accept both.
        inner[name] = int(value) if value % 1.0 == 0.0 and abs(value) < _LARGEST else value
    return changes
