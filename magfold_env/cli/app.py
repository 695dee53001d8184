"""The `magfold` command: simulate folds, rank their energies, design sequences, measure."""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, cast

import typer
from rich.console import Console

from magfold_env.cli.bench import bench
from magfold_env.cli.errors import errors_in_one_line
from magfold_env.cli.proof import paper, stress
from magfold_env.cli.report import (
    decisions_table,
    fold_table,
    one_by_one_table,
    scenes_table,
    searches_to_json,
    states_table,
)
from magfold_env.designer.result import Objective, Search
from magfold_env.files import write_text
from magfold_env.fold import FoldStatus
from magfold_env.minimiser import Among, Minimum, Mode, minimise
from magfold_env.parallel import Backend, Workers
from magfold_env.reporting.plotting import figure_class
from magfold_env.scene import Scene, load_scene, scene_names
from magfold_env.simulation.simulate import simulate

app = typer.Typer(
    help="Self-folding chains of magnets.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,  # plain messages, so that a wrong option is told in one line
    pretty_exceptions_enable=False,
)
app.add_typer(bench, name="bench")

SceneName = Annotated[str, typer.Argument(help="Name of a shipped scene, or path of a YAML file.")]
Png = Annotated[Path | None, typer.Option(help="Draw the result as a picture.")]
Json = Annotated[Path | None, typer.Option(help="Write the result as JSON.")]
WorkerCount = Annotated[int | None, typer.Option(help="Runs at a time; all cores if left out.")]
BackendName = Annotated[
    str | None, typer.Option(help="threads, processes or ray; what suits if left out.")
]
Address = Annotated[str | None, typer.Option(help="Address of a Ray cluster.")]


@app.command()
def fold(  # noqa: PLR0913 - one parameter an option
    scene: SceneName,
    *,
    mount: Annotated[str | None, typer.Option(help="pinned, free or tube.")] = None,
    direction: Annotated[str | None, typer.Option(help="forward or backward.")] = None,
    speed: Annotated[float | None, typer.Option(help="Feed speed [m/s].")] = None,
    friction: Annotated[float | None, typer.Option(help="Friction coefficient.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything random.")] = 0,
    gif: Annotated[Path | None, typer.Option(help="Write the motion as an animated GIF.")] = None,
    png: Png = None,
    html: Annotated[
        Path | None, typer.Option(help="Write a page that plays the motion in any browser.")
    ] = None,
    sheet: Annotated[
        Path | None, typer.Option(help="Write a printable assembly sheet, PDF or PNG.")
    ] = None,
    json: Json = None,
) -> None:
    """Simulate one fold and print how it ended; exit code 1 if the simulation failed."""
    from magfold_env.cli import fold as cli_fold  # noqa: PLC0415 - for this command only

    files = cli_fold.Files(gif, png, html, sheet, json)
    with errors_in_one_line(), _busy("simulating"):
        _check_outputs(files.options)
        feed = {"direction": direction, "speed": speed}
        changes = {
            "mount": mount,
            "friction": friction,
            "feed": {key: value for key, value in feed.items() if value is not None} or None,
        }
        given = {key: value for key, value in changes.items() if value is not None}
        changed = load_scene(scene).replace(**given)
        if files.drawn:
            _need_render()
        files.check_sheet()
        begun = time.perf_counter()
        result = simulate(changed, seed=seed, frame_rate=files.frame_rate)
        taken = time.perf_counter() - begun
    Console().print(fold_table(result, taken))
    with errors_in_one_line(), _busy("drawing"):
        cli_fold.write(files, changed, scene, result)
    _say_written(*files)
    if result.status is FoldStatus.FAILED:
        raise typer.Exit(1)


@app.command(name="minimise")
def minimise_command(
    scene: SceneName,
    mode: Annotated[str, typer.Option(help="free, forward or backward.")] = "free",
    top: Annotated[int, typer.Option(help="How many states to show.")] = 5,
    among: Annotated[
        str, typer.Option(help="Words to rank: all, folded (no S) or stable (and no conflict).")
    ] = "all",
    png: Png = None,
    json: Json = None,
) -> None:
    """Rank the states of a chain by magnetic energy, and search it component by component."""
    with errors_in_one_line(), _busy("searching"):
        _check_outputs({"--png": png, "--json": json})
        loaded = load_scene(scene)
        if png is not None:
            _need_render()
        # The options are text; the minimiser says which are allowed.
        found = minimise(loaded, cast("Mode", mode), top, cast("Among", among))
        feeds = _feeds(loaded)
    console = Console()
    console.print(states_table(found))
    if found.decisions:
        console.print(decisions_table(found))
    console.print(one_by_one_table(loaded, feeds))
    with errors_in_one_line(), _busy("drawing"):
        if png is not None:
            from magfold_env.render import draw_states  # noqa: PLC0415

            draw_states(loaded, found.states, png)
        if json is not None:
            write_text(json, searches_to_json(loaded, found, *feeds))
    _say_written(png, json)


