"""Compute the shipped baselines: ``python -m magfold_env.envs.baselines.make_baselines``."""

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import typer
from rich.progress import Progress

from magfold_env.envs.anchor import AnchorEpisodes
from magfold_env.envs.baselines.baseline import (
    Baseline,
    baseline_key,
    designs,
    evaluate_design,
    save_shipped,
)
from magfold_env.envs.baselines.constant_speed import TaskStore
from magfold_env.envs.reprogram import three_speeds
from magfold_env.envs.tasks.anchor_tasks import AnchorWorld
from magfold_env.envs.tasks.draws import Randomisation, randomised
from magfold_env.envs.tasks.feed_tasks import ChamberWorld, FeedWorld, RefoldWorld
from magfold_env.envs.tasks.targets import resolve_targets
from magfold_env.envs.tasks.tray_tasks import TrayWorld
from magfold_env.envs.tray import TrayEpisodes
from magfold_env.envs.unknown_floor import constant_speeds
from magfold_env.scene import load_scene

SHIPPED: tuple[tuple[str, Randomisation], ...] = (
    ("tube-feed", "none"),
    ("tube-feed", "nominal"),
    ("tube-feed", "strong"),
    ("tube-built", "none"),
    ("tube-built", "nominal"),
    ("tube-built", "strong"),
)
STORES: dict[str, Callable[[], TaskStore]] = {
    "unknown-floor": lambda: constant_speeds(FeedWorld("unknown-floor")),
    "lumen": lambda: constant_speeds(ChamberWorld("lumen")),
    "reprogram": lambda: three_speeds(RefoldWorld("reprogram")),
    "tray": lambda: TrayEpisodes.baselines(TrayWorld("tray")),
    "anchor-tray": lambda: AnchorEpisodes.baselines(AnchorWorld("anchor-tray")),
}
"""What makes the stores of those scenes in which tasks are given."""

Job = Callable[[], Baseline]


def main(workers: int = 2, only: str = "") -> None:
    """Compute and write the baselines of the default scenes whose names begin with ``only``."""
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"))
    with Progress() as progress, pool:

        def save(name: str, key: str, jobs: Sequence[Job]) -> None:
            task = progress.add_task(name, total=len(jobs))
            baselines: list[Baseline] = []
            for job in [pool.submit(job) for job in jobs]:
                baselines.append(job.result())
                progress.advance(task)
            path = save_shipped(name, key, baselines)
            mean = sum(baseline.score for baseline in baselines) / len(baselines)
            progress.console.print(f"{path}: mean b {mean:.3f}")

        for name, randomisation in SHIPPED:
            if name.startswith(only):
                scene = randomised(load_scene(name), randomisation)
                sequences = designs(scene)
                jobs = [
                    partial(evaluate_design, scene, target, sequences[target])
                    for target in resolve_targets(None, scene.n)
                ]
                save(f"{name}-{randomisation}", baseline_key(scene), jobs)
        for name, make_store in STORES.items():
            if name.startswith(only):
                store = make_store()
                save(name, store.key, [partial(_of_task, name, task) for task in store.names])


def _of_task(name: str, task: str) -> Baseline:
    return STORES[name]().compute(task)


if __name__ == "__main__":
    typer.run(main)
