"""Find the shipped pulls: ``python -m magfold_env.envs.tasks.make_anchor_tasks``.

Trays of random components and pulls are drawn: 0.2 to 1 N, evenly on a scale of powers, towards any
direction within a right angle of straight away from the tube. For every word the minimiser's chain
from the tray is fed at the middle speed, with all that an episode draws; of the word whose chain
bears the pull most often, every speed is tried. Kept are those that bear it at the best speed in a
quarter to three quarters of the draws: the pull is neither out of reach nor borne by any fold. They
are ordered by that share, the easiest first.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from typing import Any

import numpy as np
import typer
from rich.progress import track

from magfold_env.envs.anchor import AnchorEpisodes
from magfold_env.envs.baselines.tray_order import TrayDesigns
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.spaces.actions import PATTERNS
from magfold_env.envs.tasks.anchor_tasks import AnchorTask, AnchorWorld
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.envs.tasks.make_tray_tasks import SPARE
from magfold_env.files import configs_dir, write_text
from magfold_env.scene import load_scene
from magfold_env.shapes import folded_words

SCENE = "anchor-tray"
FIRST_DRAWS, DRAWS = 8, 32
LEAST, MOST = 0.25, 0.75
WEAKEST, STRONGEST = 0.2, 1.0

Found = tuple[float, AnchorTask]


def main(pulls: int = 12, seed: int = 0, threads: int = 2) -> None:
    """Write ``configs/tasks/anchors-6.yaml`` with so many pulls for each direction of feed."""
    scene = load_scene(SCENE)
    words = track(folded_words(scene.n), "chains of every word")
    designs = {str(word): TrayDesigns(scene, str(word)) for word in words}
    found: list[Found] = []
    for direction in ("forward", "backward"):
        tasks = islice(find_tasks(direction, designs, seed, threads), pulls)
        found += track(tasks, direction, total=pulls)
    save(found)


def find_tasks(
    direction: Any, designs: Mapping[str, TrayDesigns], seed: int = 0, threads: int = 1
) -> Iterator[Found]:
    """Yield tasks without end, and the share of draws in which their chains bear the pull."""
    rng, n = np.random.default_rng([seed, direction == "forward"]), load_scene(SCENE).n
    while True:
        numbers: list[int] = rng.integers(len(PATTERNS), size=n + SPARE).tolist()
        tray = tuple(PATTERNS[number] for number in numbers)
        towards = round(float(rng.uniform(-0.5, 0.5) * np.pi), 2)
        pull = round(float(WEAKEST * (STRONGEST / WEAKEST) ** rng.random()), 2)
        given: dict[str, Any] = {
            "tray": tray,
            "direction": direction,
            "pull": pull,
            "towards": towards,
        }
        chains = {word: each.best(tray) for word, each in designs.items()}
        tasks = [AnchorTask(target=word, **given) for word, chain in chains.items() if chain]
        if not tasks:
            continue
        sequences: list[Any] = [chains[task.target] for task in tasks]
        speeds: Floats = AnchorWorld(SCENE, tasks=tasks).actions.speeds
        middle = speeds[len(speeds) // 2 : len(speeds) // 2 + 1]
        first = shares_of(tasks, sequences, middle, FIRST_DRAWS, threads)[:, 0]
        best = int(np.argmax(first))
        if first[best] < LEAST:
            continue
        share = shares_of(tasks[best : best + 1], sequences[best:], speeds, DRAWS, threads).max()
        if LEAST <= share <= MOST:
            yield float(share), tasks[best]


def shares_of(
    tasks: Sequence[AnchorTask],
    sequences: Sequence[tuple[str, ...]],
    speeds: Floats,
    draws: int,
    threads: int = 1,
) -> Floats:
    """Return in what share of the draws chains bear their pulls, (tasks, speeds)."""
    orders: list[Ints] = []
    for task, sequence in zip(tasks, sequences, strict=False):
        order = np.array(task.order_of(sequence))
        orders.append(order if task.direction == "forward" else order[::-1])
    fed, count = np.array(orders), len(tasks) * draws
    episodes = AnchorEpisodes(AnchorWorld(SCENE, tasks=list(tasks)), count, threads)
    numbers, seeds = np.repeat(np.arange(len(tasks)), draws), episode_seeds("anchor", draws)
    found = np.empty((len(tasks), len(speeds)))
    for place, speed in enumerate(speeds):

        def choose(rows: Ints, speed: float = speed) -> Any:
            next_ones = np.minimum(episodes.arrays.fed[rows], fed.shape[1] - 1)
            part, lie = fed[numbers[rows], next_ones].T
            return part, lie, np.full(len(rows), speed), np.zeros(len(rows), dtype=np.int64)

        ends = episodes.play(seeds * len(tasks), numbers.tolist(), choose)
        found[:, place] = ends["is_success"].reshape(len(tasks), draws).mean(axis=1)
    return found


def save(found: list[Found]) -> None:
    """Write tasks, the easiest first."""
    lines = [
        f"- {{tray: [{', '.join(task.tray)}], direction: {task.direction}, pull: {task.pull}, "
        f"towards: {task.towards}, target: {task.target}}} # {share:.2f}"
        for share, task in sorted(found, key=lambda each: -each[0])
    ]
    head = (
        "# Trays of components, and pulls that folds of some of them are to bear, the easiest\n"
        "# first. The target is the word of the minimiser's chain that bears its pull most often.\n"
        "# At the end of each line: the share of draws in which it does, at its best speed.\n"
        "# Made by `python -m magfold_env.envs.tasks.make_anchor_tasks`.\n"
    )
    write_text(configs_dir() / "tasks" / "anchors-6.yaml", head + "\n".join(lines) + "\n")


if __name__ == "__main__":
    typer.run(main)
