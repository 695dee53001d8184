"""Releases of a scene: in which ways, many of them on all cores, and what energies predict."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import get_args

from magfold_env.checkpoint import Checkpoint
from magfold_env.ensembles.result import Ensemble, Run, run_one
from magfold_env.files import physics_digest
from magfold_env.minimiser import Mode, minimise
from magfold_env.parallel import Backend, Workers, finished
from magfold_env.scene import Scene, errors


def release(scene: Scene, mode: Mode, speed: float | None = None) -> Scene:
    """Return a scene whose chain is let go in one of the paper's deployment modes.

    Parameters
    ----------
    scene
        What to release.
    mode
        `free`: all components at once, without a tube. `forward`, `backward`: out of the tube,
        component 1 or component n first.
    speed
        Feed speed [m/s]; None keeps the scene's.

    Raises
    ------
    SceneError
        If an argument is none of these.
    """
    errors.refuse(errors.unless_one_of("mode", mode, get_args(Mode)))
    feed = {} if speed is None else {"speed": speed}
    if mode == "free":
        return scene.replace(mount="free", feed=feed)
    return scene.replace(mount="tube", feed={"direction": mode, **feed})


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
    asked = Workers(workers, backend, address)
    problems = errors.unless_at_least("runs", runs, 1) + errors.unless_at_least("seed", seed, 0)
    errors.refuse(problems)
    made: dict[int, Run] = {}
    kept = None
    if state is not None:
        key = {
            "kind": "ensemble",
            "physics": physics_digest(),
            "scene": scene.model_dump(mode="json"),
            "seed": seed,
        }
        kept = Checkpoint(state, key)
        found = kept.read(partial(Run.from_record, n=scene.n))
        made = {run.number: run for run in found if run.number < runs}
    missing = [index for index in range(runs) if index not in made]
    try:
        for _, run in finished(partial(run_one, scene, seed), missing, asked):
            made[run.number] = run
            if kept is not None:
                kept.add(run.to_record())
            if progress is not None:
                progress(len(made), runs)
    finally:
        if kept is not None:
            kept.save()
    return Ensemble.of(scene, seed, [made[index] for index in range(runs)])


PREDICTORS: dict[Mode, str] = {
    "free": "full search",
    "forward": "forward search",
    "backward": "backward search",
}
"""Names of the minimiser's searches, by its mode."""


def predictions(scene: Scene) -> dict[str, str]:
    """Return the word that each of the minimiser's searches ends in, by the search's name.

    Searches that refuse the scene, or shut themselves in, are left out.
    """
    found: dict[str, str] = {}
    for mode, name in PREDICTORS.items():
        with suppress(ValueError):
            found[name] = minimise(scene, mode, top=1).best.word
    return found
