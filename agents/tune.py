"""Search for hyper-parameters: ``python -m agents.tune CONFIG``."""

from pathlib import Path
from typing import Annotated

import typer

from agents.commands import Assignments, reported_errors, run_command
from agents.settings import SettingsError
from agents.tuning.search import load_search, report_best
from magfold_env.checkpoint import CheckpointError

Config = Annotated[str, typer.Argument(help="A YAML file, or a name in configs/tuning.")]
Trials = Annotated[int | None, typer.Option(help="Trials in all.")]
Output = Annotated[Path | None, typer.Option(help="Folder; runs/NAME by default.")]


def main(
    config: Config,
    trials: Trials = None,
    minutes: Annotated[
        float | None, typer.Option(help="Time after which no new trial begins.")
    ] = None,
    assignments: Assignments = None,
    output: Output = None,
    storage: Annotated[
        str | None,
        typer.Option(help="Database of the study; sqlite:///OUTPUT/study.db by default."),
    ] = None,
) -> None:
    """Train with settings drawn from ranges and print the best; an interrupted search continues."""
    with reported_errors(SettingsError, CheckpointError, extras="tune"):
        from agents.tuning.study import search_here  # noqa: PLC0415 (only searches need Optuna)

        search = load_search(config, assignments or (), trials)
        folder = output or Path("runs") / search.settings.name
        report_best(search, search_here(search, folder, storage, minutes), folder)


if __name__ == "__main__":
    run_command(main)
