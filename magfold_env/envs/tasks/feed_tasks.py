"""Tasks: a given chain or given components, and the folds to reach."""

import os
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np

from magfold_env.envs.baselines.baseline import chain_name
from magfold_env.envs.spaces.actions import LYING, PATTERNS
from magfold_env.envs.tasks.checks import one_of, require
from magfold_env.envs.tasks.symmetry import SIDES, Split
from magfold_env.envs.tasks.targets import is_target
from magfold_env.files import configs_dir, read_text
from magfold_env.scene import Problem, SceneError
from magfold_env.scene.base import FrozenModel, Positive
from magfold_env.scene.errors import refuse
from magfold_env.scene.io import MOST_BYTES, parse_yaml
from magfold_env.scene.scene import Component

Order = list[tuple[int, int]]
"""Numbers of components on a tray, and their orientations; component 1 of the chain first."""


class Task(FrozenModel):
    """The direction of feed and the fold to reach."""

    direction: Literal["forward", "backward"]
    """Direction of feed."""
    target: str
    """Word to reach."""

    @property
    def n(self) -> int:
        """Number of components of the chain."""
        return len(self.target) + 1

    def as_fed(self, chain: Any) -> Any:
        """Convert an array from component order to the order of feed, or back."""
        return chain if self.direction == "forward" else chain[::-1]

    @property
    @abstractmethod
    def parts(self) -> tuple[str, ...]:
        """The available components."""

    @property
    def words(self) -> tuple[str, ...]:
        """The words to reach, one after the other."""
        return (self.target,)

    @property
    def aim(self) -> str:
        """The goal as one string."""
        return "-".join(self.words)

    @property
    def name(self) -> str:
        """Cache key of the baseline."""
        return chain_name(self.parts, self.direction, self.aim)


class FeedTask(Task):
    """A task with a given chain."""

    sequence: tuple[Component, ...]
    """The components, component 1 first."""

    @property
    def n(self) -> int:
        """Number of components of the chain."""
        return len(self.sequence)

    @property
    def parts(self) -> tuple[str, ...]:
        """The available components."""
        return self.sequence


class RefoldTask(FeedTask):
    """A task with a given chain and two folds to reach."""

    first: str
    """Word to reach before the target."""

    @property
    def words(self) -> tuple[str, ...]:
        """The words to reach, one after the other."""
        return (self.first, self.target)


class TrayTask(Task):
    """A tray of components, the direction of feed and the fold to reach."""

    tray: tuple[str, ...]
    """Faces of the components on the tray, four letters N or S each."""
    strengths: tuple[tuple[float, float, float, float], ...] | None = None
    """Factors of the magnets' strengths; None to draw them at reset."""

    def __init__(self, **data: Any) -> None:
        super().__init__(**data)
        key, wrong = "tray", [faces for faces in self.tray if faces not in PATTERNS]
        problems = [Problem(key, each, "must be four letters N or S") for each in wrong]
        if len(self.tray) < self.n:
            allowed = f"must have {self.n} components or more"
            problems.append(Problem(key, self.tray, allowed))
        if self.strengths is not None and len(self.strengths) != len(self.tray):
            allowed = f"must be {len(self.tray)} times four numbers"
            problems.append(Problem("strengths", self.strengths, allowed))
        refuse(problems)

    @property
    def parts(self) -> tuple[str, ...]:
        """The available components."""
        return self.tray

    def order_of(self, sequence: Sequence[str], parts: Iterable[int] | None = None) -> Order | None:
        """Return the components and orientations that form a sequence; None if some are missing.

        Of equal components, those that come first in `parts` are taken (by default, first on the
        tray). Components that `parts` does not list stay on the tray.
        """
        left, found = list(range(len(self.tray)) if parts is None else parts), cast("Order", [])
        for faces in sequence:
            pattern = PATTERNS.index(faces)
            for part in left:
                lies = np.flatnonzero(LYING[PATTERNS.index(self.tray[part])] == pattern)
                if lies.size:
                    left.remove(part)
                    found.append((part, int(lies[0])))
                    break
            else:
                return None
        return found


class AnchorTask(TrayTask):
    """A tray of components, the direction of feed and the pull that the fold must withstand.

    Any fold is allowed; the target is used only for the baseline and for shaping.
    """

    pull: Positive
    """Size of the pull [N]."""
    towards: float
    """Direction of the pull in the plane [rad]; 0 points away from the tube."""

    @property
    def aim(self) -> str:
        """The target and the pull."""
        return f"{self.target}-{self.pull:g}N-{self.towards:g}"


def task_list_names() -> list[str]:
    """Return the names of the shipped lists of tasks, sorted."""
    return sorted(path.stem for path in (configs_dir() / "tasks").glob("*.yaml"))


def read_tasks(
    tasks: str | Path | Sequence[Task | Mapping[str, Any]],
    kind: type[Task] = FeedTask,
    split: Split | None = None,
) -> tuple[Any, ...]:
    """Return the given tasks, or those of a shipped list (the easiest first) or of a YAML file.

    A list may have two sides, ``train`` and ``test``; `split` selects one (``train`` by default) or
    ``all`` tasks, those for training first.
    """
    path = Path(tasks) if isinstance(tasks, (str, Path)) else None
    if path is not None and str(tasks) in task_list_names():
        return _read(configs_dir() / "tasks" / f"{tasks}.yaml", kind, split)
    if path is None or not os.path.isfile(path):
        return _checked(tasks, kind, split)
    return _read.__wrapped__(path, kind, split)


@cache
def _read(path: Path, kind: type[Task], split: Split | None) -> tuple[Any, ...]:
    try:
        return _checked(cast("Any", parse_yaml(read_text(path, MOST_BYTES))), kind, split)
    except (OSError, ValueError) as error:
        problems = error.problems if isinstance(error, SceneError) else ()
        raise SceneError(problems or str(error), source=str(path)) from None


def _side(tasks: Any, split: Split | None) -> Any:
    """Return the tasks on the chosen side of a list with two sides, or the list itself."""
    sides: Mapping[str, Any] = cast("Any", tasks if isinstance(tasks, Mapping) else {})
    if set(sides) == set(SIDES):
        chosen = one_of("split", "train" if split is None else split, Split)
        return [task for side in SIDES if chosen in (side, "all") for task in sides[side] or ()]
    allowed = "must be left out, because the tasks have no sides train and test"
    require(split is None, "split", split, allowed)
    return cast("Any", tasks)


def _checked(tasks: object, kind: type[Task], split: Split | None) -> tuple[Any, ...]:
    """Return validated tasks; raise an error if one is invalid or chain lengths differ."""
    tasks = _side(tasks, split)
    listed = isinstance(tasks, (list, tuple))
    given = cast("list[Any]", tasks if listed else [None])
    right = all(isinstance(each, (Task, Mapping)) for each in given)
    allowed = "must be a list of tasks, the path of a file of them or one of "
    require(right, "tasks", tasks, allowed + ", ".join(task_list_names()))
    found = tuple(each if isinstance(each, kind) else kind(**dict(each)) for each in given)
    lengths = sorted({task.n for task in found})
    if len(lengths) != 1:
        raise ValueError(
            f"tasks: chains of {lengths} components are not allowed; must be one or more tasks "
            "of one length"
        )
    allowed = f"must be a fully folded word of {lengths[0]} components without overlap"
    for task in found:
        for key, word in zip(("target", "first"), task.words[::-1], strict=False):
            if not is_target(word, lengths[0]):
                raise SceneError([Problem(f"tasks.{key}", word, allowed)])
    return found
