"""What `magfold design` does: search, show what speaks for the result, and write it."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from magfold_env.designer import Design
from magfold_env.scene import save_scene

_STAGES = {
    "energies": "comparing sequences by energy",
    "releases": "releasing the best of them",
    "judgement": "releasing the result",
}


@contextmanager
def progress_bar() -> Generator[Any]:
    """Offer a function for `design` that shows its progress on stderr, if that is a terminal."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        tasks: dict[str, Any] = {}

        def show_progress(stage: str, done: float) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(_STAGES[stage], total=1.0)
            bar.update(tasks[stage], completed=done)

        yield show_progress


def show(design: Design) -> None:
    """Print a design and what speaks for it, or why there is none."""
    console = Console()
    if design.scene is None:
        console.print(f"{design.target}: cannot be reached; {design.certificate}", soft_wrap=True)
        return
    table = Table(title=f"{design.target}, {design.mode}: {design.objective}", show_header=False)
    for name, value in _rows(design):
        table.add_row(name, value)
    console.print(table)


def write(design: Design, out: Path | None, json: Path | None) -> list[Path]:
    """Write the files that are wanted and return their paths."""
    written: list[Path] = []
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        written.append(out / "design.json")
        design.to_json(written[0])
        if design.scene is not None:
            written.append(out / "scene.yaml")
            save_scene(design.scene, written[1])
    if json is not None:
        design.to_json(json)
        written.append(json)
    return written


def _rows(design: Design) -> list[tuple[str, str]]:
    rows = [("sequence", " ".join(design.sequence))]
    if design.speed is not None:
        rows.append(("feed", f"{design.mode}, {_speed(design.speed)}"))
    if design.probability is not None:
        fresh = f"{design.probability} of {design.probability.trials} releases of its own"
        rows.append((f"folds into {design.target}", fresh))
    if (evidence := design.evidence) is not None:
        side = "higher" if evidence.gap >= 0.0 else "lower"
        rows += [
            ("energy", f"{1e3 * evidence.energy:.3f} mJ"),
            ("next word", f"{evidence.rival}, {1e3 * abs(evidence.gap):.3f} mJ {side}"),
            ("bears errors of single magnets", f"{100 * evidence.tolerance:.0f} %"),
            ("stable", _stability(evidence.stable, evidence.only_stable)),
        ]
    if design.shortfall is not None:
        rows.append(("below the proven optimum", _short(design)))
    rows.append(("asked", ", ".join(f"{count} {name}" for name, count in design.calls.items())))
    rows.append(("reached", "yes" if design.reached else "no"))
    return rows


def _speed(speed: float | tuple[float, ...]) -> str:
    speeds = speed if isinstance(speed, tuple) else (speed,)
    return ", ".join(f"{each:g}" for each in speeds) + " m/s"


def _stability(stable: bool, only: bool) -> str:
    if not stable:
        return "no"
    return "yes, as the only word" if only else "yes"


def _short(design: Design) -> str:
    shortfall = design.shortfall or 0.0
    if design.objective == "gap":
        return f"by {1e3 * shortfall:.3f} mJ"
    return f"by {100 * shortfall:.1f} %"
