"""Measure what is chosen, part by part, and write numbers, pictures and the page."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from magfold_env.checkpoint import Checkpoint
from magfold_env.files import physics_digest, write_text
from magfold_env.paper.page import Done, page
from magfold_env.paper.parts import PARTS
from magfold_env.paper.reproduction import Reproduction
from magfold_env.reporting import machine
from magfold_env.reporting.page import write_page
from magfold_env.reporting.tables import Progress, to_csv

PAGE, NUMBERS = "paper.html", "paper.json"


def choose(only: Sequence[str]) -> list[Reproduction]:
    """Return the parts of these names, in the paper's order; all if there is none.

    Raises
    ------
    ValueError
        If there is no such part.
    """
    for name in only:
        if name not in PARTS:
            raise ValueError(f"--only: {name!r} is not allowed; must be one of {', '.join(PARTS)}")
    return [part for name, part in PARTS.items() if not only or name in only]


def run(only: Sequence[str], quick: bool, out: Path, progress: Progress) -> list[Done]:
    """Measure and write; a folder's finished parts are not measured again, and are on the page.

    Parameters
    ----------
    only
        Names of the parts to measure; all if empty.
    quick
        Whether to measure less.
    out
        Folder of the results, made if need be.
    progress
        Is told the finished share of everything, 0 to 1, and what is going on.

    Returns
    -------
    list of Done
        All parts that the page shows.

    Raises
    ------
    ValueError
        If there is no such part, or the folder holds parts that another version measured.
    """
    chosen = choose(only)
    out.mkdir(parents=True, exist_ok=True)
    records = {name: _load(part, quick, out) for name, part in PARTS.items()}
    todo = [part for part in chosen if records[part.name] is None]
    done = {
        name: _done(PARTS[name], record, out)
        for name, record in records.items()
        if record is not None
    }
    if not todo:
        return _write(done, quick, out)
    written: list[Done] = []
    for k, part in enumerate(todo):

        def tell(share: float, what: str, k: int = k, name: str = part.name) -> None:
            progress((k + min(share, 1.0)) / len(todo), f"{name}: {what}")

        tell(0.0, "begins")
        done[part.name] = _done(part, _measure(part, quick, out, tell), out)
        written = _write(done, quick, out)
    return written


def _checkpoint(part: Reproduction, quick: bool, out: Path) -> Checkpoint:
    effort = "quick" if quick else "full"
    key = {"part": part.name, "quick": quick, "physics": physics_digest()}
    key["magfold_env"] = version("magfold_env")
    return Checkpoint(out / "state" / f"{part.name}-{effort}", key)


def _load(part: Reproduction, quick: bool, out: Path) -> dict[str, Any] | None:
    """Return what was kept of a part, if it is finished."""
    records = _checkpoint(part, quick, out).load()
    return records[0] if records else None


def _measure(part: Reproduction, quick: bool, out: Path, tell: Progress) -> dict[str, Any]:
    """Measure a part and keep the result."""
    system = machine.describe()
    begun = time.perf_counter()
    measured = part.measure(quick, tell)
    record = {"machine": system, "seconds": time.perf_counter() - begun, "measured": measured}
    checkpoint = _checkpoint(part, quick, out)
    checkpoint.add(record)
    checkpoint.save()
    return record


def _done(part: Reproduction, record: dict[str, Any], out: Path) -> Done:
    """Write a part's pictures and tables of numbers."""
    for name, rows in record["measured"].items():
        if rows:
            write_text(out / f"{part.name}-{name}.csv", to_csv(rows))
    pictures = part.draw(record["measured"], out)
    return Done(part, record["measured"], record["machine"], record["seconds"], pictures)


def _write(done: dict[str, Done], quick: bool, out: Path) -> list[Done]:
    """Write the page and all numbers; return what is on it, in the paper's order."""
    shown = [done[name] for name in PARTS if name in done]
    content = {
        each.part.name: {
            "machine": each.machine,
            "seconds": each.seconds,
            "claims": [claim._asdict() for claim in each.claims],
            "measured": each.measured,
        }
        for each in shown
    }
    data = {"quick": quick, "parts": content}
    write_text(
        out / NUMBERS, json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    )
    write_page(page(shown, quick=quick), out / PAGE)
    return shown
