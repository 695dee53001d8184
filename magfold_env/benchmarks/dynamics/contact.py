"""Run time against error where components touch: located events against plain time-stepping.

The engine's default locates events and changes to Moreau's scheme while things touch; beside it,
Moreau's scheme takes every step. Errors are of the relative angles, at the end and at their worst
on the way, against the default at a `FINER` times tighter tolerance than the tightest one measured.
A chain that folds completely ends at its stops, and its error there says little; the way tells.
Scenes whose reference moves by more than `CLOSE` when its start is moved by `NUDGE` are set aside.
Magnets keep the scene's accuracy throughout.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager, nullcontext
from typing import Any, NamedTuple
from unittest import mock

import numpy as np

from magfold_env.benchmarks import runs
from magfold_env.benchmarks.diagrams import panels_by
from magfold_env.benchmarks.runs import CLOSE, KINDS, NUDGE, Setting
from magfold_env.engine.state import MOREAU_LEFT, Array
from magfold_env.fold import Fold
from magfold_env.reporting import plotting, tables, timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.scene import Scene, load_scene
from magfold_env.simulation import session

FINER = 30.0
DURATION = 1.0  # [s] from the last release; folds take a fifth of it
ENDLESS = 2**60  # steps


@contextmanager
def moreau_only() -> Generator[None]:
    """Let all sessions within the block take Moreau's steps only; not for use with threads.

    The engine's own loop is told that Moreau's scheme has all its steps still to take.
    """
    run_chain = session.run_chain

    def run(chain: session.Chain, until: float) -> int:
        _, state, _, _ = chain
        state.counter[MOREAU_LEFT] = ENDLESS
        return run_chain(chain, until)

    with mock.patch.object(session, "run_chain", run):
        yield


ENGINE, MOREAU = "events + Moreau", "Moreau only"
METHODS = {ENGINE: nullcontext, MOREAU: moreau_only}


class Effort(NamedTuple):
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


QUICK = Effort((3,), 1, (1e-2, 1e-3), (1e-4,), 2)
FULL = Effort((1, 2, 3), 2, (1e-2, 3e-3, 1e-3, 3e-4), (1e-4, 3e-5), 3)


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure all contact scenes."""
    effort = QUICK if quick else FULL
    found = Measurement()
    scenes = contact_scenes(effort)
    for case, _ in tables.each_case(progress, scenes, lambda case: case[0]):
        found.rows.extend(measure(*case, effort))
    for kind in KINDS:
        mine = tables.select(clear(found.rows), kind=kind)
        total = sum(other == kind for _, other, _ in scenes)
        kept = len(tables.distinct(mine, "scene"))
        if kept:
            found.tables.append(_table(kind, mine, effort))
            found.findings.append(_finding(kind, mine))
        if kept < total:
            found.findings.append(
                f"{kind}: {total - kept} of {total} scenes set aside: moving the start by "
                f"{NUDGE:g} rad moves the reference by more than {CLOSE} rad"
            )
    return found


def clear(rows: list[Row]) -> list[Row]:
    """Return the rows of scenes that are not set aside."""
    return [row for row in rows if float(row["sensitivity [rad]"]) <= CLOSE]


def contact_scenes(effort: Effort) -> list[tuple[str, str, Scene]]:
    """Return name, kind and scene: free with and without friction, and pushed out of a tube."""
    found: list[tuple[str, str, Scene]] = []
    for kind, changes in KINDS.items():
        for number in effort.sequences:
            base = load_scene(f"paper/sequence-{number}").replace(duration=DURATION, **changes)
            for seed in range(effort.seeds):
                scene = base.draw(np.random.default_rng(seed))
                found.append((f"sequence {number}, seed {seed}, {kind}", kind, scene))
    return found


def measure(name: str, kind: str, scene: Scene, effort: Effort) -> list[Row]:
    """Return a row for each method and tolerance."""
    finest = min(effort.tolerances) / FINER
    exact = fold(scene, finest)
    moved = error_on_the_way(fold(runs.nudged(scene), finest), exact)
    tasks = {setting: _task(scene, *setting) for setting in effort.settings}
    times = timing.take_turns(tasks, effort.rounds, shortest=0.0)
    rows: list[Row] = []
    for method, tolerance in effort.settings:
        with METHODS[method]():
            end = fold(scene, tolerance)
        rows.append(
            {
                "scene": name,
                "kind": kind,
                "method": method,
                "tolerance [rad]": tolerance,
                "final error [rad]": runs.final_difference(end, exact),
                "error [rad]": error_on_the_way(end, exact),
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


def fold(scene: Scene, tolerance: float) -> Fold:
    """Simulate a drawn scene at a tolerance [rad] and record it."""
    return runs.recorded(Setting("adaptive", tolerance).on(scene))


def error_on_the_way(fold: Fold, exact: Fold) -> float:
    """Largest difference of a relative angle from frame to frame [rad], the ends' included."""
    mine, other = _joints(fold), _joints(exact)
    both = max(len(mine), len(other))
    mine, other = (np.concatenate([j, np.repeat(j[-1:], both - len(j), 0)]) for j in (mine, other))
    return float(np.abs(mine - other).max())


def _joints(fold: Fold) -> Array:
    """Relative angles at equal intervals, then at the end (m, n − 1) [rad]."""
    assert fold.trajectory is not None
    angles = np.concatenate([fold.trajectory.angles, fold.angles[None]])
    return np.diff(angles, axis=1)


def _task(scene: Scene, method: str, tolerance: float) -> timing.Task:
    task = runs.run_task(Setting("adaptive", tolerance).on(scene))

    def prepare() -> Callable[[], None]:
        finish = task()

        def call() -> None:
            with METHODS[method]():
                finish()

        return call

    return prepare


def _table(kind: str, rows: list[Row], effort: Effort) -> Table:
    shown: list[Row] = []
    for method, tolerance in effort.settings:
        mine = tables.select(rows, {"method": method, "tolerance [rad]": tolerance})
        shown.append(
            {
                "method": method,
                "tolerance": tolerance,
                "on the way": float(np.median(tables.numbers(mine, "error [rad]"))),
                "worst end": float(tables.numbers(mine, "final error [rad]").max()),
                "same word": f"{int(tables.numbers(mine, 'same word').sum())} of {len(mine)}",
                "ms": float(np.median(tables.numbers(mine, "time [ms]"))),
                "evals": float(np.median(tables.numbers(mine, "evaluations"))),
                "steps": float(np.median(tables.numbers(mine, "steps"))),
            }
        )
    return Table(
        f"Folds with contact, {kind}: errors [rad] and cost, medians but for the end", shown
    )


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


def _finding(kind: str, rows: list[Row]) -> str:
    parts: list[str] = []
    for method in METHODS:
        costs = cost_of_close(rows, method)
        reached = int(np.isfinite(costs).sum())
        middle = float(np.median(costs))
        typical = f"{middle:.3g} ms" if np.isfinite(middle) else "out of reach"
        parts.append(f"{method} {typical} ({reached} of {costs.size} scenes reach it)")
    within = f"median time for a motion within {CLOSE} rad at all times"
    return f"{kind}: {within}: " + ", ".join(parts)


def draw(rows: list[Row]) -> Any:
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
