"""Many perturbed releases of a scene, on all cores."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from magfold_env.checkpoint import Checkpoint
from magfold_env.ensembles.result import Ensemble
from magfold_env.ensembles.run import Run, run_one
from magfold_env.files import physics_digest
from magfold_env.parallel import Backend, Workers, finished
from magfold_env.scene import Problem, Scene, SceneError


def ensemble(
    scene: Scene,
    runs: int = 1000,
    seed: int = 0,
    *,
    workers: int | None = None,
    backend: Backend | None = None,
    address: str | None = None,
    state: str | Path | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Ensemble:
    """Simulate many releases, each with draws of its own, and count where they end.

    What is drawn is what the scene leaves to chance: `start_angle_spread` and `spreads`. Run i
    draws from ``generator(seed, i)`` alone, so that the result depends neither on the number of
    workers nor on their kind, and ``simulate(scene, generator(seed, i))`` repeats it.

    Parameters
    ----------
    scene
        What to release.
    runs
        How many releases.
    seed
        Seed of all draws.
    workers
        How many runs are made at a time; None takes all cores, or a cluster's CPUs.
    backend
        `threads`, `processes` of this machine, or `ray`: a Ray cluster, through joblib. None takes
        processes for many runs on more than four workers, else threads.
    address
        Of the Ray cluster; None takes the one in ``RAY_ADDRESS``, or starts one here.
    state
        Folder in which runs are kept as they are made, every two seconds. Called again with it,
        only missing runs are made: after a kill, or for more runs than before.
    progress
        Is told how many runs are made, of how many.

    Raises
    ------
    SceneError
        If an argument is not allowed.
    CheckpointError
        If a file in `state` is damaged, or was written for another scene, seed or physics.
    ImportError
        If Ray is wanted and not installed.
    """
    team = Workers(workers, backend, address)
    problems = [
        Problem(key, value, f"must be at least {least}")
        for key, value, least in (("runs", runs, 1), ("seed", seed, 0))
        if value < least
    ]
    if problems:
        raise SceneError(problems)
    kept = None if state is None else Checkpoint(state, _key(scene, seed))
    made: dict[int, Run] = {}
    if kept is not None:
        found = kept.read(partial(Run.from_record, n=scene.n))
        made = {run.number: run for run in found if run.number < runs}
    missing = [index for index in range(runs) if index not in made]
    try:
        for _, run in finished(partial(run_one, scene, seed), missing, team):
            made[run.number] = run
            if kept is not None:
                kept.add(run.to_record())
            if progress is not None:
                progress(len(made), runs)
    finally:
        if kept is not None:
            kept.save()
    return Ensemble.of(scene, seed, [made[index] for index in range(runs)])


def _key(scene: Scene, seed: int) -> dict[str, object]:
    return {
        "kind": "ensemble",
        "physics": physics_digest(),
        "scene": scene.model_dump(mode="json"),
        "seed": seed,
    }
