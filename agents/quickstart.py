"""The main job: train for a few minutes, then compare: ``python -m agents.quickstart``."""

from pathlib import Path
from typing import Annotated

import typer

from agents.evaluate import compare
from agents.run_folder import Resume
from agents.settings import load_settings
from agents.training_run import train


def main(
    minutes: Annotated[float, typer.Option(help="Longest training time.")] = 5.0,
    draws: Annotated[int, typer.Option(min=1, help="Evaluation episodes per target.")] = 20,
    output: Annotated[Path, typer.Option(help="Folder of all results.")] = Path("runs/quickstart"),
) -> None:
    """Train a policy briefly and compare it with random actions and the energy minimiser."""
    settings = load_settings("ppo-quickstart", minutes=minutes)
    policy = train(settings, output, Resume.NEVER)
    compare([policy], settings.env, draws, settings.envs, output)


if __name__ == "__main__":
    typer.run(main)
