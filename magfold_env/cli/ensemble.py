"""`magfold ensemble`: release a chain many times, and print and write the results."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from magfold_env.cli import options
from magfold_env.ensembles import releases
from magfold_env.files import write_text
from magfold_env.reporting.intervals import Share
from magfold_env.reporting.tables import to_csv
from magfold_env.scene import Problem, Scene, SceneError, Spreads, load_scene

_ANGLES = "start_angles"


def ensemble(  # noqa: PLR0913 - one parameter per option
    scene: options.SceneName,
    *,
    runs: Annotated[int, typer.Option(help="How many releases.")] = 1000,
    seed: options.DrawSeed = 0,
    mode: options.ReleaseMode = None,
    speed: options.Speed = None,
    friction: options.Friction = None,
    spread: options.Widths = None,
    workers: options.WorkerCount = None,
    backend: options.BackendName = None,
    out: options.Out = None,
    png: options.Png = None,
) -> None:
    """Release a chain many times and show the probability of every word and status."""
    check_pictures(out, png)
    changed = changed_scene(
        load_scene(scene), mode=mode, speed=speed, friction=friction, spreads=spread
    )
    with options.progress_of(runs) as tell:
        made = releases.ensemble(
            changed, runs, seed, workers=workers, backend=cast("Any", backend),
            state=None if out is None else out / "state", progress=lambda made, _: tell(made),
        )  # fmt: skip
    show(made)
    draw = options.drawing("draw_ensemble", made)
    options.save(
        (out and out / "ensemble.json", made.to_json),
        (out and out / "runs.csv", made.to_csv),
        (out and out / "outcomes.csv", lambda path: write_text(path, to_csv(made.rows()))),
        (png, draw),
        (out and out / "ensemble.png", draw),
    )


def check_pictures(out: Path | None, png: Path | None) -> None:
    """Raise an error before long work if a requested picture or file cannot be written."""
    options.check_outputs({"--png": png})
    options.check_folder("--out", out)
    if out is not None:
        options.need_render()


def changed_scene(
    scene: Scene,
    *,
    mount: str | None = None,
    direction: str | None = None,
    mode: str | None = None,
    speed: float | None = None,
    friction: float | None = None,
    spreads: Sequence[str] | None = None,
) -> Scene:
    """Return a scene with the changes that a command's options request; None changes nothing.

    A spread of ``start_angles`` also removes given start angles. A speed or a direction raises an
    error if the scene has no tube.
    """
    if mode is not None:
        scene = releases.release(scene, cast("Any", mode))
    options.refuse_repeated("--spread", spreads or [])
    widths = dict(map(_named_width, spreads or []))
    feed = {"direction": direction, "speed": speed}
    asked = {"mount": mount, "friction": friction, "feed": _given(feed) or None}
    changes = _given(asked)
    if _ANGLES in widths:
        changes |= {"start_angle_spread": widths.pop(_ANGLES), "start_angles": None}
    changed = scene.replace(**changes, spreads=widths)
    for option, value in {"--direction": direction, "--speed": speed}.items():
        if value is not None and changed.mount != "tube":
            raise ValueError(
                f"{option}: {value!r} is not allowed for mount {changed.mount!r}; must be left out"
            )
    return changed


def show(made: releases.Ensemble) -> None:
    """Print the probability of each outcome, and the minimiser's searches that predict its word."""
    named: dict[str, list[str]] = {}
    for search, word in releases.predictions(made.scene).items():
        named.setdefault(word, []).append(search.removesuffix(" search"))
    numbers = {"runs": True, "share": True, "95 %": True}
    columns = {"word": False, "status": False, **numbers, "minimiser's search": False}
    missed = [f"{word} ({', '.join(by)})" for word, by in named.items() if word not in made.words]
    told = [f"Drawn anew for each: {releases.varied(made.scene)}."]
    if missed:
        told.append(f"The minimiser also names {'; '.join(missed)}.")
    title = f"{len(made)} releases, seed {made.seed}"
    outcomes = options.table(title, columns, " ".join(told))
    for (word, status), found in made.outcomes.items():
        outcomes.add_row(word, status.value, *cells(found), ", ".join(named.get(word, [])))
    statuses = options.table("By status", {"status": False, **numbers})
    for status, found in made.statuses.items():
        statuses.add_row(status.value, *cells(found))
    options.show(outcomes, statuses)


def cells(found: Share) -> tuple[str, str, str]:
    """Return the count, the share and the interval of the share as table cells."""
    return str(found.successes), f"{found.rate:.1%}", f"{found.low:.1%} to {found.high:.1%}"


def _given(values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}


def _named_width(text: str) -> tuple[str, float]:
    name, _, width = text.partition("=")
    names = (_ANGLES, *Spreads.model_fields)
    try:
        if name not in names:
            raise ValueError
        return name, float(width)
    except ValueError:
        allowed = f"must be NAME=WIDTH, a name of {', '.join(names)} and a number"
        raise SceneError([Problem("--spread", text, allowed)]) from None
