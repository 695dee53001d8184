"""Train with RLlib's PPO instead of Stable-Baselines3's: ``python -m agents.rllib_example``."""

# pyright: reportMissingImports=false

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import gymnasium
import typer

import magfold_env  # noqa: F401 (registers the environments, in every process of a cluster)
from agents.commands import reported_errors, run_command
from agents.settings import PPOSettings, SettingsError, TrainSettings, load_settings

if TYPE_CHECKING:
    from ray.rllib.algorithms.ppo import PPOConfig


def make_env(options: dict[str, Any]) -> gymnasium.Env[Any, Any]:
    """Return the environment whose id and options these are."""
    return gymnasium.make(**options)


def ppo_config(settings: TrainSettings, runners: int = 0) -> "PPOConfig":
    """Return training settings in RLlib's words.

    Of those for `agents.train`, phases before the main one, features, validation and stops are left
    out. So many processes, `runners`, step the environments; with 0 the one that learns does.

    Raises
    ------
    SettingsError
        If their learner is not PPO.
    """
    from ray.rllib.algorithms.ppo import PPOConfig  # noqa: PLC0415 (an extra)
    from ray.rllib.core.rl_module.default_model_config import (  # noqa: PLC0415
        DefaultModelConfig,
    )
    from ray.tune.registry import register_env  # noqa: PLC0415

    learner, env = settings.learner, settings.env
    if not isinstance(learner, PPOSettings) or learner.algorithm != "ppo":
        raise SettingsError(f"learner.algorithm: {learner.algorithm!r} is not allowed; must be ppo")
    register_env(env.id, make_env)
    rate = learner.learning_rate
    return (
        PPOConfig()
        .environment(env.id, env_config={"id": env.id, "gamma": learner.gamma, **env.options()})
        .env_runners(num_env_runners=runners, num_envs_per_env_runner=settings.envs)
        .training(
            lr=[[0, rate], [settings.timesteps, 0.0]] if learner.anneal else rate,
            gamma=learner.gamma,
            lambda_=learner.gae_lambda,
            train_batch_size=learner.n_steps * settings.envs,
            minibatch_size=learner.batch_size,
            num_epochs=learner.n_epochs,
            clip_param=learner.clip_range,
            entropy_coeff=learner.ent_coef,
            vf_loss_coeff=learner.vf_coef,
            vf_clip_param=float("inf"),
            use_kl_loss=False,
            grad_clip=0.5,
        )
        .rl_module(
            model_config=DefaultModelConfig(
                fcnet_hiddens=list(learner.hidden), fcnet_activation="tanh"
            )
        )
        .debugging(seed=settings.seed, log_level="ERROR")
    )


def main(
    config: Annotated[str, typer.Argument(help="As for agents.train; PPO's.")] = "ppo-tube-feed",
    timesteps: Annotated[int | None, typer.Option(help="Environment steps in all.")] = None,
    runners: Annotated[int, typer.Option(min=0, help="Processes that step environments.")] = 0,
    address: Annotated[
        str | None,
        typer.Option(help="Of a cluster; by default that in RAY_ADDRESS, or one started here."),
    ] = None,
    output: Annotated[Path, typer.Option(help="Folder of the checkpoint.")] = Path("runs/rllib"),
) -> None:
    """Train by RLlib and save its checkpoint."""
    with reported_errors(SettingsError, extras="ray"):
        import ray  # noqa: PLC0415 (an extra)

        settings = load_settings(config, timesteps=timesteps)
        algorithm_config = ppo_config(settings, runners)
    ray.init(address=address, logging_level="warning")
    algorithm = algorithm_config.build_algo()
    steps = 0
    while steps < settings.timesteps:
        result = algorithm.train()
        steps = int(result["num_env_steps_sampled_lifetime"])
        mean = result["env_runners"].get("episode_return_mean", float("nan"))
        typer.echo(f"{steps}/{settings.timesteps} steps, mean return {mean:.3f}", err=True)
    algorithm.save_to_path(str(output.resolve()))
    typer.echo(f"checkpoint: {output}", err=True)
    algorithm.stop()
    ray.shutdown()


if __name__ == "__main__":
    run_command(main)
