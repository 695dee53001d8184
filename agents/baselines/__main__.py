"""Run a search for every target: ``python -m agents.baselines SEARCH``."""

from pathlib import Path
from typing import Annotated

import typer

from agents.baselines.searches import SEARCHES, choose
from agents.commands import EnvChanges, EnvConfig, progress_bar, reported_errors, run_command
from agents.evaluation.episodes import make_env
from agents.settings import env_settings


def main(
    search: Annotated[str, typer.Argument(help=f"One of {', '.join(SEARCHES)}.")],
    config: EnvConfig = "ppo-tube-feed",
    env: EnvChanges = None,
    budget: Annotated[int, typer.Option(min=1, help="Most physics calls for each target.")] = 2000,
    goal: Annotated[
        float, typer.Option(help="Share of successes of 40 calls that ends a search early.")
    ] = 1.0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the search and of its calls.")] = 0,
    processes: Annotated[int, typer.Option(min=1, help="Targets at a time.")] = 2,
    output: Annotated[
        Path | None, typer.Option(help="File of choices; runs/baselines/SEARCH.json by default.")
    ] = None,
) -> None:
    """Choose a sequence and speeds for every target; an interrupted search continues."""
    path = output or Path("runs/baselines") / f"{search}.json"
    calls = targets = 0
    with reported_errors(ValueError):
        settings = env_settings(config, env or [])
        total = len(make_env(settings).targets)
        found = choose(search, settings, path, budget, goal, seed, processes)
        with progress_bar() as bar:
            task = bar.add_task(search, total=total, note="")
            for _, chosen in found:
                calls, targets = calls + chosen.calls, targets + 1
                bar.update(task, advance=1, note=f"{calls / targets:.0f} calls a target")
    typer.echo(f"{calls} physics calls for {targets} targets; choices written to {path}")


if __name__ == "__main__":
    run_command(main)
