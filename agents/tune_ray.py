"""Search for hyper-parameters on a Ray cluster: ``python -m agents.tune_ray CONFIG``."""

from pathlib import Path
from typing import Annotated

import typer

from agents.commands import Assignments, reported_errors, run_command
from agents.settings import SettingsError
from agents.tune import Config, Output, Trials
from agents.tuning.search import load_search, report_best


def main(
    config: Config,
    trials: Trials = None,
    assignments: Assignments = None,
    output: Output = None,
    address: Annotated[
        str | None,
        typer.Option(help="Of the cluster; by default that in RAY_ADDRESS, or one started here."),
    ] = None,
    cpus: Annotated[int, typer.Option(min=1, help="CPUs of a trial.")] = 1,
) -> None:
    """Spread the trials over a cluster; called again, go on."""
    with reported_errors(SettingsError, extras="tune,ray"):
        from agents.tuning.cluster import search_on_ray  # noqa: PLC0415 (needs Ray and Optuna)

        search = load_search(config, assignments or (), trials)
        folder = output or Path("runs") / search.settings.name
        report_best(search, search_on_ray(search, folder, address, cpus), folder)


if __name__ == "__main__":
    run_command(main)
