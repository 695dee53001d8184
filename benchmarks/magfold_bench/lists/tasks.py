"""Find the tasks of a shipped list: ``python -m magfold_bench.lists.tasks LIST``."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import islice
from typing import Annotated, Any, NamedTuple

import typer
from rich.progress import track

from magfold_bench.lists.feed_tasks import find_chambers, find_two_folds
from magfold_bench.lists.refold_tasks import OTHER_DRAWS, find_refolds
from magfold_bench.lists.tray_tasks import find_pulls, find_trays
from magfold_env.cli import options
from magfold_env.envs.tasks.feed_tasks import Task
from magfold_env.files import configs_dir, write_text

KEYS = ("sequence", "tray", "direction", "first", "pull", "towards", "target")
"""Entries of a task, in the order in which they are written."""

Found = tuple[float, Task]
"""The ease of a task, as a share or a number, and the task."""


class TaskList(NamedTuple):
    """A list of tasks to generate."""

    find: Callable[[int, int, int], Iterator[Any]]
    """Yields tasks, given the number per direction, a seed and the number of threads."""
    size: int
    """Number of tasks per direction of feed."""
    head: str
    """Comment at the top of the list, which describes its tasks."""


def of_each_direction(
    find: Callable[[str, int, int], Iterator[Any]], count: int, seed: int, threads: int
) -> Iterator[Any]:
    """Yield the same number of tasks for both directions of feed."""
    for direction in ("forward", "backward"):
        yield from islice(find(direction, seed, threads), count)


def two_folds(count: int, seed: int, threads: int) -> Iterator[Any]:
    """Yield tasks with chains that are fed forward and backward in turn, found on one thread."""
    return islice(find_two_folds(seed), 2 * count)


LISTS = {
    "two-folds-6": TaskList(
        two_folds,
        20,
        "# Chains with two folds, of which the feed speed decides, the easiest first. At the end\n"
        "# of each line: the share of runs at constant speeds that end in the target.\n",
    ),
    "chamber-6": TaskList(
        partial(of_each_direction, find_chambers),
        12,
        "# Chains whose folds take now this speed of the feed, now that, as the chamber is; the\n"
        "# easiest first. At the end of each line: the share of runs at constant speeds that end\n"
        "# in the target.\n",
    ),
    "two-words-6": TaskList(
        partial(of_each_direction, find_refolds),
        8,
        "# Chains that fold into two words, one after the other, the easiest first. At the end of\n"
        f"# each line: in how many of {OTHER_DRAWS} draws one schedule of push, pull and push led\n"
        "# to both.\n",
    ),
    "trays-6": TaskList(
        partial(of_each_direction, find_trays),
        12,
        "# Trays of components, and words that chains of some of them fold into, the easiest\n"
        "# first. At the end of each line: the share of runs at constant speeds, with sound\n"
        "# magnets, in which the minimiser's chain does.\n",
    ),
    "anchors-6": TaskList(
        partial(of_each_direction, find_pulls),
        12,
        "# Trays of components, and pulls that folds of some of them are to bear, the easiest\n"
        "# first. The target is the word of the minimiser's chain that bears its pull most often.\n"
        "# At the end of each line: the share of draws in which it does, at its best speed.\n",
    ),
}


def main(
    name: Annotated[str, typer.Argument(help=f"One of {', '.join(LISTS)}.")],
    count: Annotated[int | None, typer.Option(min=1)] = None,
    seed: int = 0,
    threads: int = 2,
) -> None:
    """Write ``configs/tasks/NAME.yaml`` with `count` tasks per direction of feed."""
    if name not in LISTS:
        raise typer.BadParameter(f"{name!r} is not allowed; must be one of {', '.join(LISTS)}")
    count = count or LISTS[name].size
    tasks = LISTS[name].find(count, seed, threads)
    text = text_of(name, list(track(tasks, name, total=2 * count)))
    write_text(configs_dir() / "tasks" / f"{name}.yaml", text)


def text_of(name: str, found: Sequence[Found]) -> str:
    """Return the text of a list of tasks, the easiest first."""
    head = f"{LISTS[name].head}# Made by `python -m magfold_bench.lists.tasks {name}`.\n"
    return head + "".join(map(_line, sorted(found, key=lambda each: -each[0])))


def _line(found: Found) -> str:
    ease, task = found
    content = task.model_dump(exclude_none=True)
    values = {
        key: value if isinstance(value := content[key], (str, float)) else f"[{', '.join(value)}]"
        for key in sorted(content, key=KEYS.index)
    }
    entries = ", ".join(f"{key}: {value}" for key, value in values.items())
    return f"- {{{entries}}} # {ease if isinstance(ease, int) else f'{ease:.2f}'}\n"


if __name__ == "__main__":
    options.application_of(main)()
