"""Find chains whose folds depend on the feed.

**Two folds.** Random chains are fed out at constant speeds. The search keeps those that fold into
one word at one speed and into another word at another speed, each in at least three quarters of the
draws of ``nominal`` physics, so that the feed speed decides between two reachable folds. Every such
chain yields two tasks. The ease of a task is the share of all runs, over the available speeds, that
end in the target.

**Chambers.** Random chains are fed at constant speeds in eight draws of a separate stream, each
with a different chamber, floor and strength of magnets. A word makes a task if the chain reaches it
in at least six of the draws at some speed or other, but at no single speed in more than five. The
right speed then depends on what the draw hides. The search takes a chain's most frequent word of
this kind. The ease of a task is the share of all runs that end in the target.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import cycle
from typing import Any

import numpy as np

from magfold_env.envs.baselines.baseline import CANDIDATE_SPEEDS, draw_generator
from magfold_env.envs.chains.arrays import FOLDED
from magfold_env.envs.lumen import LumenEnv
from magfold_env.envs.spaces.actions import PATTERNS
from magfold_env.envs.tasks.draws import episode_seeds, randomised
from magfold_env.envs.tasks.feed_tasks import FeedTask
from magfold_env.envs.tasks.symmetry import Side, side_of
from magfold_env.envs.unknown_floor import FloorEpisodes
from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene, load_scene
from magfold_env.simulation.simulate import simulate

DRAWS = 8
RELIABLE = 0.75
"""Share of the draws in which one speed must lead to a word, for chains with two folds."""

AT_ONCE = 20
"""Number of chains tried in chambers in parallel."""

LEAST = 6
"""Smallest number of a chamber task's draws in which some speed must lead to the word."""

MOST = 5
"""Largest number of a chamber task's draws in which any single speed may lead to the word."""

NARROW_TUBE = {"bore": None, "loading": "preloaded", "force_limit": 1.0}
"""The feed with which the shipped chains were selected; the environment's tube is wider now."""

Found = tuple[float, FeedTask]


def random_faces(rng: np.random.Generator, size: int | tuple[int, int]) -> Any:
    """Return the faces of random components as nested lists of the given shape."""
    return np.array(PATTERNS)[rng.integers(len(PATTERNS), size=size)].tolist()


def random_chains(rng: np.random.Generator, count: int, side: Side | None) -> list[Any]:
    """Return chains of six random components, all on one side of the split if it is given."""
    chains: list[Any] = []
    while len(chains) < count:
        faces = random_faces(rng, 6)
        if side in (None, side_of(faces)):
            chains.append(faces)
    return chains


def find_two_folds(seed: int = 0) -> Iterator[Found]:
    """Yield tasks endlessly, two per chain, each with the share of runs that end in its target."""
    rng, scene = np.random.default_rng(seed), load_scene("tube-built")
    for direction in cycle(("forward", "backward")):
        found: list[Found] = []
        while not found:
            sequence = random_faces(rng, scene.n)
            found = _tasks(scene.replace(sequence=sequence, feed={"direction": direction}))
        yield from found


def _tasks(scene: Scene) -> list[Found]:
    """Return a chain's two tasks, or no task if the speed does not decide between two folds."""
    still = randomised(scene, "none")
    ends = {_fold(still.replace(feed={"speed": speed})) for speed in CANDIDATE_SPEEDS[::2]}
    if len(ends - {""}) <= 1:
        return []
    nominal = randomised(scene, "nominal")
    counts = {speed: count_words(nominal, speed) for speed in CANDIDATE_SPEEDS}
    words = sorted({word for count in counts.values() for word in count})
    enough = RELIABLE * DRAWS
    reliable = [w for w in words if w and max(each[w] for each in counts.values()) >= enough]
    if len(reliable) <= 1:
        return []
    return [_task(scene, counts, word) for word in reliable[:2]]


def _task(scene: Scene, counts: Mapping[float, Counter[str]], target: str) -> Found:
    share = sum(count[target] for count in counts.values()) / (DRAWS * len(counts))
    direction, sequence = scene.feed.direction, scene.sequence
    return share, FeedTask(sequence=sequence, direction=direction, target=target)


def count_words(scene: Scene, speed: float) -> Counter[str]:
    """Return how many draws fold into each word at a speed [m/s]; misfolds count as ""."""
    fed = scene.replace(feed={"speed": speed})
    return Counter(_fold(fed.draw(draw_generator("control", index))) for index in range(DRAWS))


def _fold(scene: Scene) -> str:
    """Return the word into which a scene folds, or an empty string if it misfolds."""
    fold = simulate(scene)
    return fold.word if fold.status is FoldStatus.FOLDED else ""


def find_chambers(
    direction: Any, seed: int = 0, threads: int = 1, side: Side | None = None
) -> Iterator[Found]:
    """Yield tasks endlessly, each with the share of runs that end in its target."""
    rng = np.random.default_rng([seed, direction == "forward"])
    while True:
        chains = random_chains(rng, AT_ONCE, side)
        # The targets do not matter yet.
        tasks = [FeedTask(sequence=each, direction=direction, target="LRLRL") for each in chains]
        for task, words in zip(tasks, words_at_speeds(tasks, threads), strict=True):
            had = [
                word for word in set(words.ravel()) - {""} if takes_several_speeds(words == word)
            ]
            if had:
                share, word = max((float((words == word).mean()), word) for word in had)
                yield share, task.model_copy(update={"target": word})


def takes_several_speeds(came: Any) -> bool:
    """Return whether a word needs several speeds; ``came`` (draws, speeds) marks its runs."""
    return bool(came.any(axis=1).sum() >= LEAST and came.sum(axis=0).max() <= MOST)


def words_at_speeds(
    tasks: list[FeedTask], threads: int = 1, draws: range = range(DRAWS), scene: Scene | None = None
) -> Any:
    """Return the words into which chains fold, (tasks, draws, speeds), or "" for misfolds.

    Without a scene, the tube is the one with which the shipped chains were selected.
    """
    shape = len(tasks), len(draws), len(CANDIDATE_SPEEDS)
    numbers, which, _ = (each.ravel() for each in np.indices(shape))
    speeds = np.resize(CANDIDATE_SPEEDS, numbers.size)
    seeds = np.array(episode_seeds("lumen", draws.stop), dtype=object)[draws][which].tolist()
    scene = scene or load_scene("lumen").replace(feed=NARROW_TUBE)
    episodes = FloorEpisodes(LumenEnv.make_setup(scene, tasks=tasks), numbers.size, threads)
    episodes.play(seeds, numbers.tolist(), lambda rows: (speeds[rows],))
    folded = episodes.arrays.status == FOLDED
    return np.where(folded, episodes.words(episodes.rows), "").reshape(shape)
