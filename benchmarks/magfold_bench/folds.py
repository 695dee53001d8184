"""Cost and accuracy of whole folds at several tolerances, and the cost of the package's first use.

The chains have six components. Each sequence is drawn so that its magnets pull the chain towards a
folded word, and is kept if the chain folds in the reference run, at the tolerance `REFERENCE`.
Errors are those of the joint angles at the end. A chain that ends at its stops is either exact or
very wrong, so a tolerance is sufficient only if every chain ends within `CLOSE` of its reference.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from typing import NamedTuple

import numpy as np

from magfold_bench import runs, tables, timing
from magfold_bench.laws.random_scenes import designed_sequence
from magfold_bench.presentation import median
from magfold_bench.runs import CLOSE, KINDS, SPEED
from magfold_bench.tables import Measurement, Progress, Row, Table
from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene, Solver

COMPONENTS = 6
REFERENCE = 1e-5  # [rad]
DEFAULT = Solver().tolerance


FIRST, LATER = "first use", "later use"
LIMITS = {FIRST: 60.0, LATER: 3.0}  # largest processor times [s]
LATER_USES = 5

_FOLD = (
    "import magfold_env as mf; "
    "mf.simulate(mf.load_scene('paper/sequence-3').replace(mount='tube', feed={'speed': 0.5}))"
)


class Effort(NamedTuple):
    """How much a run of the benchmark measures."""

    sequences: int
    rounds: int
    tolerances: tuple[float, ...]


QUICK = Effort(3, 2, (1e-2, DEFAULT))
FULL = Effort(40, 5, (1e-2, 3e-3, 1e-3, DEFAULT))


def folds(quick: bool, progress: Progress) -> Measurement:
    """Measure every kind of fold at every tolerance."""
    effort = QUICK if quick else FULL
    found = Measurement()
    for kind, _ in tables.each_case(progress, list(KINDS)):
        scenes = {f"{s}": scene_of(kind, s) for s in range(effort.sequences)}
        tight = {name: at_tolerance(scene, REFERENCE) for name, scene in scenes.items()}
        exact = {name: runs.ended(scene).fold() for name, scene in tight.items()}
        cases = {
            (name, tolerance): at_tolerance(scene, tolerance)
            for name, scene in scenes.items()
            if exact[name].status is FoldStatus.FOLDED
            for tolerance in effort.tolerances
        }
        tasks = {case: runs.run_task(scene) for case, scene in cases.items()}
        times = timing.take_turns(tasks, effort.rounds, shortest=0.0)
        for (name, tolerance), scene in cases.items():
            end = runs.ended(scene).fold()
            found.rows.append(
                {
                    "kind": kind,
                    "sequence": name,
                    "word": end.word,
                    "status": end.status.value,
                    "tolerance [rad]": tolerance,
                    "final error [rad]": runs.final_difference(end, exact[name]),
                    "steps": end.steps,
                    "evaluations": end.evaluations,
                    **times[name, tolerance].spread.time_cells("ms", 1e3),
                }
            )
        mine = tables.select(found.rows, kind=kind)
        found.tables.append(_table(kind, mine))
        found.findings.append(finding(kind, mine))
    return found


def scene_of(kind: str, seed: int) -> Scene:
    """Return a drawn scene; in tubes, every second chain is fed backward."""
    rng = np.random.default_rng([seed, COMPONENTS])
    feed = {"speed": SPEED, "direction": ("forward", "backward")[seed % 2]}
    scene = Scene(sequence=designed_sequence(rng, COMPONENTS))
    return scene.replace(**{**KINDS[kind], "feed": feed}).draw(rng)


def at_tolerance(scene: Scene, tolerance: float) -> Scene:
    """Return a scene with another tolerance [rad] and the default step limit."""
    return scene.replace(solver={"tolerance": tolerance})


def _close(rows: list[Row]) -> int:
    return int((tables.numbers(rows, "final error [rad]") <= CLOSE).sum())


def _at(tolerance: float, rows: list[Row]) -> list[Row]:
    return tables.select(rows, {"tolerance [rad]": tolerance})


def _table(kind: str, rows: list[Row]) -> Table:
    shown: list[Row] = []
    for tolerance in tables.distinct(rows, "tolerance [rad]"):
        mine = _at(tolerance, rows)
        times = timing.spread_of(tables.numbers(mine, "time [ms]"))
        shown.append(
            {
                "tolerance": tolerance,
                "folds": len(mine),
                f"within {CLOSE} rad": _close(mine),
                "evals": median(mine, "evaluations"),
                "steps": median(mine, "steps"),
                "ms": times.median,
                "quartiles, ms": f"{times.low:.2f} to {times.high:.2f}",
                "longest, ms": float(tables.numbers(mine, "time [ms]").max()),
            }
        )
    return Table(f"Whole folds of {COMPONENTS} components, {kind}: medians", shown)


def finding(kind: str, rows: list[Row]) -> str:
    """State the cost at the default tolerance and at the loosest sufficient tolerance."""
    parts: list[str] = []
    for tolerance in sorted(tables.distinct(rows, "tolerance [rad]"), reverse=True):
        mine = _at(tolerance, rows)
        if _close(mine) == len(mine):
            price = median(mine, "time [ms]")
            parts.append(f"{price:.3g} ms at tolerance {tolerance:g} (all {len(mine)} folds)")
            break
    mine = _at(DEFAULT, rows)
    if mine:
        close = f"{_close(mine)} of {len(mine)}"
        parts.append(f"{median(mine, 'time [ms]'):.3g} ms at the default, {DEFAULT:g} ({close})")
    return f"{kind}: median time of a fold that ends within {CLOSE} rad: " + ", ".join(parts)


def first_use(quick: bool, progress: Progress) -> Measurement:
    """Time starting Python, importing the package and folding a chain, first without a cache."""
    rows: list[Row] = []
    uses = [FIRST, *[LATER] * (1 if quick else LATER_USES)]
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "NUMBA_CACHE_DIR": cache, "OMP_NUM_THREADS": "1"}
        for kind, _ in tables.each_case(progress, uses):
            begun, used = time.perf_counter(), _children()
            command = [sys.executable, "-c", _FOLD]
            subprocess.run(command, env=environment, check=True, capture_output=True)
            taken = time.perf_counter() - begun
            cells: Row = {"processor time [s]": _children() - used, "time [s]": taken}
            rows.append({"process": kind, **cells})
    table: list[Row] = []
    for kind, limit in LIMITS.items():
        mine = sorted(tables.numbers(tables.select(rows, process=kind), "processor time [s]"))
        middle = float(mine[len(mine) // 2])
        within = f"{'within' if middle <= limit else 'NOT within'} {limit:.0f} s"
        table.append({"process": kind, "processor time [s]": round(middle, 1), "wanted": within})
    return Measurement(rows, [Table("one fold in a separate process", table)])


def _children() -> float:
    """Return the processor time of all child processes that have ended [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
