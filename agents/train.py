"""Train a policy with PPO: ``python -m agents.train CONFIG``."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
import typer
from rich.console import Console
from stable_baselines3 import PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv

from agents.callbacks import EverySteps, ProgressCallback, TimeLimitCallback, save_policy
from agents.episodes import make_env, play, warm_up
from agents.policies import TrainedPolicy
from agents.settings import TrainSettings, load_settings, save_settings
from magfold_env.envs.draws import episode_seeds
from magfold_env.envs.tube_feed import TubeFeedEnv


def train(settings: TrainSettings, folder: Path) -> Path:
    """Run the training that `settings` describe.

    Parameters
    ----------
    settings : TrainSettings
        The run.
    folder : Path
        Where ``settings.yaml``, ``policy.zip``, ``checkpoints/`` and TensorBoard's files go.

    Returns
    -------
    Path
        The trained policy.
    """
    # The networks are small: more threads only get in the way of the simulations.
    torch.set_num_threads(1)
    checkpoints = folder / "checkpoints"
    checkpoints.mkdir(parents=True, exist_ok=True)
    save_settings(settings, folder / "settings.yaml")
    with Console().status("preparing the engine; its first use compiles it, for up to a minute"):
        warm_up(settings.env)
    env = make_training_envs(settings)
    try:
        model = make_model(settings, env)
        model.set_logger(configure(str(folder), ["tensorboard"]))
        model.learn(settings.timesteps, callback=_callbacks(settings, checkpoints))
        save_policy(model, folder / "policy.zip")
    finally:
        env.close()
    return folder / "policy.zip"


def make_training_envs(settings: TrainSettings) -> VecEnv:
    """Return the training environments, one a process."""
    return make_vec_env(
        TubeFeedEnv,
        n_envs=settings.processes,
        seed=settings.seed,
        env_kwargs=settings.env.model_dump() | {"gamma": settings.ppo.gamma},
        vec_env_cls=SubprocVecEnv if settings.processes > 1 else DummyVecEnv,
    )


def make_model(settings: TrainSettings, env: VecEnv) -> PPO:
    """Return an untrained PPO model."""
    ppo = settings.ppo
    options: dict[str, Any] = ppo.model_dump(exclude={"learning_rate", "anneal", "hidden"})
    return PPO(
        "MlpPolicy",
        env,
        learning_rate=_schedule(ppo.learning_rate) if ppo.anneal else ppo.learning_rate,
        policy_kwargs={"net_arch": list(ppo.hidden)},
        seed=settings.seed,
        device=settings.device,
        **options,
    )


def _schedule(learning_rate: float) -> Callable[[float], float]:
    """Return a learning rate that falls linearly to zero with the progress that remains."""
    return lambda remaining: learning_rate * remaining


def _callbacks(settings: TrainSettings, checkpoints: Path) -> list[BaseCallback]:
    """Return what happens beside the learning."""

    def checkpoint(model: BaseAlgorithm, steps: int) -> None:
        save_policy(model, checkpoints / f"policy-{steps:09d}.zip")

    callbacks: list[BaseCallback] = [
        ProgressCallback(settings.timesteps),
        EverySteps(settings.checkpoint_every, checkpoint),
        EverySteps(settings.validate_every, _validation(settings)),
    ]
    if settings.minutes is not None:
        callbacks.append(TimeLimitCallback(settings.minutes))
    return callbacks


def _validation(settings: TrainSettings) -> Callable[[BaseAlgorithm, int], None]:
    """Return a function that logs success and score on draws kept for validation."""
    env = make_env(settings.env)
    seeds = episode_seeds("validation", settings.validation_episodes)
    targets = [env.targets[i % len(env.targets)] for i in range(len(seeds))]

    def validate(model: BaseAlgorithm, _steps: int) -> None:
        policy = TrainedPolicy(model)
        outcomes = [
            play(policy, env, target, seed) for target, seed in zip(targets, seeds, strict=True)
        ]
        success = float(np.mean([outcome.success for outcome in outcomes]))
        model.logger.record("validation/success_rate", success)
        model.logger.record(
            "validation/score", float(np.mean([outcome.score for outcome in outcomes]))
        )

    return validate


def main(
    config: Annotated[str, typer.Argument(help="A YAML file, or a name in configs/agents.")],
    timesteps: Annotated[int | None, typer.Option(help="Environment steps in all.")] = None,
    minutes: Annotated[float | None, typer.Option(help="Time limit.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the run.")] = None,
    device: Annotated[str | None, typer.Option(help="cpu, cuda or auto.")] = None,
    processes: Annotated[int | None, typer.Option(help="Environments, one a process.")] = None,
    output: Annotated[Path | None, typer.Option(help="Folder; runs/NAME by default.")] = None,
) -> None:
    """Train a policy as CONFIG says; options take precedence over the file."""
    console = Console(stderr=True)
    try:
        settings = load_settings(
            config,
            timesteps=timesteps,
            minutes=minutes,
            seed=seed,
            device=device,
            processes=processes,
        )
        make_env(settings.env)
    except ValueError as error:
        console.print(f"[red]error:[/red] {error}", highlight=False)
        raise typer.Exit(1) from None
    policy = train(settings, output or Path("runs") / settings.name)
    console.print(f"policy written to {policy}")


if __name__ == "__main__":
    typer.run(main)
