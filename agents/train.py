"""Train a policy: ``python -m agents.train CONFIG``."""

from pathlib import Path
from typing import Annotated

import typer

from agents.commands import Assignments, run_command
from agents.settings import load_settings
from agents.training import envs, run
from magfold_env.cli import options


def main(
    config: Annotated[str, typer.Argument(help="A YAML file, or a name in configs/agents.")],
    *,
    timesteps: Annotated[int | None, typer.Option(help="Total environment steps.")] = None,
    minutes: Annotated[float | None, typer.Option(help="Time limit.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the run.")] = None,
    start: Annotated[
        str | None,
        typer.Option("--from", help="Start from the weights of a policy (.safetensors)."),
    ] = None,
    assignments: Assignments = None,
    output: Annotated[Path | None, typer.Option(help="Folder; runs/NAME by default.")] = None,
    resume: Annotated[
        bool | None,
        typer.Option(
            "--resume/--fresh",
            help="Continue the run in the folder, which more --timesteps or --minutes extend, "
            "or remove it; by default, a run with the same settings continues, and any "
            "other is an error.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Train a policy according to CONFIG; options take precedence over the file."""
    with options.errors_in_one_line((run.DivergedError,), code=1):
        given = {"timesteps": timesteps, "minutes": minutes, "seed": seed, "start": start}
        settings = load_settings(config, assignments or (), **given)
        envs.check_envs(settings)
        policy = run.train(settings, output or Path("runs") / settings.name, resume)
        typer.echo(f"policy: {policy}", err=True)


if __name__ == "__main__":
    run_command(main)
