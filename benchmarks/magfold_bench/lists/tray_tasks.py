"""Find trays from which words can be folded, and pulls that folds can withstand.

**Trays** of random components are drawn, each with a word. The search keeps a tray if, whichever
one of its components is missing, the minimiser finds a chain whose only ground state is the word.
In addition, the best chain with sound magnets must fold into the word at some constant speed in at
least three quarters of the draws. The ease of a task is the share of all such runs, over the
available speeds, that end in the word.

**Pulls** are drawn with trays, log-uniformly from 0.2 to 1 N and in any direction that points away
from the tube. For every word, the minimiser's chain from the tray is fed at the middle speed in a
few randomised episodes. The chain that withstands the pull most often is then tried at every speed.
The search keeps pulls that this chain withstands in a quarter to three quarters of the draws at its
best speed, so that pulls are neither impossible nor trivial. The share is the ease of the task.
"""

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

import numpy as np
from rich.progress import track

from magfold_bench.lists.feed_tasks import random_faces
from magfold_env.envs.anchor import AnchorEnv, AnchorEpisodes
from magfold_env.envs.baselines.tray_order import TrayDesigns, always
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.envs.tasks.feed_tasks import AnchorTask, TrayTask
from magfold_env.envs.tray import TrayEnv, TrayEpisodes
from magfold_env.scene import load_scene
from magfold_env.shapes import folded_words

TRAY_SCENE, ANCHOR_SCENE = "tray", "anchor-tray"

SPARE = 3
"""Number of surplus components on a tray."""

SOUND_DRAWS = 16
RELIABLE = 0.75
"""Share of the draws in which a tray's chain must fold at some speed."""

FIRST_DRAWS, BORNE_DRAWS = 8, 32
LEAST, MOST = 0.25, 0.75
"""Smallest and largest share of the draws in which a chain may withstand its pull."""

WEAKEST, STRONGEST = 0.2, 1.0
"""Smallest and largest pull [N]."""


def find_trays(direction: Any, seed: int = 0, threads: int = 1) -> Iterator[tuple[float, TrayTask]]:
    """Yield tasks endlessly, each with the share of runs that end in its word."""
    rng, n = np.random.default_rng([seed, direction == "forward"]), load_scene(TRAY_SCENE).n
    words = folded_words(n)
    while True:
        word = str(words[rng.integers(len(words))])
        tray = _random_tray(rng, n)
        rests = [tray[:k] + tray[k + 1 :] for k in range(len(tray))]
        design = _designs(TRAY_SCENE, word)
        if all(design.best(rest) for rest in rests):
            task = TrayTask(tray=tray, direction=direction, target=word)
            sequence = design.best(tray)
            assert sequence is not None
            shares = sound_shares(task, sequence, threads)
            if max(shares) >= RELIABLE:
                yield sum(shares) / len(shares), task


def sound_shares(task: TrayTask, sequence: tuple[str, ...], threads: int = 1) -> list[float]:
    """Return, for every speed, the share of draws in which a chain with sound magnets folds."""
    sound = task.model_copy(update={"strengths": ((1.0,) * 4,) * len(task.tray)})
    setup, order = TrayEnv.make_setup(TRAY_SCENE, tasks=[sound]), task.order_of(sequence)
    assert order is not None
    episodes, seeds = TrayEpisodes(setup, SOUND_DRAWS, threads), episode_seeds("tray", SOUND_DRAWS)
    shares: list[float] = []
    for speed in setup.actions.speeds.tolist():
        plan = always(task, order, speed)
        ends = episodes.play(seeds, [0] * SOUND_DRAWS, lambda rows, plan=plan: plan(episodes, rows))
        shares.append(float(ends["is_success"].mean()))
    return shares


def find_pulls(
    direction: Any, seed: int = 0, threads: int = 1
) -> Iterator[tuple[float, AnchorTask]]:
    """Yield tasks endlessly, each with the share of draws in which a chain withstands the pull."""
    rng, n = np.random.default_rng([seed, direction == "forward"]), load_scene(ANCHOR_SCENE).n
    words = track(folded_words(n), "chains of every word")
    designs = {str(word): _designs(ANCHOR_SCENE, str(word)) for word in words}
    while True:
        tray = _random_tray(rng, n)
        towards = round(float(rng.uniform(-0.5, 0.5) * np.pi), 2)
        pull = round(float(WEAKEST * (STRONGEST / WEAKEST) ** rng.random()), 2)
        given: Any = {"tray": tray, "direction": direction, "pull": pull, "towards": towards}
        chains = {word: each.best(tray) for word, each in designs.items()}
        tasks = [AnchorTask(target=word, **given) for word, chain in chains.items() if chain]
        if not tasks:
            continue
        sequences: list[Any] = [chains[task.target] for task in tasks]
        speeds: Floats = AnchorEnv.make_setup(ANCHOR_SCENE, tasks=tasks).actions.speeds
        middle = speeds[len(speeds) // 2 : len(speeds) // 2 + 1]
        first = shares_borne(tasks, sequences, middle, FIRST_DRAWS, threads)[:, 0]
        best = int(np.argmax(first))
        if first[best] < LEAST:
            continue
        task = tasks[best]
        share = shares_borne([task], sequences[best:], speeds, BORNE_DRAWS, threads).max()
        if LEAST <= share <= MOST:
            yield float(share), task


def shares_borne(
    tasks: Sequence[AnchorTask],
    sequences: Sequence[tuple[str, ...]],
    speeds: Floats,
    draws: int,
    threads: int = 1,
) -> Floats:
    """Return the share of draws in which chains withstand their pulls, (tasks, speeds)."""
    orders: list[Ints] = []
    for task, sequence in zip(tasks, sequences, strict=False):
        order = np.array(task.order_of(sequence))
        orders.append(task.as_fed(order))
    fed, count = np.array(orders), len(tasks) * draws
    episodes = AnchorEpisodes(AnchorEnv.make_setup(ANCHOR_SCENE, tasks=list(tasks)), count, threads)
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


def _random_tray(rng: np.random.Generator, n: int) -> tuple[str, ...]:
    return tuple(random_faces(rng, n + SPARE))


@cache
def _designs(scene: str, word: str) -> TrayDesigns:
    return TrayDesigns(load_scene(scene), word)
