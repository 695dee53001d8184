"""`magfold stress`: try cases, or a scene again, and print the results."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from magfold_env.cli import options
from magfold_env.scene import errors, load_scene


def stress(
    *,
    cases: Annotated[int, typer.Option(help="Scenes to try.")] = 1000,
    seed: options.DrawSeed = 0,
    only: Annotated[
        list[str] | None, typer.Option(help="A kind of scenes, see the table; may repeat.")
    ] = None,
    workers: Annotated[int, typer.Option(help="Processes.")] = 1,
    minutes: Annotated[
        float | None, typer.Option(help="Begin no more after this time; no limit if left out.")
    ] = None,
    out: options.Results = Path("runs/stress"),
    rerun: Annotated[
        Path | None,
        typer.Option(help="Judge the scene in this file, as --seed draws it, and nothing else."),
    ] = None,
) -> None:
    """Try to break the simulation by random and extreme scenes; exit code 1 if a law is broken."""
    from magfold_bench.stress import campaign, laws, report  # noqa: PLC0415 - for this command only

    with options.errors_in_one_line():
        options.check_folder("--out", out)
        if rerun is not None and not rerun.is_file():
            raise ValueError(f"--rerun: {str(rerun)!r} is not allowed; must be the file of a scene")
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
