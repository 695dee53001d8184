"""`magfold score`: play a submitted policy, or submitted actions, on the draws of a seed."""

from pathlib import Path
from typing import Annotated

import typer

from magfold_env.cli import options
from magfold_env.scoring.score import EPISODES, MINUTES
from magfold_env.scoring.score import score as scored
from magfold_env.scoring.track import TASKS


def score(
    file: Annotated[
        Path,
        typer.Argument(help="A policy (.safetensors), or actions chosen beforehand (.json)."),
    ],
    *,
    env: Annotated[
        str | None,
        typer.Option(metavar="ID", help="The track, such as MagFold/UnknownFloor-v0."),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="The one announced for the draws; 0, to try, if left out."),
    ] = None,
    episodes: Annotated[
        int | None,
        typer.Option(
            min=1,
            help=f"How many; {EPISODES} if left out. Tasks, {TASKS} at most, take turns: under "
            f"{10 * TASKS} episodes say little of each.",
        ),
    ] = None,
    minutes: Annotated[float, typer.Option(help="The most it may take.")] = MINUTES,
    json: options.Json = None,
) -> None:
    """Play a policy on random draws unknown to it, or actions on the draws they were chosen for.

    Nothing in the file is run as code. A file of actions contains the track, the seed and the
    episodes for which the actions were chosen.
    """
    options.check_outputs({"--json": json})
    with options.progress_bar() as bar:
        task = bar.add_task("")
        found = scored(
            file, env, seed, episodes, minutes,
            lambda played, wanted: bar.update(task, completed=played, total=wanted),
        )  # fmt: skip
    ((name, row),) = found.rows.items()
    rate, low, high = (100 * each for each in row.success)
    seconds, (run,) = found.provenance["seconds"], row.runs
    rows = {
        "track": found.id,
        "played": f"{len(run.success)} episodes of seed {found.seed}, {seconds:.0f} s",
        "success": f"{rate:.1f} % ({low:.1f}–{high:.1f})",
        "mean score": f"{row.score:.4f}",
    }
    options.show(options.entries(f"{name}, {row.kind}", rows))
    typer.echo(f"SHA-256: {row.files[0].sha256}")
    options.save((json, found.write))
