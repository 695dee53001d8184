"""Compute the shipped baselines: ``python -m magfold_env.envs.baselines.make_baselines``."""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import typer
from rich.progress import Progress

from magfold_env.envs.baselines.baseline import (
    Baseline,
    baseline_key,
    designs,
    evaluate_design,
    save_shipped,
)
from magfold_env.envs.tasks.draws import Randomisation, randomised
from magfold_env.envs.tasks.targets import resolve_targets
from magfold_env.scene import load_scene

SHIPPED: tuple[tuple[str, Randomisation], ...] = (
    ("tube-feed", "none"),
    ("tube-feed", "nominal"),
    ("tube-feed", "strong"),
    ("tube-built", "none"),
    ("tube-built", "nominal"),
    ("tube-built", "strong"),
)


def main(workers: int = 2) -> None:
    """Design, simulate and write the baselines of the default scenes, with and without spreads."""
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"))
    with Progress() as progress, pool:
        for name, randomisation in SHIPPED:
            scene = randomised(load_scene(name), randomisation)
            targets = resolve_targets(None, scene.n)
            task = progress.add_task(f"{name}, {randomisation}: designs", total=len(targets))
            sequences = designs(scene)
            progress.update(task, description=f"{name}, {randomisation}: folds")
            jobs = [
                pool.submit(evaluate_design, scene, target, sequences[target]) for target in targets
            ]
            baselines: list[Baseline] = []
            for job in jobs:
                baselines.append(job.result())
                progress.advance(task)
            path = save_shipped(f"{name}-{randomisation}", baseline_key(scene), baselines)
            mean = sum(baseline.score for baseline in baselines) / len(baselines)
            progress.console.print(f"{path}: mean b {mean:.3f}")


if __name__ == "__main__":
    typer.run(main)
