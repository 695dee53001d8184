"""A first training run of a few minutes and a comparison: ``python -m agents.quickstart``.

A shipped policy then folds chains that it was not trained on, with and without its camera.
"""

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import gymnasium
import joblib
import numpy as np
import typer

from agents.commands import run_command
from agents.evaluate import compare
from agents.evaluation.episodes import Method
from agents.evaluation.policies import NO_MOTION
from agents.evaluation.shipped import load_shipped
from agents.settings import env_settings, load_settings
from agents.training.policy_files import SavedPolicy
from agents.training.run import train
from magfold_env.envs.wrappers.record_video import RecordVideo
from magfold_env.scoring.player import Player

CONFIG = "ppo-quickstart"
"""Name of the training settings."""

TRACK, POLICY = "MagFold/UnknownFloor-v1", "ppo-unknown-floor-v1"
"""The environment with chains for tests, and the shipped policy that folds them."""

CHAINS, FILMED = 10, 3
"""Number of these chains, and of those whose episodes are filmed."""


def main(
    minutes: Annotated[float, typer.Option(help="Longest training time.")] = 5.0,
    draws: Annotated[int, typer.Option(min=1, help="Evaluation episodes per target.")] = 20,
    output: Annotated[Path, typer.Option(help="Folder of all results.")] = Path("runs/quickstart"),
    seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of the chains to fold; a new one by default.")
    ] = None,
) -> None:
    """Train a policy briefly and compare it with random actions and the energy minimiser.

    The policy also plays with motion hidden; the difference shows the benefit of observing motion.
    Then a shipped policy folds ten chains that are drawn now, and that no policy was trained on.
    """
    settings = load_settings(CONFIG, minutes=minutes)
    policy = train(settings, output, resume=False)
    method = Method("PPO", (str(policy),))
    unseeing = Method("PPO, no motion", (f"{NO_MOTION}{policy}",))
    compare([method, unseeing], env_settings(CONFIG, []), draws, joblib.cpu_count(), output)
    fold_unseen(output, int(np.random.default_rng().integers(2**32)) if seed is None else seed)


def fold_unseen(output: Path, seed: int) -> None:
    """Draw chains for tests, let the shipped policy fold them, print the results, and film some."""
    saved = load_shipped(POLICY)
    options: Any = {"split": "test", "actions": "discrete", "disable_env_checker": True}
    folder = output / "films"
    shutil.rmtree(folder, ignore_errors=True)  # films of an earlier call
    films = gymnasium.make(TRACK, render_mode="rgb_array_list", **options)
    films = RecordVideo(
        films, str(folder), name_prefix="chain", episode_trigger=lambda k: k < FILMED,
        disable_logger=True,
    )  # fmt: skip
    rng, tasks = np.random.default_rng(seed), films.get_wrapper_attr("tasks")
    drawn = {tasks[number].sequence: number for number in rng.permutation(len(tasks)).tolist()}
    episodes = list(zip(drawn.values(), rng.integers(2**32, size=CHAINS).tolist(), strict=False))
    seeing = _folded(films, saved, episodes)
    films.close()
    shown = saved.shown.model_copy(update={"blind": True})
    unseeing = _folded(gymnasium.make(TRACK, **options), replace(saved, shown=shown), episodes)
    typer.echo(
        f"{CHAINS} chains that no policy was trained on: {POLICY} folds {seeing} with its camera "
        f"and {unseeing} without. Films are in {folder}; --seed {seed} draws the same "
        "chains."
    )


def _folded(env: Any, saved: SavedPolicy, episodes: Sequence[tuple[int, int]]) -> int:
    """Return in how many episodes, given by task and seed, the policy reaches the target."""
    folded = 0
    for number, seed in episodes:
        observation, info = env.reset(seed=seed, options={"task": number})
        player, over = Player(saved.policy, saved.shown, env.unwrapped), False
        while not over:
            action = player.act(observation[None])[0]
            observation, _, terminated, truncated, info = env.step(action)
            over = terminated or truncated
        folded += info["is_success"]
    return folded


if __name__ == "__main__":
    run_command(main)
