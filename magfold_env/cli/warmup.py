"""`magfold warmup`: compile every kernel in advance, so that no first use has to wait."""

import time
from collections.abc import Callable
from typing import Any, cast

import gymnasium
import numpy as np
import typer

import magfold_env as mf
from magfold_env import minimiser
from magfold_env.cli import options
from magfold_env.envs import ENTRY_POINTS

WORD = "RLLR"
SEQUENCE = ("NNSS", "SSNN", "NNNS", "NSSS", "NSNS")


def warmup() -> None:
    """Compile all kernels now; later uses load them from disk."""
    begun = time.monotonic()
    with options.progress_bar() as bar:
        todo = work()
        task = bar.add_task("compiling", total=len(todo))
        for name, each in todo.items():
            bar.update(task, description=f"compiling what {name} need")
            each()
            bar.advance(task)
    typer.echo(f"compiled in {time.monotonic() - begun:.0f} s; kept on the disk")


def work() -> dict[str, Callable[[], Any]]:
    """Return short tasks that use all kernels, each by the name of its kind of work."""
    tube = mf.Scene(sequence=SEQUENCE, mount="tube", feed=mf.Feed(speed=0.6))
    free = tube.replace(mount="free")
    magnet = {"position": (0.1, 0.1), "heading": 0.3, "width": 0.01}
    magnet |= {"height": 0.01, "thickness": 0.01}
    scenes = {
        "folds in the open": free,
        "folds from a tube": tube,
        "fields": free.replace(field={"uniform": (0.01, 0.0), "magnet": magnet}),
        "sums over nodes": free.replace(magnets={"accuracy": 1e-6}),
        "rows of points": free.replace(magnets={"model": "points"}),
        "swings": free.replace(mount="pinned", magnets=None, contact=False, friction=0.0),
        "the paper's steps": free.replace(mount="pinned", solver={"method": "paper"}),
    }
    scenes = {name: scene.replace(duration=0.05) for name, scene in scenes.items()}
    found: dict[str, Callable[[], Any]] = {
        name: lambda scene=scene: _fold(scene) for name, scene in scenes.items()
    }
    found["many folds"] = lambda: mf.simulate_batch(free, range(2), threads=2)
    found["predictions by energy"] = lambda: [
        minimiser.minimise(free),
        minimiser.minimise(free, "forward"),
        minimiser.ground_state(free),
    ]
    found["designs"] = lambda: [
        mf.design(WORD, free, "free", objective="ground", budget=20, runs=2, workers=1),
        mf.design(WORD, tube, search="annealing", budget=20, runs=2, workers=1),
    ]
    found["limit loads"] = lambda: mf.holding(mf.simulate(free))
    found["accelerations"] = lambda: mf.accelerations(
        scenes["swings"], np.zeros((2, free.n)), np.zeros((2, free.n))
    )
    for env_id in ENTRY_POINTS:
        found[f"{env_id.split('/')[1]} environments"] = lambda env_id=env_id: _play(env_id)
    return found


def _fold(scene: mf.Scene) -> None:
    fold = mf.simulate(scene, 0, frame_rate=100.0)
    straight = np.zeros(scene.n)
    mf.energy(scene, straight)
    mf.forces(scene, straight)
    assert fold.angles.shape == straight.shape


def _play(env_id: str) -> None:
    """Play an episode in a single environment and in a vector environment."""
    env = gymnasium.make(env_id)
    env.reset(seed=0)
    ended = False
    while not ended:
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        ended = terminated or truncated
    env.close()
    envs = cast("Any", gymnasium.make_vec(env_id, num_envs=2))
    envs.reset(seed=0)
    envs.step(envs.action_space.sample())
    envs.close()
