"""Run every benchmark, keep what is finished, and report everything on one page."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from magfold_env.benchmarks.runner import FILE_WIDTH, run_part
from magfold_env.benchmarks.suite.done import Done
from magfold_env.benchmarks.suite.pace import measure_pace
from magfold_env.benchmarks.suite.page import page
from magfold_env.benchmarks.suite.plan import BENCHMARKS, Effort, Entry, entries
from magfold_env.checkpoint import Checkpoint
from magfold_env.files import write_text
from magfold_env.reporting import machine, plotting, tables
from magfold_env.reporting.page import write_page

PAGE, RESULTS = "report.html", "bench.json"


def run(effort: Effort, out: Path, names: Sequence[str] = BENCHMARKS) -> bool:
    """Measure all parts that are not in the folder yet; returns whether all could be.

    Parameters
    ----------
    effort
        Whether everything is measured, or less of it.
    out
        Folder of the page, of a folder a benchmark with CSV and PNG files, of everything as JSON
        and of what is finished, from which a killed run goes on.
    names
        The benchmarks.

    Raises
    ------
    CheckpointError
        If the folder holds parts of another commit, machine or effort, or damaged ones.
    ValueError
        If matplotlib is not installed.
    """
    try:
        plotting.figure_class()
    except ImportError as error:
        raise ValueError(str(error)) from error
    console = Console()
    if not console.is_terminal:
        console = Console(width=FILE_WIDTH)
    identity = machine.identity()
    kept = Checkpoint(out / "state", {"kind": "bench", "effort": effort, **identity})
    done = {each.name: each for each in kept.read(Done.from_json)}
    out.mkdir(parents=True, exist_ok=True)
    plan, missing = entries(effort, names), dict[str, str]()
    for entry in plan:
        if entry.name in done:
            console.print(f"{entry.name}: kept", highlight=False)
            continue
        try:
            measured = _measure(entry, effort)
            _write_files(entry, measured, out)
        except Exception as error:  # a part that breaks must not lose the others
            missing[entry.name] = f"{type(error).__name__}: {error}"
            console.print(escape(f"{entry.name}: {missing[entry.name]}"), style="red")
            continue
        done[entry.name] = measured
        kept.add(measured.to_json())
        kept.save()
        console.print(f"{entry.name}: {measured.seconds:.1f} s", highlight=False)
    system = identity | {k: v for k, v in machine.describe().items() if k in machine.PASSING}
    parts = [done[entry.name].to_json() for entry in plan if entry.name in done]
    everything = {"machine": system, "effort": effort, "missing": missing, "parts": parts}
    write_text(out / RESULTS, json.dumps(everything, indent=1, allow_nan=False) + "\n")
    write_page(page(effort, plan, done, missing, system, out), out / PAGE)
    for name in (PAGE, RESULTS):
        console.print(f"written: {out / name}", highlight=False, soft_wrap=True)
    return not missing


def _measure(entry: Entry, effort: Effort) -> Done:
    """Measure a part, and the machine's pace before and after it."""
    entry.benchmark.check([entry.part])
    before = measure_pace().median
    begun = time.perf_counter()
    part = run_part(entry.name, entry.runner, effort == "quick")
    seconds = time.perf_counter() - begun
    return Done(entry.name, part, seconds, (before, measure_pace().median))


def _write_files(entry: Entry, done: Done, out: Path) -> None:
    """Write a part's CSV file and its diagram."""
    folder, part = out / entry.benchmark.name, done.part
    folder.mkdir(exist_ok=True)
    if part.rows:
        write_text(folder / f"{part.name}.csv", tables.to_csv(part.rows))
        plotting.draw(part, entry.benchmark.drawings, folder)
