"""Find the shipped tasks of a chain's feed: ``python -m magfold_env.envs.tasks.make_feed_tasks``.

Random chains are fed out at constant speeds. Kept are those that fold into one word at one speed
and into another at another, each in at least three of four draws of the nominal physics: the feed
speed decides, and both folds can be had. Every such chain makes two tasks. Tasks are ordered by the
share of all runs, over the speeds on offer, that end in the target: the easiest first.
"""

from collections import Counter
from collections.abc import Mapping

import numpy as np
import typer
from rich.progress import track

from magfold_env.envs.baselines.baseline import CANDIDATE_SPEEDS, draw_generator
from magfold_env.envs.spaces.actions import PATTERNS
from magfold_env.envs.tasks.draws import randomised
from magfold_env.files import configs_dir, write_text
from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene, load_scene
from magfold_env.simulation.simulate import simulate

DRAWS = 8
RELIABLE = 0.75

Task = tuple[float, tuple[str, ...], str, str]


def main(chains: int = 20, seed: int = 0) -> None:
    """Write ``configs/tasks/two-folds-6.yaml`` with two tasks for each of some chains."""
    rng = np.random.default_rng(seed)
    scene = load_scene("tube-built")
    tasks: list[Task] = []
    for number in track(range(chains), "chains with two folds"):
        found: list[Task] = []
        while not found:
            numbers = rng.integers(len(PATTERNS), size=scene.n)
            sequence = tuple(PATTERNS[int(number)] for number in numbers)
            direction = ("forward", "backward")[number % 2]
            found = _tasks(scene.replace(sequence=sequence, feed={"direction": direction}))
        tasks += found
    tasks.sort(key=lambda task: -task[0])
    lines = [
        f"- {{sequence: [{', '.join(sequence)}], direction: {direction}, "
        f"target: {target}}} # {share:.2f}"
        for share, sequence, direction, target in tasks
    ]
    head = (
        "# Chains with two folds, of which the feed speed decides, the easiest first. At the\n"
        "# end of each line: the share of runs at constant speeds that end in the target.\n"
        "# Made by `python -m magfold_env.envs.tasks.make_feed_tasks`.\n"
    )
    path = configs_dir() / "tasks" / "two-folds-6.yaml"
    write_text(path, head + "\n".join(lines) + "\n")


def _tasks(scene: Scene) -> list[Task]:
    """Return the two tasks of a chain, or none if its speed does not decide between two folds."""
    still = randomised(scene, "none")
    ends = {_fold(still.replace(feed={"speed": speed})) for speed in CANDIDATE_SPEEDS[::2]}
    if len(ends - {""}) <= 1:
        return []
    nominal = randomised(scene, "nominal")
    counts = {speed: count_words(nominal, speed) for speed in CANDIDATE_SPEEDS}
    words = sorted({word for count in counts.values() for word in count})
    reliable = [word for word in words if _is_reliable(counts, word)]
    if len(reliable) <= 1:
        return []
    return [_task(scene, counts, word) for word in reliable[:2]]


def _task(scene: Scene, counts: Mapping[float, Counter[str]], target: str) -> Task:
    share = sum(count[target] for count in counts.values()) / (DRAWS * len(counts))
    return share, scene.sequence, scene.feed.direction, target


def _is_reliable(counts: Mapping[float, Counter[str]], word: str) -> bool:
    """Return whether some speed brings a fold about."""
    return bool(word) and max(count[word] for count in counts.values()) >= RELIABLE * DRAWS


def count_words(scene: Scene, speed: float) -> Counter[str]:
    """Count the words that draws of a scene fold into at a speed [m/s]; misfolds have none."""
    fed = scene.replace(feed={"speed": speed})
    return Counter(_fold(fed.draw(draw_generator("control", index))) for index in range(DRAWS))


def _fold(scene: Scene) -> str:
    """Return the word that a scene folds into; the empty one if it misfolds."""
    fold = simulate(scene)
    return fold.word if fold.status is FoldStatus.FOLDED else ""


if __name__ == "__main__":
    typer.run(main)
