"""Commands of `python -m magfold_bench`: one per benchmark, the suite, `stress` and `paper`."""

# Annotations must not be postponed: an option's help below depends on the command.

from importlib import import_module
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.markup import escape

from magfold_bench.presentation import Summary, descriptions
from magfold_bench.tables import rich_table
from magfold_env.cli import options
from magfold_env.scene import errors, load_scene

bench = options.application(no_args_is_help=True)


@bench.callback(invoke_without_command=True)
def suite(
    context: typer.Context,
    *,
    quick: Annotated[
        bool,
        typer.Option("--quick", help="Run all benchmarks with little effort, within minutes."),
    ] = False,
    full: Annotated[
        bool, typer.Option("--full", help="Run all benchmarks as the documentation quotes them.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the suite's report; runs/bench-quick or -full by default."),
    ] = None,
) -> None:
    """Measure this machine and this version with all benchmarks, or with a named one.

    The page report.html shows the results of all benchmarks; tables and diagrams are beside it.
    To continue an interrupted run, give the same folder.
    """
    if context.invoked_subcommand is not None:
        if quick or full or out is not None:
            name = context.invoked_subcommand
            raise typer.BadParameter(
                f"--quick, --full and --out before {name!r} apply to all; give others after it"
            )
        return
    if quick == full:
        raise typer.BadParameter("one of --quick and --full must be given, or a benchmark's name")
    effort = "quick" if quick else "full"
    command = import_module("magfold_bench.suite")
    complete = command.run(effort, out or Path("runs") / f"bench-{effort}")
    if not complete:
        raise typer.Exit(1)


def _add(name: str, summary: Summary) -> None:
    """Add the command of one benchmark."""

    @bench.command(name, help=summary.measures)
    def measure(  # pyright: ignore[reportUnusedFunction] - typer holds it
        *,
        quick: options.Quick = False,
        only: Annotated[
            list[str] | None,
            typer.Option(help=f"A part: {', '.join(summary.parts)}; repeatable."),
        ] = None,
        out: Annotated[
            Path | None, typer.Option(help="Folder for CSV, JSON and PNG files, created if needed.")
        ] = None,
    ) -> None:
        import_module("magfold_bench.parts").run(name, only or [], quick, out)


def stress(
    *,
    cases: Annotated[int, typer.Option(help="Number of scenes to try.")] = 1000,
    seed: options.DrawSeed = 0,
    only: Annotated[
        list[str] | None, typer.Option(help="A kind of scene (see the table); repeatable.")
    ] = None,
    workers: Annotated[int, typer.Option(help="Number of processes.")] = 1,
    minutes: Annotated[
        float | None, typer.Option(help="Begin no more after this time; no limit by default.")
    ] = None,
    out: options.Results = Path("runs/stress"),
    rerun: Annotated[
        Path | None,
        typer.Option(help="Judge only the scene in this file, as --seed draws it."),
    ] = None,
) -> None:
    """Try to break simulations with random and extreme scenes; exit with 1 if one breaks a law."""
    from magfold_bench.stress import campaign, laws, report  # noqa: PLC0415 - for this command only

    options.check_folder("--out", out)
    if rerun is not None and not rerun.is_file():
        raise ValueError(f"--rerun: {str(rerun)!r} is not allowed; must be a scene file")
    if rerun is not None:
        errors.refuse(errors.unless_whole("seed", seed, 0))
        scene = load_scene(rerun).draw(np.random.default_rng(seed))
        verdict = laws.check(scene)
        options.wide_console().print(report.verdict_table(rerun.name, verdict))
        kept = not verdict.broken
    else:
        with options.progress_of(cases) as tell:
            tally = campaign.run(
                cases, seed, only or [], workers=workers, minutes=minutes, out=out,
                progress=lambda tally: tell(tally.cases, f"{len(tally.failures)} break a law"),
            )  # fmt: skip
        for table in (report.kinds_table(tally), report.laws_table(tally)):
            options.wide_console().print(table)
        options.say_written(report.write(tally, out))
        if tally.failures:
            typer.echo(f"failing scenes: {out / 'failures'}")
        kept = not tally.failures
    if not kept:
        raise typer.Exit(1)


def paper(
    *,
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="table-1, figure-7, figure-11, figure-12, figures-13-14, figure-15, figure-16, "
            "figure-18 or figure-19; repeatable."
        ),
    ] = None,
    quick: options.Quick = False,
    out: options.Results = Path("runs/paper"),
) -> None:
    """Reproduce the paper's figures and tables on one page, and judge the agreement."""
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


for _name, _summary in descriptions().items():
    _add(_name, _summary)
bench.command()(stress)
bench.command()(paper)