@app.command(name="ensemble")
def ensemble_command(  # noqa: PLR0913 - one parameter an option
    scene: SceneName,
    *,
    runs: Annotated[int, typer.Option(help="How many releases.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of all draws.")] = 0,
    mode: Annotated[
        str | None, typer.Option(help="free, forward or backward, in place of the scene's.")
    ] = None,
    speed: Annotated[float | None, typer.Option(help="Feed speed [m/s].")] = None,
    friction: Annotated[float | None, typer.Option(help="Friction coefficient.")] = None,
    spread: Annotated[
        list[str] | None,
        typer.Option(help="NAME=WIDTH: start_angles [rad], or one of the scene's spreads."),
    ] = None,
    workers: WorkerCount = None,
    backend: BackendName = None,
    address: Address = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for JSON, CSV and PNG files; a killed command goes on in it."),
    ] = None,
    png: Png = None,
) -> None:
    """Release a chain many times and show the probability of every word and status."""
    from magfold_env.cli import ensemble  # noqa: PLC0415 - for this command only

    with errors_in_one_line():
        _check_outputs({"--png": png})
        if out is not None or png is not None:
            _need_render()
            figure_class()
        changed = ensemble.changed_scene(
            load_scene(scene), mode=mode, speed=speed, friction=friction, spreads=spread or []
        )
        team = Workers(workers, cast("Backend | None", backend), address)
        made = ensemble.make(changed, runs, seed, team, out)
        ensemble.show(made)
        _say_written(*ensemble.write(made, out, png))


@app.command(name="design")
def design_command(  # noqa: PLR0913 - one parameter an option
    target: Annotated[str, typer.Argument(help="Word over L, S and R, one letter a joint.")],
    *,
    scene: Annotated[
        str | None,
        typer.Option(help="Scene whose casing, magnets, friction and spreads count."),
    ] = None,
    mode: Annotated[str, typer.Option(help="free, forward or backward.")] = "forward",
    objective: Annotated[
        str, typer.Option(help="probability, ground, unique, gap or sensitivity.")
    ] = "probability",
    search: Annotated[
        str | None, typer.Option(help="exhaustive, annealing or cross-entropy.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of everything random.")] = 0,
    speed: Annotated[
        list[float] | None, typer.Option(help="Feed speed to try [m/s]; may repeat.")
    ] = None,
    budget: Annotated[int, typer.Option(help="Releases of the search, about.")] = 2000,
    goal: Annotated[float, typer.Option(help="Probability that is enough.")] = 0.9,
    runs: Annotated[int, typer.Option(help="Releases that judge the result.")] = 100,
    workers: WorkerCount = None,
    backend: BackendName = None,
    address: Address = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for JSON and the scene; a killed command goes on in it."),
    ] = None,
    json: Json = None,
) -> None:
    """Search for magnets and a feed speed that fold into a word; exit code 1 if none are found."""
    from magfold_env.cli import design as cli_design  # noqa: PLC0415 - for this command only
    from magfold_env.designer import design  # noqa: PLC0415

    with errors_in_one_line():
        _check_outputs({"--json": json})
        with cli_design.progress_bar() as progress:
            found = design(
                target,
                None if scene is None else load_scene(scene),
                cast("Mode", mode),
                cast("Objective", objective),
                search=cast("Search | None", search), seed=seed, speeds=speed or None,
                budget=budget, goal=goal, runs=runs,
                workers=workers, backend=cast("Backend | None", backend), address=address,
                state=None if out is None else out / "state",
                progress=progress,
            )  # fmt: skip
        cli_design.show(found)
        _say_written(*cli_design.write(found, out, json))
    if not found.reached:
        raise typer.Exit(1)


@app.command()
def play(
    *,
    target: Annotated[
        str | None, typer.Option(help="Word to fold, one letter a joint; drawn if left out.")
    ] = None,
    scene: Annotated[str | None, typer.Option(help="Tube scene, by name or path.")] = None,
    components: Annotated[int | None, typer.Option(help="Chain length.")] = None,
    fidelity: Annotated[str, typer.Option(help="dynamics or quasistatic.")] = "dynamics",
    randomisation: Annotated[str, typer.Option(help="none, nominal, strong or scene.")] = "none",
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything random.")] = 0,
) -> None:
    """Fold a chain by keyboard, in a window; H shows the keys."""
    from magfold_env.cli import play as cli_play  # noqa: PLC0415 - for this command only

    with errors_in_one_line():
        _need_render()
        cli_play.play(scene, target, components, fidelity, randomisation, seed)


app.command()(stress)
app.command()(paper)


@app.command()
def scenes() -> None:
    """List the shipped scenes."""
    with errors_in_one_line():
        Console().print(scenes_table({name: load_scene(name) for name in scene_names()}))


def _feeds(scene: Scene) -> list[Minimum]:
    """Return the component-by-component searches that reach an end."""
    found: list[Minimum] = []
    modes: tuple[Mode, ...] = ("forward", "backward")
    for mode in modes:
        # A search may shut itself in: its next component then overlaps with every letter.
        with suppress(ValueError):
            found.append(minimise(scene, mode))
    return found


def _say_written(*paths: Path | None) -> None:
    for path in paths:
        if path is not None:
            typer.echo(f"written: {path}")


def _need_render() -> None:
    """Fail before the long work if pictures are wanted that cannot be drawn."""
    try:
        import magfold_env.render  # noqa: F401, PLC0415  # pyright: ignore[reportUnusedImport]
    except ImportError as error:
        raise ValueError(str(error)) from error


def _check_outputs(paths: Mapping[str, Path | None]) -> None:
    """Fail before the long work if a result could not be written."""
    for option, path in paths.items():
        if path is not None and not path.parent.is_dir():
            raise ValueError(f"{option}: {str(path)!r} is not allowed; its folder must exist")
        if path is not None and path.is_dir():
            raise ValueError(f"{option}: {str(path)!r} is not allowed; must not be a folder")


def _busy(what: str) -> Any:
    """Return a context that shows on stderr, if that is a terminal, that work is going on."""
    return Console(stderr=True).status(f"{what} ...")
