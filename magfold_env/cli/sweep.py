"""`magfold sweep`: release a chain many times for each value of one or two parameters."""

import math
from typing import Annotated, Any, cast

import numpy as np
import typer

from magfold_env.cli import ensemble, options
from magfold_env.ensembles import sweeps
from magfold_env.scene import Problem, SceneError, load_scene

_COUNT = 9  # default number of values in a range


def sweep(  # noqa: PLR0913 - one parameter per option
    scene: options.SceneName,
    *,
    over: Annotated[
        list[str],
        typer.Option(
            help="A number of the scene and its values, evenly from LOW to HIGH or listed, once "
            "or twice: friction=0.05:0.5, feed.speed=0.02:0.2:5:log, magnets.remanence=0.6,1.2."
        ),
    ],
    runs: Annotated[int, typer.Option(help="Number of releases at each point.")] = 100,
    seed: options.DrawSeed = 0,
    mode: options.ReleaseMode = None,
    speed: options.Speed = None,
    friction: options.Friction = None,
    spread: options.Widths = None,
    outcome: Annotated[
        str | None,
        typer.Option(
            help="A word, a status or both, as 'LRL folded': the only one to be drawn, and shown "
            "beside the most frequent ones."
        ),
    ] = None,
    workers: options.WorkerCount = None,
    backend: options.BackendName = None,
    out: options.Out = None,
    png: options.Png = None,
) -> None:
    """Release a chain many times at each point of a grid of one or two of its parameters."""
    ensemble.check_pictures(out, png)
    grid = grid_of(over)
    changed = ensemble.changed_scene(
        load_scene(scene), mode=mode, speed=speed, friction=friction, spreads=spread
    )
    chosen = None if outcome is None else sweeps.Outcome.parse(outcome, changed.n)
    total = runs * math.prod(map(len, grid.values()))
    with options.progress_of(total) as tell:
        made = sweeps.sweep(
            changed, grid, runs, seed, workers=workers, backend=cast("Any", backend),
            state=None if out is None else out / "state", progress=lambda made, _: tell(made),
        )  # fmt: skip
    show(made, chosen)
    draw = options.drawing("draw_sweep", made, outcome=chosen)
    options.save(
        (out and out / "sweep.json", made.to_json),
        (out and out / "outcomes.csv", made.to_csv),
        (png, draw),
        (out and out / "sweep.png", draw),
    )


def grid_of(texts: list[str]) -> dict[str, list[float]]:
    """Return the values by key from texts ``KEY=VALUES``, one text per parameter of the scene.

    Values within a range are rounded to twelve digits.
    """
    options.refuse_repeated("--over", texts)
    grid: dict[str, list[float]] = {}
    for text in texts:
        key, _, values = text.partition("=")
        try:
            grid[key] = _range(values) if ":" in values else list(map(float, values.split(",")))
        except ValueError as error:
            reason = f"must be KEY=LOW:HIGH, …:COUNT, …:COUNT:log or KEY=A,B,…; {error}"
            raise SceneError([Problem("--over", text, reason)]) from None
    return grid


def _range(text: str) -> list[float]:
    low, high, *more = text.split(":")
    first, last = float(low), float(high)
    count = int(more[0]) if more else _COUNT
    log = more[1:] == ["log"]
    if len(more) > 1 and not log:
        raise ValueError("nothing but 'log' may follow COUNT")
    if not -math.inf < first < last < math.inf:
        raise ValueError("LOW must be less than HIGH")
    if not 2 <= count <= sweeps.MOST:
        raise ValueError(f"COUNT must be 2 to {sweeps.MOST}")
    if log and first <= 0.0:
        raise ValueError("LOW must be greater than 0 for log")
    with np.errstate(all="ignore"):  # reported as values that are not allowed
        values = (np.geomspace if log else np.linspace)(first, last, count).tolist()
    return [first, *(float(f"{value:.12g}") for value in values[1:-1]), last]


def show(made: sweeps.Sweep, chosen: sweeps.Outcome | None) -> None:
    """Print the most frequent outcome at each point, and the share of the chosen outcome."""
    columns = dict.fromkeys(made.over, True) | {"most frequent": False}
    columns |= {"runs": True, "share": True, "95 %": True}
    if chosen is not None:
        columns[str(chosen)] = True
    releases = len(made.ensembles[0])
    title = f"{len(made)} points of {releases} releases, seed {made.seed}, the same draws at each"
    shown = options.table(title, columns)
    for k, (point, each) in enumerate(zip(made.points, made.ensembles, strict=True)):
        if len(made.shape) > 1 and k % made.shape[-1] == 0:
            shown.add_section()
        first = next(iter(sweeps.outcomes(each)))
        cells = [str(first), *ensemble.cells(each.probability(*first))]
        if chosen is not None:
            cells.append(str(each.probability(*chosen)))
        shown.add_row(*(f"{value:.6g}" for value in point.values()), *cells)
    options.show(shown)
