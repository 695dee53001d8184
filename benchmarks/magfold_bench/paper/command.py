"""`magfold paper`: reproduce the paper and show the agreement."""

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from magfold_bench.tables import rich_table
from magfold_env.cli import options


def paper(
    *,
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="table-1, figure-7, figure-11, figure-12, figures-13-14, figure-15, figure-16, "
            "figure-18 or figure-19; may repeat."
        ),
    ] = None,
    quick: options.Quick = False,
    out: options.Results = Path("runs/paper"),
) -> None:
    """Reproduce the paper's figures and tables on one page, with the agreement of each."""
    with options.errors_in_one_line():
        options.need_render()
        from magfold_bench.paper import run as runs  # noqa: PLC0415 - for this command only

        with options.progress_of(1.0) as progress:
            done = runs.run(only or [], quick, out, progress)
        console = options.wide_console()
        for each in done:
            for claim in each.claims:
                if claim.holds is False:
                    text = f"• {each.part.name}: {claim.stated} Here: {claim.found}"
                    console.print(escape(text), highlight=False)
        console.print(rich_table(runs.overview(done)))
        options.say_written(out / runs.PAGE, out / runs.NUMBERS)
        typer.echo(f"pictures and tables of numbers: {out}")
