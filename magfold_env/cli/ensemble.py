"""What `magfold ensemble` does: change the scene, release it, show and write what came of it."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn
from rich.table import Table

from magfold_env.ensembles import Ensemble, ensemble, predictions, release
from magfold_env.files import write_text
from magfold_env.minimiser import Mode
from magfold_env.parallel import Workers
from magfold_env.reporting.statistics import Share
from magfold_env.scene import Problem, Scene, SceneError, Spreads

_ANGLES = "start_angles"


def changed_scene(
    scene: Scene,
    *,
    mode: str | None = None,
    speed: float | None = None,
    friction: float | None = None,
    spreads: Sequence[str] = (),
) -> Scene:
    """Return the scene that the options ask for.

    Parameters
    ----------
    scene
        As it was loaded.
    mode
        How the chain is released; None leaves it as it is.
    speed
        Feed speed [m/s]; None leaves it as it is.
    friction
        Coefficient; None leaves it as it is.
    spreads
        Texts like ``friction=0.1``; ``start_angles`` [rad] also takes back given start angles.

    Raises
    ------
    SceneError
        If an option is not allowed.
    """
    if mode is not None:
        scene = release(scene, cast("Mode", mode))
    changes: dict[str, Any] = {} if speed is None else {"feed": {"speed": speed}}
    if friction is not None:
        changes["friction"] = friction
    widths = dict(_named_width(text) for text in spreads)
    if _ANGLES in widths:
        changes |= {"start_angle_spread": widths.pop(_ANGLES), "start_angles": None}
    return scene.replace(**changes, spreads=widths)


def make(scene: Scene, runs: int, seed: int, team: Workers, out: Path | None) -> Ensemble:
    """Release a scene with a progress bar on stderr; with a folder, go on where it stopped."""
    console = Console(stderr=True)
    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task("", total=runs)
        return ensemble(
            scene,
            runs,
            seed,
            workers=team.count,
            backend=team.backend,
            address=team.address,
            state=None if out is None else out / "state",
            progress=lambda made, total: bar.update(task, completed=made, total=total),
        )


def show(made: Ensemble) -> None:
    """Print the probabilities, and which searches of the minimiser name each word."""
    console = Console()
    console.print(_outcomes_table(made))
    table = Table(title="By status")
    for name in ("status", "runs", "share", "95 %"):
        table.add_column(name, justify="left" if name == "status" else "right")
    for status, found in made.statuses.items():
        table.add_row(status.value, str(found.successes), *_per_cent(found))
    console.print(table)


def write(made: Ensemble, out: Path | None, png: Path | None) -> list[Path]:
    """Write the files that are wanted and return their paths."""
    from magfold_env.render import draw_ensemble  # noqa: PLC0415 - an extra

    written: list[Path] = []
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        written = [out / name for name in ("ensemble.json", "runs.csv", "outcomes.csv")]
        made.to_json(written[0])
        made.to_csv(written[1])
        write_text(written[2], _outcomes_csv(made))
    pictures = [path for path in (png, out / "ensemble.png" if out else None) if path is not None]
    for path in pictures:
        draw_ensemble(made, path)
    return written + pictures


def _outcomes_table(made: Ensemble) -> Table:
    named: dict[str, list[str]] = {}
    for search, word in predictions(made.scene).items():
        named.setdefault(word, []).append(search.removesuffix(" search"))
    table = Table(title=f"{len(made)} releases, seed {made.seed}")
    searches = "minimiser's search"
    for name in ("word", "status", "runs", "share", "95 %", searches):
        left = name in ("word", "status", searches)
        table.add_column(name, justify="left" if left else "right")
    for (word, status), found in made.outcomes.items():
        by = ", ".join(named.get(word, []))
        table.add_row(word, status.value, str(found.successes), *_per_cent(found), by)
    missed = [f"{word} ({', '.join(by)})" for word, by in named.items() if word not in made.words]
    if missed:
        table.caption = f"The minimiser also names {'; '.join(missed)}."
    return table


def _outcomes_csv(made: Ensemble) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["word", "status", "runs", "probability", "low", "high"])
    for (word, status), found in made.outcomes.items():
        numbers = (found.successes, found.rate, found.low, found.high)
        writer.writerow([word, status.value, *numbers])
    return text.getvalue()


def _per_cent(found: Share) -> tuple[str, str]:
    return f"{found.rate:.1%}", f"{found.low:.1%} to {found.high:.1%}"


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
