"""Train PPO of RLlib on the tube feed: ``python -m agents.rllib_example``."""

from pathlib import Path
from typing import Annotated, Any

import gymnasium
import typer
from rich.console import Console

import magfold_env as _registers  # noqa: F401

ENV = "MagFold/TubeFeed-v0"


def make_env(options: dict[str, Any]) -> gymnasium.Env[Any, Any]:
    """Return the environment, in whichever process of a cluster."""
    return gymnasium.make(ENV, **options)


def main(
    iterations: Annotated[int, typer.Option(min=1, help="Updates.")] = 100,
    runners: Annotated[int, typer.Option(min=0, help="Processes with environments.")] = 0,
    address: Annotated[
        str | None,
        typer.Option(help="Of the cluster; by default that in RAY_ADDRESS, or one started here."),
    ] = None,
    output: Annotated[Path, typer.Option(help="Folder of the checkpoint.")] = Path("runs/rllib"),
    components: Annotated[int | None, typer.Option(min=2, help="Chain length.")] = None,
) -> None:
    """Train with the settings of ``configs/agents/ppo-tube-feed.yaml``, without its annealing."""
    import ray
    from ray.rllib.algorithms.ppo import PPOConfig
    from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
    from ray.tune.registry import register_env

    options = {"shaping": "similarity", "gamma": 1.0}
    if components is not None:
        options["components"] = components
    ray.init(address=address, logging_level="warning")
    register_env(ENV, make_env)
    config = (
        PPOConfig()
        .environment(ENV, env_config=options)
        .env_runners(num_env_runners=runners, num_envs_per_env_runner=2)
        .training(
            lr=1.5e-3,
            gamma=1.0,
            lambda_=0.95,
            train_batch_size=510,
            minibatch_size=255,
            num_epochs=10,
            clip_param=0.2,
            entropy_coeff=0.003,
        )
        .rl_module(
            model_config=DefaultModelConfig(fcnet_hiddens=[256, 256], fcnet_activation="tanh")
        )
        .debugging(seed=0)
    )
    algorithm = config.build_algo()
    for k in range(iterations):
        result = algorithm.train()
        print(
            k,
            result["env_runners"].get("episode_return_mean"),
            result.get("num_env_steps_sampled_lifetime"),
        )
    algorithm.save_to_path(str(output.resolve()))
    algorithm.stop()
    ray.shutdown()


if __name__ == "__main__":
    typer.run(main)
