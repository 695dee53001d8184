"""Whole folds at several tolerances: what they cost, how exact they are, and the first use's cost.

Chains of six: sequences are drawn so that they pull towards a folded word, and kept if the
reference, at a tolerance of `REFERENCE`, folds. Errors are those of the relative angles at the end.
A fold that ends at its stops is exact there or wrong by much, so a tolerance counts as good enough
only if every fold ends within `CLOSE` of its reference.

Folds with contact: the engine's default locates events and changes to Moreau's scheme while things
touch; beside it, Moreau's scheme takes every step. Errors are of the relative angles, at the end
and at their worst on the way, against the default at a `FINER` times tighter tolerance than the
tightest one measured. A chain that folds completely ends at its stops, and its error there says
little; the way tells. Scenes whose reference moves by more than `CLOSE` when its start is moved by
`NUDGE` are set aside. Magnets keep the scene's accuracy throughout.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, nullcontext
from typing import Any, NamedTuple
from unittest import mock

import numpy as np

from magfold_bench import runs
from magfold_bench.laws.random_scenes import designed_sequence
from magfold_bench.presentation import median, panels_by
from magfold_bench.runs import CLOSE, KINDS, NUDGE, SPEED, Setting
from magfold_env.engine import entries as at
from magfold_env.engine.state import Array
from magfold_env.fold import Fold, FoldStatus
from magfold_env.reporting import plotting, tables, timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.scene import Scene, Solver, load_scene
from magfold_env.simulation.chains import Chains

COMPONENTS = 6
REFERENCE = 1e-5  # [rad]
DEFAULT = Solver().tolerance

FINER = 30.0
DURATION = 1.0  # [s] of contact scenes from the last release; folds take a fifth of it
ENDLESS = 2**60  # steps

FIRST, LATER = "first use", "later use"
LIMITS = {FIRST: 60.0, LATER: 3.0}  # [s]
LATER_USES = 5

_FOLD = (
    "import magfold_env as mf; "
    "mf.simulate(mf.load_scene('paper/sequence-3').replace(mount='tube', feed={'speed': 0.5}))"
)


@contextmanager
def moreau_only() -> Generator[None]:
    """Let all sessions within the block take Moreau's steps only; not for use with threads.

    The engine's own loop is told that Moreau's scheme has all its steps still to take.
    """
    turn = Chains.turn

    def moreau(chains: Chains, row: int, until: float) -> int:
        chains.counters[row, at.MOREAU_LEFT] = ENDLESS
        return turn(chains, row, until)

    with mock.patch.object(Chains, "turn", moreau):
        yield


ENGINE, MOREAU = "events + Moreau", "Moreau only"
METHODS = {ENGINE: nullcontext, MOREAU: moreau_only}


class FoldsEffort(NamedTuple):
    """How much work a run of the benchmark may be."""

    sequences: int
    rounds: int
    tolerances: tuple[float, ...]


QUICK_FOLDS = FoldsEffort(3, 2, (1e-2, DEFAULT))
FULL_FOLDS = FoldsEffort(40, 5, (1e-2, 3e-3, 1e-3, DEFAULT))


class ContactEffort(NamedTuple):
    """How much work a run of the benchmark may be."""

    sequences: tuple[int, ...]
    seeds: int
    tolerances: tuple[float, ...]
    tighter: tuple[float, ...]  # more for Moreau's scheme, of first order, to reach the same errors
    rounds: int  # samples of every timing

    @property
    def settings(self) -> list[tuple[str, float]]:
        """Every method with each of its tolerances."""
        extra = {MOREAU: self.tighter}
        return [
            (method, tolerance)
            for method in METHODS
            for tolerance in self.tolerances + extra.get(method, ())
        ]


QUICK_CONTACT = ContactEffort((3,), 1, (1e-2, 1e-3), (1e-4,), 2)
FULL_CONTACT = ContactEffort((1, 2, 3), 2, (1e-2, 3e-3, 1e-3, 3e-4), (1e-4, 3e-5), 3)


def folds(quick: bool, progress: Progress) -> Measurement:
    """Measure every kind of fold at every tolerance."""
    effort = QUICK_FOLDS if quick else FULL_FOLDS
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
        found.tables.append(_folds_table(kind, mine))
        found.findings.append(finding(kind, mine))
    return found


def scene_of(kind: str, seed: int) -> Scene:
    """Return a drawn scene; in tubes every other one is fed backward."""
    rng = np.random.default_rng([seed, COMPONENTS])
    feed = {"speed": SPEED, "direction": ("forward", "backward")[seed % 2]}
    scene = Scene(sequence=designed_sequence(rng, COMPONENTS))
    return scene.replace(**{**KINDS[kind], "feed": feed}).draw(rng)


def at_tolerance(scene: Scene, tolerance: float) -> Scene:
    """Return a scene with a tolerance [rad], and the usual cap on its work."""
    return scene.replace(solver={"tolerance": tolerance})


def _close(rows: list[Row]) -> int:
    return int((tables.numbers(rows, "final error [rad]") <= CLOSE).sum())


def _at(tolerance: float, rows: list[Row]) -> list[Row]:
    return tables.select(rows, {"tolerance [rad]": tolerance})


def _folds_table(kind: str, rows: list[Row]) -> Table:
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
    return Table(f"A whole fold of {COMPONENTS} components, {kind}: medians", shown)


def finding(kind: str, rows: list[Row]) -> str:
    """Return the cost at the default tolerance, and at the loosest that is good enough."""
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
    """Start Python, import the package and fold a chain out of its tube; first without a cache."""
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
    return Measurement(rows, [Table("one fold in a process of its own", table)])


def _children() -> float:
    """Processor time of all processes that were started and have ended [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def contact(quick: bool, progress: Progress) -> Measurement:
    """Measure all contact scenes."""
    effort = QUICK_CONTACT if quick else FULL_CONTACT
    found = Measurement()
    scenes = contact_scenes(effort)
    for case, _ in tables.each_case(progress, scenes, lambda case: case[0]):
        found.rows.extend(measure(*case, effort))
    for kind in KINDS:
        mine = tables.select(clear(found.rows), kind=kind)
        total = sum(other == kind for _, other, _ in scenes)
        kept = len(tables.distinct(mine, "scene"))
        if kept:
            found.tables.append(_contact_table(kind, mine, effort))
            found.findings.append(_contact_finding(kind, mine))
        if kept < total:
            found.findings.append(
                f"{kind}: {total - kept} of {total} scenes set aside: moving the start by "
                f"{NUDGE:g} rad moves the reference by more than {CLOSE} rad"
            )
    return found


def clear(rows: list[Row]) -> list[Row]:
    """Return the rows of scenes that are not set aside."""
    return [row for row in rows if float(row["sensitivity [rad]"]) <= CLOSE]


def contact_scenes(effort: ContactEffort) -> list[tuple[str, str, Scene]]:
    """Return name, kind and scene: free with and without friction, and pushed out of a tube."""
    found: list[tuple[str, str, Scene]] = []
    for kind, changes in KINDS.items():
        for number in effort.sequences:
            base = load_scene(f"paper/sequence-{number}").replace(duration=DURATION, **changes)
            for seed in range(effort.seeds):
                scene = base.draw(np.random.default_rng(seed))
                found.append((f"sequence {number}, seed {seed}, {kind}", kind, scene))
    return found


def measure(name: str, kind: str, scene: Scene, effort: ContactEffort) -> list[Row]:
    """Return a row for each method and tolerance."""
    finest = min(effort.tolerances) / FINER
    exact = recorded_fold(scene, finest)
    moved = runs.difference(recorded_fold(runs.nudged(scene), finest), exact)
    tasks = {setting: _task(scene, *setting) for setting in effort.settings}
    times = timing.take_turns(tasks, effort.rounds, shortest=0.0)
    rows: list[Row] = []
    for method, tolerance in effort.settings:
        with METHODS[method]():
            end = recorded_fold(scene, tolerance)
        rows.append(
            {
                "scene": name,
                "kind": kind,
                "method": method,
                "tolerance [rad]": tolerance,
                "final error [rad]": runs.final_difference(end, exact),
                "error [rad]": runs.difference(end, exact),
                "word": end.word,
                "status": end.status.value,
                "sensitivity [rad]": moved,
                "same word": int(end.word == exact.word),
                "steps": end.steps,
                "evaluations": end.evaluations,
                **times[method, tolerance].spread.time_cells("ms", 1e3),
            }
        )
    return rows


def recorded_fold(scene: Scene, tolerance: float) -> Fold:
    """Simulate a drawn scene at a tolerance [rad] and record it."""
    return runs.recorded(Setting("adaptive", tolerance).on(scene))


def _task(scene: Scene, method: str, tolerance: float) -> timing.Task:
    task = runs.run_task(Setting("adaptive", tolerance).on(scene))

    def prepare() -> Callable[[], None]:
        finish = task()

        def call() -> None:
            with METHODS[method]():
                finish()

        return call

    return prepare


def _contact_table(kind: str, rows: list[Row], effort: ContactEffort) -> Table:
    shown: list[Row] = []
    for method, tolerance in effort.settings:
        mine = tables.select(rows, {"method": method, "tolerance [rad]": tolerance})
        shown.append(
            {
                "method": method,
                "tolerance": tolerance,
                "on the way": median(mine, "error [rad]"),
                "worst end": float(tables.numbers(mine, "final error [rad]").max()),
                "same word": f"{int(tables.numbers(mine, 'same word').sum())} of {len(mine)}",
                "ms": median(mine, "time [ms]"),
                "evals": median(mine, "evaluations"),
                "steps": median(mine, "steps"),
            }
        )
    title = f"Folds with contact, {kind}: errors [rad] and cost, medians but for the end"
    return Table(title, shown)


def cost_of_close(rows: list[Row], method: str) -> Array:
    """Least time [ms] at which each scene's motion is close to its reference, ∞ if it never is.

    Tighter tolerances must be close too: a lucky hit does not count.
    """
    costs: list[float] = []
    for scene in tables.distinct(rows, "scene"):
        mine = tables.select(rows, scene=scene, method=method)
        mine.sort(key=lambda row: float(row["tolerance [rad]"]))
        best = np.inf
        for row in mine:
            if float(row["error [rad]"]) > CLOSE:
                break
            best = min(best, float(row["time [ms]"]))
        costs.append(best)
    return np.array(costs)


def _contact_finding(kind: str, rows: list[Row]) -> str:
    parts: list[str] = []
    for method in METHODS:
        costs = cost_of_close(rows, method)
        reached = int(np.isfinite(costs).sum())
        middle = float(np.median(costs))
        typical = f"{middle:.3g} ms" if np.isfinite(middle) else "out of reach"
        parts.append(f"{method} {typical} ({reached} of {costs.size} scenes reach it)")
    within = f"median time for a motion within {CLOSE} rad at all times"
    return f"{kind}: {within}: " + ", ".join(parts)


def draw_contact(rows: list[Row]) -> Any:
    """Error on the way against run time, a panel a kind of scene; thin lines are single scenes.

    Scenes that are set aside are left out, if any other is left.
    """
    rows = clear(rows) or rows
    title = "Folds with contact: error on the way against run time"
    labels = "run time [s]", "largest error of a relative angle at any time [rad]"
    figure, panels = panels_by(rows, ("kind",), title, labels)
    for axis, here in panels:
        for k, method in enumerate(METHODS):
            mine = tables.select(here, method=method)
            colour = plotting.COLOURS[k + 1]
            for scene in tables.distinct(mine, "scene"):
                one = _time_and_error(tables.select(mine, scene=scene))
                axis.loglog(*one, color=colour, linewidth=0.7, alpha=0.45)
            tolerances = sorted(tables.distinct(mine, "tolerance [rad]"), reverse=True)
            groups = [tables.select(mine, {"tolerance [rad]": t}) for t in tolerances]
            middle = np.array([np.median(_time_and_error(g), axis=1) for g in groups]).T
            style = {"marker": plotting.MARKERS[k], "markersize": 6, "linewidth": 2.2}
            axis.loglog(*middle, color=colour, label=method, **style)
            texts = [f"{tolerance:g}" for tolerance in tolerances]
            plotting.label_points(axis, middle.T, texts, left=k == 0, color=colour)
        axis.tick_params(axis="x", which="minor", labelbottom=False)
    said = "medians over scenes, by tolerance [rad]"
    plotting.legend(panels[0][0], "lower right", title_fontsize=8, title=said)
    return figure


def _time_and_error(rows: list[Row]) -> Any:
    """Return times [s] and errors [rad], shape (2, k)."""
    return np.stack([1e-3 * tables.numbers(rows, "time [ms]"), tables.numbers(rows, "error [rad]")])
