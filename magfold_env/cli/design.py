"""`magfold design`: search for a design, print the evidence for it, and write it."""

from pathlib import Path
from typing import Annotated, Any, cast

import typer
from rich.progress import TaskID

from magfold_env import designer
from magfold_env.cli import options
from magfold_env.scene import load_scene, save_scene

_STAGES = {
    "energies": "comparing sequences by energy",
    "releases": "releasing the best of them",
    "judgement": "releasing the result",
}


def design(  # noqa: PLR0913 - one parameter per option
    target: Annotated[str, typer.Argument(help="Word over L, S and R, one letter a joint.")],
    *,
    scene: Annotated[
        str | None,
        typer.Option(help="Scene that sets the casing, magnets, friction and spreads."),
    ] = None,
    mode: options.Mode = "forward",
    objective: Annotated[
        str, typer.Option(help="probability, ground, unique, gap or sensitivity.")
    ] = "probability",
    search: Annotated[
        str | None, typer.Option(help="exhaustive, annealing or cross-entropy.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of everything random.")] = 0,
    speed: Annotated[
        list[float] | None, typer.Option(help="Feed speed to try [m/s]; may be repeated.")
    ] = None,
    budget: Annotated[
        int, typer.Option(help="Approximate number of releases in the search.")
    ] = 2000,
    goal: Annotated[float, typer.Option(help="Sufficient probability.")] = 0.9,
    runs: Annotated[int, typer.Option(help="Releases that assess the result.")] = 100,
    workers: options.WorkerCount = None,
    backend: options.BackendName = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for JSON and the scene; an interrupted command continues there."),
    ] = None,
    json: options.Json = None,
) -> None:
    """Search for magnets and a feed speed that fold a chain into a word; exit code 1 if none do."""
    options.check_outputs({"--json": json})
    options.check_folder("--out", out)
    given = None if scene is None else load_scene(scene)
    with options.progress_bar() as bar:
        tasks: dict[str, TaskID] = {}

        def show_progress(stage: str, done: float) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(_STAGES[stage], total=1.0)
            bar.update(tasks[stage], completed=done)

        found = designer.design(
            target,
            given,
            # These options are text; the designer checks them.
            cast("Any", mode),
            cast("Any", objective),
            search=cast("Any", search), seed=seed, speeds=speed or None,
            budget=budget, goal=goal, runs=runs,
            workers=workers, backend=cast("Any", backend),
            state=None if out is None else out / "state",
            progress=show_progress,
        )  # fmt: skip
    show(found)
    written = None if out is None or found.scene is None else out / "scene.yaml"
    options.save(
        (out and out / "design.json", found.to_json),
        (written, lambda path: found.scene and save_scene(found.scene, path)),
        (json, found.to_json),
    )
    if not found.reached:
        raise typer.Exit(1)


def show(design: designer.Design) -> None:
    """Print a design and the evidence for it, or the reason why no design exists."""
    if design.scene is None:
        typer.echo(f"{design.target}: cannot be reached; {design.certificate}")
        return
    title = f"{design.target}, {design.mode}: {design.objective}"
    options.show(options.entries(title, design.facts()))
