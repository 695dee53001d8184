"""Compute the shipped baselines: ``python -m magfold_bench.lists.baselines``."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from operator import call
from typing import Any

import typer
from rich.progress import track

from magfold_env.cli import options
from magfold_env.envs import EARLIER, ENTRY_POINTS
from magfold_env.envs.anchor import AnchorEnv
from magfold_env.envs.baselines.baseline import (
    Baseline,
    baseline_key,
    designs,
    evaluate_design,
    shipped_folder,
)
from magfold_env.envs.baselines.constant_speed import TaskStore
from magfold_env.envs.camera_track import CameraTrackEnv
from magfold_env.envs.lumen import LumenEnv
from magfold_env.envs.reprogram import ReprogramEnv
from magfold_env.envs.tasks.draws import Randomisation, randomised
from magfold_env.envs.tasks.targets import resolve_targets
from magfold_env.envs.tray import TrayEnv
from magfold_env.envs.unknown_floor import UnknownFloorEnv
from magfold_env.files import write_json
from magfold_env.parallel import Workers, finished
from magfold_env.scene import load_scene

SHIPPED: tuple[tuple[str, Randomisation], ...] = (
    ("tube-feed", "none"),
    ("tube-feed", "nominal"),
    ("tube-feed", "strong"),
    ("tube-built", "none"),
    ("tube-built", "nominal"),
    ("tube-built", "strong"),
)
TRACKS = (UnknownFloorEnv, LumenEnv, ReprogramEnv, TrayEnv, AnchorEnv)
"""Environments with lists of tasks; baselines of later versions than v0 are not shipped."""

Job = Callable[[], Baseline]


def main(workers: int = 2, only: str = "") -> None:
    """Compute and write the baselines of the default scenes whose names begin with ``only``."""

    def save(name: str, key: str, jobs: Sequence[Job]) -> None:
        results = finished(call, jobs, Workers(workers, "processes"))
        made = dict(track(results, name, total=len(jobs)))
        baselines = [made[place] for place in range(len(jobs))]
        path = shipped_folder() / f"{name}.json"
        write_json(path, {"key": key, "baselines": list(map(asdict, baselines))}, "baselines")
        mean = sum(each.score for each in baselines) / len(baselines)
        typer.echo(f"{path}: mean b {mean:.3f}")

    for name, randomisation in SHIPPED:
        if name.startswith(only):
            scene = randomised(load_scene(name), randomisation)
            sequences = designs(scene)
            jobs = [
                partial(evaluate_design, scene, target, sequences[target])
                for target in resolve_targets(None, scene.n)
            ]
            save(f"{name}-{randomisation}", baseline_key(scene), jobs)
    for kind in TRACKS:
        if kind.default_scene.startswith(only):
            store = store_of_v0(kind)
            jobs = [partial(_of_task, kind, task) for task in store.names]
            save(kind.default_scene, store.key, jobs)


def _of_task(track: type[CameraTrackEnv], task: str) -> Baseline:
    return store_of_v0(track).compute(task)


def store_of_v0(track: Any) -> TaskStore:
    """Return the baselines of the tasks of a track's version v0."""
    end = f":{track.__name__}"
    options = [given for env_id, given in EARLIER.items() if ENTRY_POINTS[env_id].endswith(end)]
    setup = track.make_setup(**(options[0] if options else {}))
    return track.make_episodes.baselines(setup)


if __name__ == "__main__":
    options.application_of(main)()
