"""Many folds at once, on all cores."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from magfold_env.fold import Fold
from magfold_env.scene import Problem, Scene, SceneError
from magfold_env.simulation.simulate import simulate


def simulate_batch(
    scenes: Scene | Sequence[Scene],
    seeds: Iterable[int | np.random.Generator],
    *,
    threads: int | None = None,
    frame_rate: float | None = None,
) -> list[Fold]:
    """Simulate many folds on several threads; the kernels hold no lock while they run.

    Every fold is, bit for bit, the one that `simulate` gives for its scene and seed, whatever the
    number of threads.

    Parameters
    ----------
    scenes
        What to fold: one scene for all seeds, or one for each.
    seeds
        One a fold, see `simulate`.
    threads
        How many folds run at a time; None takes as many as there are cores.
    frame_rate
        Frames recorded a simulated second [1/s]; None records no trajectories.

    Returns
    -------
    list of Fold
        In the order of the seeds.

    Raises
    ------
    SceneError
        If there are not as many scenes as seeds, or ``threads`` is not positive.
    """
    draws = list(seeds)
    chosen = [scenes] * len(draws) if isinstance(scenes, Scene) else list(scenes)
    if len(chosen) != len(draws):
        message = f"must be one, or as many as the {len(draws)} seeds"
        raise SceneError([Problem("scenes", len(chosen), message)])
    workers = (os.cpu_count() or 1) if threads is None else threads
    if workers < 1:
        raise SceneError([Problem("threads", threads, "must be at least 1")])

    def run(scene: Scene, seed: int | np.random.Generator) -> Fold:
        return simulate(scene, seed, frame_rate=frame_rate)

    if workers == 1 or len(draws) < 2:
        return [run(scene, seed) for scene, seed in zip(chosen, draws, strict=True)]
    with ThreadPoolExecutor(workers, thread_name_prefix="fold") as pool:
        return list(pool.map(run, chosen, draws))
