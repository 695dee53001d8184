"""Run every benchmark, keep what is finished, and report everything on one page.

A shared machine changes its pace, and times taken an hour apart compare only as far as it did not.
So the same fixed work is timed before and after every part: a pendulum's swing
(`contenders.bare_pendulum`), which like the engine's kernels is compiled arithmetic on numbers that
fit into the cache.
"""

from __future__ import annotations

import json
import time
from pathlib import Path

from rich.markup import escape

from magfold_env.benchmarks import runner, suite_page
from magfold_env.benchmarks.contenders.bare_pendulum import prepare_swing
from magfold_env.benchmarks.results import Effort, Entry, Result, entries
from magfold_env.benchmarks.whole.skipping import variants
from magfold_env.checkpoint import Checkpoint
from magfold_env.files import write_text
from magfold_env.reporting import machine, plotting, tables
from magfold_env.reporting.page import write_page
from magfold_env.reporting.timing import Spread, take_turns

PAGE, RESULTS = "report.html", "bench.json"
PACE_ROUNDS = 9


def run(effort: Effort, out: Path) -> bool:
    """Measure all parts that are not in the folder yet; returns whether all could be.

    Parameters
    ----------
    effort
        Whether everything is measured, or less of it.
    out
        Folder of the page, of a folder a benchmark with CSV and PNG files, of everything as JSON
        and of what is finished, from which a killed run goes on.

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
    console = runner.report_console()
    identity = machine.identity()
    kept = Checkpoint(out / "state", {"kind": "bench", "effort": effort, **identity})
    done = {each.title: each for each in kept.read(Result.from_json)}
    out.mkdir(parents=True, exist_ok=True)
    plan, missing = entries(effort), dict[str, str]()
    for entry in plan:
        if entry.title in done:
            console.print(f"{entry.title}: kept", highlight=False)
            continue
        try:
            measured = _measure(entry, effort)
            _write_files(entry, measured, out)
        except Exception as error:  # a part that breaks must not lose the others
            missing[entry.title] = f"{type(error).__name__}: {error}"
            console.print(escape(f"{entry.title}: {missing[entry.title]}"), style="red")
            continue
        done[entry.title] = measured
        kept.add(measured.to_json())
        kept.save()
        console.print(f"{entry.title}: {measured.seconds:.1f} s", highlight=False)
    system = identity | {k: v for k, v in machine.describe().items() if k in machine.PASSING}
    parts = [done[entry.title].to_json() for entry in plan if entry.title in done]
    everything = {"machine": system, "effort": effort, "missing": missing, "parts": parts}
    write_text(out / RESULTS, json.dumps(everything, indent=1, allow_nan=False) + "\n")
    write_page(suite_page.page(effort, plan, done, missing, system, out), out / PAGE)
    for name in (PAGE, RESULTS):
        console.print(f"written: {out / name}", highlight=False, soft_wrap=True)
    return not missing


def _measure(entry: Entry, effort: Effort) -> Result:
    """Measure a part, and the machine's pace before and after it."""
    entry.part.check()
    before = measure_pace().median
    begun = time.perf_counter()
    found = runner.measure(entry.title, entry.part, effort == "quick")
    seconds = time.perf_counter() - begun
    return Result(entry.title, entry.name, found, seconds, (before, measure_pace().median))


def _write_files(entry: Entry, result: Result, out: Path) -> None:
    """Write a part's CSV file and its diagram."""
    folder, found = out / entry.benchmark, result.found
    folder.mkdir(exist_ok=True)
    if found.rows:
        write_text(folder / f"{entry.name}.csv", tables.to_csv(found.rows))
        runner.draw(entry.name, entry.part, found, folder)


def measure_pace() -> Spread:
    """Return what the fixed work takes [s]."""
    scene = variants()[-1].scene
    return take_turns({"swing": lambda: prepare_swing(scene)}, PACE_ROUNDS)["swing"].spread
