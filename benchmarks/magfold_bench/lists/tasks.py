"""Find the tasks of a shipped list: ``python -m magfold_bench.lists.tasks LIST``.

Lists of environments with the version v0 have a few tasks. Those of later versions have tasks for
training and for tests, on the two sides of a split (`magfold_env.envs.tasks.symmetry.side_of`).
They are found in blocks of `BLOCK` chains, each with a seed of its own, by several processes; a run
that was interrupted continues after the last complete block.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from functools import partial
from itertools import count as count_from
from itertools import groupby, islice
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer
from rich.progress import Progress, track

from magfold_bench.lists.feed_tasks import find_chambers, find_two_folds
from magfold_bench.lists.refold_tasks import OTHER_DRAWS, find_refolds
from magfold_bench.lists.tray_tasks import find_pulls, find_trays
from magfold_env.checkpoint import Checkpoint
from magfold_env.cli import options
from magfold_env.envs.tasks.feed_tasks import FeedTask, RefoldTask, Task
from magfold_env.envs.tasks.symmetry import SIDES, Side, orbit, side_of
from magfold_env.files import configs_dir, write_text
from magfold_env.parallel import Workers, finished

KEYS = ("sequence", "tray", "direction", "first", "pull", "towards", "target")
"""Entries of a task, in the order in which they are written."""

DIRECTIONS = ("forward", "backward")

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
    for direction in DIRECTIONS:
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


BLOCK = 20
"""Number of chains that are found with one seed."""


class SplitList(NamedTuple):
    """A list of tasks for training and for tests."""

    find: Callable[[int], Iterator[Any]]
    """Yields tasks endlessly, those of one chain in a row, given a seed."""
    kind: type[Task]
    """Type of the tasks."""
    like: str
    """Name of the list that the same recipe found before."""
    sizes: tuple[int, int] = (1000, 200)
    """Numbers of chains for training and for tests."""


def in_turn(find: Callable[..., Iterator[Any]], seed: int, **options: Any) -> Iterator[Any]:
    """Return the tasks of a block; those of even seeds are fed forward, of odd ones backward."""
    return find(DIRECTIONS[seed % 2], seed, **options)


def in_turn_by_side(find: Callable[..., Iterator[Any]], seed: int) -> Iterator[Any]:
    """Return the tasks of a block; three blocks in five are for training, the others for tests.

    One chain in six is for tests, so a search on both sides would discard most of its chains.
    """
    return in_turn(find, seed, side="train" if seed % 5 < 3 else "test")


SPLIT_LISTS = {
    "two-folds-6-v1": SplitList(find_two_folds, FeedTask, "two-folds-6"),
    # The search takes more than an hour of processor time for 1,200 chains.
    "chamber-6-v1": SplitList(
        partial(in_turn_by_side, find_chambers), FeedTask, "chamber-6", (300, 200)
    ),
    "two-words-6-v1": SplitList(partial(in_turn, find_refolds), RefoldTask, "two-words-6"),
}


def main(
    name: Annotated[str, typer.Argument(help=f"One of {', '.join([*LISTS, *SPLIT_LISTS])}.")],
    count: Annotated[int | None, typer.Option(min=1)] = None,
    seed: int = 0,
    threads: int = 2,
    state: Annotated[Path, typer.Option(help="Folder of unfinished lists.")] = Path("runs/lists"),
) -> None:
    """Write ``configs/tasks/NAME.yaml``.

    `count` is the number of tasks per direction of feed, and applies to lists without a split.
    """
    if name in SPLIT_LISTS:
        text = split_text(name, find_split(SPLIT_LISTS[name], name, seed, threads, state / name))
    elif name in LISTS:
        count = count or LISTS[name].size
        tasks = LISTS[name].find(count, seed, threads)
        text = text_of(name, list(track(tasks, name, total=2 * count)))
    else:
        names = ", ".join([*LISTS, *SPLIT_LISTS])
        raise typer.BadParameter(f"{name!r} is not allowed; must be one of {names}")
    write_text(configs_dir() / "tasks" / f"{name}.yaml", text)


def find_split(
    wanted: SplitList, name: str, seed: int, processes: int, state: Path
) -> dict[Side, list[Found]]:
    """Return the tasks of a list on both sides of its split, with the ease of each.

    The result does not depend on the number of processes. A chain counts once, also if the search
    finds another image of it (`magfold_env.envs.tasks.symmetry.orbit`).
    """
    chains: dict[Side, list[list[Found]]] = {side: [] for side in SIDES}
    sizes = dict(zip(SIDES, wanted.sizes, strict=True))
    seen: set[frozenset[Any]] = set()
    with Checkpoint(state, {"list": name, "seed": seed}) as kept, Progress() as progress:
        bar = progress.add_task(name, total=sum(sizes.values()))
        blocks = _blocks(wanted, kept, seed, processes)
        while any(len(chains[side]) < sizes[side] for side in SIDES):
            for chain in next(blocks):
                sequence = chain[0][1].parts
                side, images = side_of(sequence), orbit(sequence)
                if images not in seen and len(chains[side]) < sizes[side]:
                    seen.add(images)
                    chains[side].append(chain)
                    progress.advance(bar)
        blocks.close()
    return {side: [found for chain in chains[side] for found in chain] for side in SIDES}


def _blocks(
    wanted: SplitList, kept: Checkpoint, seed: int, processes: int
) -> Generator[list[list[Found]]]:
    """Yield blocks of chains in order, first those that are stored; store new ones."""
    make: Any = wanted.kind.model_validate
    done: list[Any] = kept.load()
    for block in done:
        yield [[(ease, make(task)) for ease, task in chain] for chain in block]
    workers = Workers(processes, "processes")
    for first in count_from(len(done), 2 * processes):
        seeds = [1_000 * (seed + 1) + k for k in range(first, first + 2 * processes)]
        results = dict(finished(partial(_block, wanted.find), seeds, workers))
        for place in range(len(seeds)):
            block: list[list[Found]] = results[place]
            kept.add([[(ease, task.model_dump()) for ease, task in chain] for chain in block])
            yield block


def _block(find: Callable[[int], Iterator[Found]], seed: int) -> list[list[Found]]:
    """Return the tasks of the first chains that a search finds, chain by chain."""
    by_chain = groupby(find(seed), key=lambda found: found[1].parts)
    return [list(tasks) for _, tasks in islice(by_chain, BLOCK)]


def split_text(name: str, found: dict[Side, list[Found]]) -> str:
    """Return the text of a list with two sides, each with the easiest tasks first."""
    head = _head(LISTS[SPLIT_LISTS[name].like].head, name)
    return head + "".join(f"{side}:\n{_lines(found[side])}" for side in SIDES)


def text_of(name: str, found: Sequence[Found]) -> str:
    """Return the text of a list of tasks, the easiest first."""
    return _head(LISTS[name].head, name) + _lines(found)


def _head(text: str, name: str) -> str:
    return f"{text}# Made by `python -m magfold_bench.lists.tasks {name}`.\n"


def _lines(found: Sequence[Found]) -> str:
    return "".join(map(_line, sorted(found, key=lambda each: -each[0])))


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
