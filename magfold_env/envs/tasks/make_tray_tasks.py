"""Find the shipped trays: ``python -m magfold_env.envs.tasks.make_tray_tasks``.

Trays of random components, and words, are drawn. Kept are those from which, whichever component is
left out, the minimiser has a chain whose only ground state is the word, and whose best chain, with
sound magnets, folds into it at some constant speed in at least three of four draws. Tasks are
ordered by the share of all such runs, over the speeds on offer, that end in the word: the easiest
first.
"""

from collections.abc import Iterator
from functools import cache
from itertools import islice
from typing import Any

import numpy as np
import typer
from rich.progress import track

from magfold_env.envs.baselines.tray_order import TrayDesigns, always
from magfold_env.envs.spaces.actions import PATTERNS
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.envs.tasks.tray_tasks import TrayTask, TrayWorld
from magfold_env.envs.tray import TrayEpisodes
from magfold_env.files import configs_dir, write_text
from magfold_env.scene import load_scene
from magfold_env.shapes import folded_words

SCENE = "tray"
DRAWS = 16
RELIABLE = 0.75

SPARE = 3
"""Components that are left over."""

Found = tuple[float, TrayTask]


def main(trays: int = 12, seed: int = 0, threads: int = 2) -> None:
    """Write ``configs/tasks/trays-6.yaml`` with so many trays of each direction of feed."""
    found: list[Found] = []
    for direction in ("forward", "backward"):
        tasks = islice(find_tasks(direction, seed, threads), trays)
        found += track(tasks, direction, total=trays)
    save(found)


def find_tasks(direction: Any, seed: int = 0, threads: int = 1) -> Iterator[Found]:
    """Yield tasks without end, and the share of runs that end in their words."""
    rng = np.random.default_rng([seed, direction == "forward"])
    scene = load_scene(SCENE)
    words = folded_words(scene.n)

    @cache
    def designs(word: str) -> TrayDesigns:
        return TrayDesigns(scene, word)

    while True:
        word = str(words[rng.integers(len(words))])
        numbers: list[int] = rng.integers(len(PATTERNS), size=scene.n + SPARE).tolist()
        tray = tuple(PATTERNS[number] for number in numbers)
        rests = [tray[:k] + tray[k + 1 :] for k in range(len(tray))]
        if all(designs(word).best(rest) for rest in rests):
            task = TrayTask(tray=tray, direction=direction, target=word)
            sequence = designs(word).best(tray)
            assert sequence is not None
            shares = shares_of(task, sequence, threads)
            if max(shares) >= RELIABLE:
                yield sum(shares) / len(shares), task


def shares_of(task: TrayTask, sequence: tuple[str, ...], threads: int = 1) -> list[float]:
    """Return in what share of the draws a chain of sound magnets folds, for every speed."""
    sound = task.model_copy(update={"strengths": ((1.0,) * 4,) * len(task.tray)})
    world, order = TrayWorld(SCENE, tasks=[sound]), task.order_of(sequence)
    assert order is not None
    episodes, seeds = TrayEpisodes(world, DRAWS, threads), episode_seeds("tray", DRAWS)
    shares: list[float] = []
    for speed in world.actions.speeds.tolist():
        plan = always(task, order, speed)
        ends = episodes.play(seeds, [0] * DRAWS, lambda rows, plan=plan: plan(episodes, rows))
        shares.append(float(ends["is_success"].mean()))
    return shares


def save(found: list[Found]) -> None:
    """Write tasks, the easiest first."""
    lines = [
        f"- {{tray: [{', '.join(task.tray)}], direction: {task.direction}, "
        f"target: {task.target}}} # {share:.2f}"
        for share, task in sorted(found, key=lambda each: -each[0])
    ]
    head = (
        "# Trays of components, and words that chains of some of them fold into, the easiest\n"
        "# first. At the end of each line: the share of runs at constant speeds, with sound\n"
        "# magnets, in which the minimiser's chain does.\n"
        "# Made by `python -m magfold_env.envs.tasks.make_tray_tasks`.\n"
    )
    write_text(configs_dir() / "tasks" / "trays-6.yaml", head + "\n".join(lines) + "\n")


if __name__ == "__main__":
    typer.run(main)
