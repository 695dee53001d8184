"""A first training run of a few minutes and a comparison: ``python -m agents.quickstart``."""

from pathlib import Path
from typing import Annotated

import joblib
import typer

from agents.commands import run_command
from agents.evaluate import compare
from agents.evaluation.episodes import Method
from agents.evaluation.policies import NO_MOTION
from agents.settings import env_settings, load_settings
from agents.training.run import train

CONFIG = "ppo-quickstart"
"""Name of the training settings."""


def main(
    minutes: Annotated[float, typer.Option(help="Longest training time.")] = 5.0,
    draws: Annotated[int, typer.Option(min=1, help="Evaluation episodes per target.")] = 20,
    output: Annotated[Path, typer.Option(help="Folder of all results.")] = Path("runs/quickstart"),
) -> None:
    """Train a policy briefly and compare it with random actions and the energy minimiser.

    The policy also plays with motion hidden; the difference shows the benefit of observing motion.
    """
    settings = load_settings(CONFIG, minutes=minutes)
    policy = train(settings, output, resume=False)
    method = Method("PPO", (str(policy),))
    unseeing = Method("PPO, no motion", (f"{NO_MOTION}{policy}",))
    compare([method, unseeing], env_settings(CONFIG, []), draws, joblib.cpu_count(), output)


if __name__ == "__main__":
    run_command(main)
