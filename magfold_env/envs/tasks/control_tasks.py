"""Chains with two folds, of which the feed speed decides: the tasks of feed control."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import yaml

from magfold_env.envs.tasks.targets import is_target
from magfold_env.files import configs_dir
from magfold_env.scene import Problem, SceneError
from magfold_env.scene.parts import Part


class ControlTask(Part):
    """A chain, how it is fed, the fold to reach and the one to avoid."""

    sequence: tuple[str, ...]
    """The components, component 1 first."""
    direction: Literal["forward", "backward"]
    """Direction of feed."""
    target: str
    """Word to reach."""
    avoid: str
    """Word that is worth nothing."""


def control_suite_names() -> list[str]:
    """Return the names of the shipped lists of tasks, sorted."""
    return sorted(path.stem for path in (configs_dir() / "control").glob("*.yaml"))


def read_tasks(tasks: str | Sequence[ControlTask | Mapping[str, Any]]) -> tuple[ControlTask, ...]:
    """Return the tasks of a shipped list, the easiest first, or those given.

    Raises
    ------
    ValueError
        If there is no such list, it is empty, or its chains have different lengths.
    SceneError
        If a task is not valid; one line per problem.
    """
    given: Sequence[ControlTask | Mapping[str, Any]]
    if isinstance(tasks, str) and tasks in control_suite_names():
        path = configs_dir() / "control" / f"{tasks}.yaml"
        given = yaml.safe_load(path.read_text(encoding="utf-8"))
    elif isinstance(tasks, (list, tuple)) and all(map(_is_task, tasks)):
        given = tasks
    else:
        raise ValueError(
            f"tasks: {tasks!r} is not allowed; must be a list of tasks or one of "
            f"{', '.join(control_suite_names())}"
        )
    found = tuple(each if isinstance(each, ControlTask) else ControlTask(**each) for each in given)
    lengths = sorted({len(task.sequence) for task in found})
    if len(lengths) != 1:
        raise ValueError(
            f"tasks: chains of {lengths} components are not allowed; must be one or more tasks "
            "of one length"
        )
    for task in found:
        _check_words(task)
    return found


def _is_task(value: object) -> bool:
    return isinstance(value, (ControlTask, Mapping))


def _check_words(task: ControlTask) -> None:
    """Refuse words that the chain of a task cannot fold into."""
    n = len(task.sequence)
    wrong = [key for key in ("target", "avoid") if not is_target(getattr(task, key), n)]
    if wrong:
        allowed = f"must be a fully folded word of {n} components without overlap"
        raise SceneError([Problem(f"tasks.{key}", getattr(task, key), allowed) for key in wrong])
    if task.target == task.avoid:
        raise SceneError([Problem("tasks.avoid", task.avoid, "must differ from the target")])
