"""Find the tasks of the chamber: ``python -m magfold_env.envs.tasks.make_chamber_tasks``.

Random chains are fed at constant speeds on draws of a stream of their own, each of another chamber,
floor and strength of magnets. A word makes a task if it can be had, in at least six draws of eight
at one speed or another, and if what is hidden decides at which: no speed leads to it in more than
five. Of a chain's words the one that most runs end in is taken. Tasks are ordered by the share of
all runs that end in the target: the easiest first.
"""

from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np
import typer
from rich.progress import track

from magfold_env.envs.baselines.baseline import CANDIDATE_SPEEDS
from magfold_env.envs.chains.arrays import FOLDED
from magfold_env.envs.spaces.actions import PATTERNS
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.envs.tasks.feed_tasks import ChamberWorld, FeedTask
from magfold_env.envs.unknown_floor import FloorEpisodes
from magfold_env.files import configs_dir, write_text

AT_ONCE = 20
"""Chains that are tried side by side."""

DRAWS = 8
LEAST = 6
"""Of the draws, in how many some speed must lead to a word."""

MOST = 5
"""Of the draws, in how many one speed may."""

Found = tuple[float, FeedTask]


def main(chains: int = 12, seed: int = 0, threads: int = 2) -> None:
    """Write ``configs/tasks/chamber-6.yaml`` with so many chains of each direction of feed."""
    found: list[Found] = []
    for direction in ("forward", "backward"):
        tasks = islice(find_tasks(direction, seed, threads), chains)
        found += track(tasks, direction, total=chains)
    lines = [
        f"- {{sequence: [{', '.join(task.sequence)}], direction: {task.direction}, "
        f"target: {task.target}}} # {share:.2f}"
        for share, task in sorted(found, key=lambda each: -each[0])
    ]
    head = (
        "# Chains whose folds take now this speed of the feed, now that, as the chamber is; the\n"
        "# easiest first. At the end of each line: the share of runs at constant speeds that end\n"
        "# in the target. Made by `python -m magfold_env.envs.tasks.make_chamber_tasks`.\n"
    )
    write_text(configs_dir() / "tasks" / "chamber-6.yaml", head + "\n".join(lines) + "\n")


def find_tasks(direction: Any, seed: int = 0, threads: int = 1) -> Iterator[Found]:
    """Yield tasks without end, and the shares of runs that end in their targets."""
    rng = np.random.default_rng([seed, direction == "forward"])
    while True:
        chains = np.array(PATTERNS)[rng.integers(len(PATTERNS), size=(AT_ONCE, 6))].tolist()
        # What they are asked for does not matter yet.
        tasks = [FeedTask(sequence=each, direction=direction, target="LRLRL") for each in chains]
        for task, words in zip(tasks, words_at_speeds(tasks, threads), strict=True):
            had = [
                word for word in set(words.ravel()) - {""} if takes_several_speeds(words == word)
            ]
            if had:
                share, word = max((float((words == word).mean()), word) for word in had)
                yield share, task.model_copy(update={"target": word})


def takes_several_speeds(came: Any) -> bool:
    """Return whether a word that came in some runs, (draws, speeds), takes now this, now that."""
    return bool(came.any(axis=1).sum() >= LEAST and came.sum(axis=0).max() <= MOST)


def words_at_speeds(tasks: list[FeedTask], threads: int = 1) -> Any:
    """Return the words that chains fold into, (tasks, draws, speeds), "" where they do not."""
    shape = len(tasks), DRAWS, len(CANDIDATE_SPEEDS)
    numbers, draws, _ = (each.ravel() for each in np.indices(shape))
    speeds = np.resize(CANDIDATE_SPEEDS, numbers.size)
    seeds = np.array(episode_seeds("lumen", DRAWS), dtype=object)[draws].tolist()
    episodes = FloorEpisodes(ChamberWorld("lumen", tasks=tasks), numbers.size, threads)
    episodes.play(seeds, numbers.tolist(), lambda rows: (speeds[rows],))
    folded = episodes.arrays.status == FOLDED
    return np.where(folded, episodes.words(episodes.rows), "").reshape(shape)


if __name__ == "__main__":
    typer.run(main)
