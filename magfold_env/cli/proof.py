"""The commands that put the simulation to the test: `magfold stress` and `magfold paper`."""

# Without postponed annotations: an option's help is read where the command is made.

from pathlib import Path
from typing import Annotated

import typer

from magfold_env.cli.errors import errors_in_one_line


def stress(
    *,
    cases: Annotated[int, typer.Option(help="Scenes to try.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of all draws.")] = 0,
    only: Annotated[
        list[str] | None, typer.Option(help="A kind of scenes, see the table; may repeat.")
    ] = None,
    workers: Annotated[int, typer.Option(help="Processes.")] = 1,
    minutes: Annotated[
        float | None, typer.Option(help="Begin no more after this time; no limit if left out.")
    ] = None,
    out: Annotated[
        Path, typer.Option(help="Folder of the results; a killed command goes on in it.")
    ] = Path("runs/stress"),
    rerun: Annotated[
        Path | None, typer.Option(help="Judge the scene in this file, and try nothing else.")
    ] = None,
) -> None:
    """Try to break the simulation by random and extreme scenes; exit code 1 if a law is broken."""
    from magfold_env.cli import stress as cli_stress  # noqa: PLC0415 - for this command only

    with errors_in_one_line():
        if rerun is not None:
            kept = cli_stress.try_again(rerun)
        else:
            kept = cli_stress.try_cases(cases, seed, only or [], workers, minutes, out)
    if not kept:
        raise typer.Exit(1)


def paper(
    *,
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="table-1, figure-7, figure-11, figure-12, figures-13-14, figure-15, figure-16, "
            "figure-18 or figure-19; may repeat."
        ),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Measure less: only to try it.")] = False,
    out: Annotated[
        Path, typer.Option(help="Folder of the results; a killed command goes on in it.")
    ] = Path("runs/paper"),
) -> None:
    """Reproduce the paper's figures and tables on one page, and say what agrees."""
    with errors_in_one_line():
        from magfold_env.cli import paper as cli_paper  # noqa: PLC0415 - for this command only

        cli_paper.reproduce(only or [], quick, out)
