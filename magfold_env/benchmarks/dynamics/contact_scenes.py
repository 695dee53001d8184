"""Run time against error where components touch: located events against plain time-stepping.

The engine's default locates events and changes to Moreau's scheme while things touch; beside it,
Moreau's scheme takes every step. Errors are of the relative angles, at the end and at their worst
on the way, against the default at a `FINER` times tighter tolerance than the tightest one measured.
A chain that folds completely ends at its stops, and its error there says little; the way tells.
Scenes whose reference moves by more than `CLOSE` when its start is moved by `NUDGE` are set aside.
Magnets keep the scene's accuracy throughout.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np

from magfold_env.benchmarks.dynamics.features import finish
from magfold_env.benchmarks.dynamics.moreau_only import moreau_only
from magfold_env.engine.state import Array
from magfold_env.fold import Fold
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.reporting.timing import take_turns
from magfold_env.scene import Scene, load_scene
from magfold_env.simulation.session import Session

FINER = 30.0
STEPS_ALLOWED = 10_000_000  # the accuracy of the reference must not be cut short by the work cap
DURATION = 1.0  # [s] from the last release; folds take a fifth of it
FRAME_RATE = 2000.0  # [1/s] at which motions are compared
SPEED = 0.1  # [m/s] of the tube's feed
NUDGE = 1e-6  # [rad]
CLOSE = 0.02  # [rad] what an angle may be off
ENGINE, MOREAU = "events + Moreau", "Moreau only"
METHODS = {ENGINE: nullcontext, MOREAU: moreau_only}


@dataclass(frozen=True)
class Effort:
    """How much work a run of the benchmark may be."""

    sequences: tuple[int, ...]
    seeds: int
    tolerances: tuple[float, ...]
    tighter: tuple[float, ...]
    """Further tolerances for Moreau's scheme, of first order, to reach the same errors with."""
    rounds: int
    """Samples of every timing."""

    @classmethod
    def of(cls, quick: bool) -> Effort:
        """Return the effort of a quick or a full run."""
        if quick:
            return cls((3,), 1, (1e-2, 1e-3), (1e-4,), 2)
        return cls((1, 2, 3), 2, (1e-2, 3e-3, 1e-3, 3e-4), (1e-4, 3e-5), 3)

    def of_method(self, method: str) -> tuple[float, ...]:
        """Return the tolerances of a method."""
        return self.tolerances + (self.tighter if method == MOREAU else ())


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure all contact scenes."""
    effort = Effort.of(quick)
    part = Measurement("contact", [])
    scenes = contact_scenes(effort)
    for k, (name, kind, scene) in enumerate(scenes):
        progress(k / len(scenes), name)
        part.rows.extend(measure(name, kind, scene, effort))
    for kind in dict.fromkeys(kind for _, kind, _ in scenes):
        mine = [row for row in clear(part.rows) if row["kind"] == kind]
        total = sum(other == kind for _, other, _ in scenes)
        kept = len({row["scene"] for row in mine})
        if kept:
            part.tables.append(_table(kind, mine, effort))
            part.findings.append(_finding(kind, mine))
        if kept < total:
            part.findings.append(
                f"{kind}: {total - kept} of {total} scenes set aside: moving the start by "
                f"{NUDGE:g} rad moves the reference by more than {CLOSE} rad"
            )
    return part


def clear(rows: list[Row]) -> list[Row]:
    """Return the rows of scenes that are not set aside."""
    return [row for row in rows if float(row["sensitivity [rad]"]) <= CLOSE]


def contact_scenes(effort: Effort) -> list[tuple[str, str, Scene]]:
    """Return name, kind and scene: free with and without friction, and pushed out of a tube."""
    kinds = {
        "free, no friction": {"mount": "free", "friction": 0.0},
        "free, friction 0.35": {"mount": "free", "friction": 0.35},
        f"tube, {SPEED} m/s": {"mount": "tube", "friction": 0.35, "feed": {"speed": SPEED}},
    }
    found: list[tuple[str, str, Scene]] = []
    for kind, changes in kinds.items():
        for number in effort.sequences:
            base = load_scene(f"paper/sequence-{number}").replace(duration=DURATION, **changes)
            for seed in range(effort.seeds):
                scene = base.draw(np.random.default_rng(seed))
                found.append((f"sequence {number}, seed {seed}, {kind}", kind, scene))
    return found


def measure(name: str, kind: str, scene: Scene, effort: Effort) -> list[Row]:
    """Return a row for each method and tolerance."""
    exact = fold(scene, min(effort.tolerances) / FINER)
    moved = error_on_the_way(fold(nudged(scene), min(effort.tolerances) / FINER), exact)
    settings = [(method, t) for method in METHODS for t in effort.of_method(method)]
    tasks = {f"{method} {t:g}": _task(scene, method, t) for method, t in settings}
    times = take_turns(tasks, effort.rounds, shortest=0.0)
    rows: list[Row] = []
    for method, tolerance in settings:
        with METHODS[method]():
            end = fold(scene, tolerance)
        taken = times[f"{method} {tolerance:g}"].spread
        rows.append(
            {
                "scene": name,
                "kind": kind,
                "method": method,
                "tolerance [rad]": tolerance,
                "final error [rad]": float(np.abs(end.joint_angles - exact.joint_angles).max()),
                "error [rad]": error_on_the_way(end, exact),
                "word": end.word,
                "status": end.status.value,
                "sensitivity [rad]": moved,
                "same word": int(end.word == exact.word),
                "steps": end.steps,
                "evaluations": end.evaluations,
                **taken.time_cells("ms", 1e3),
            }
        )
    return rows


def nudged(scene: Scene) -> Scene:
    """Return a drawn scene whose joint angles begin a little, and alternately, off."""
    assert scene.start_angles is not None
    return scene.replace(
        start_angles=tuple(a + (-1) ** k * NUDGE for k, a in enumerate(scene.start_angles))
    )


def fold(scene: Scene, tolerance: float) -> Fold:
    """Simulate a drawn scene at a tolerance [rad]."""
    session = _session(scene, tolerance, FRAME_RATE)
    finish(session)
    return session.fold()


def error_on_the_way(fold: Fold, exact: Fold) -> float:
    """Largest difference of a relative angle at any time [rad]; a chain at rest stays so."""
    mine, other = _joints(fold), _joints(exact)
    both = max(len(mine), len(other))
    mine, other = (np.concatenate([j, np.repeat(j[-1:], both - len(j), 0)]) for j in (mine, other))
    return float(np.abs(mine - other).max())


def _joints(fold: Fold) -> Array:
    """Relative angles at equal intervals, then at the end (m, n − 1) [rad]."""
    assert fold.trajectory is not None
    angles = np.concatenate([fold.trajectory.angles, fold.angles[None]])
    return np.diff(angles, axis=1)


def _session(scene: Scene, tolerance: float, frame_rate: float | None = None) -> Session:
    caps = {"max_steps": STEPS_ALLOWED, "max_steps_per_second": STEPS_ALLOWED}
    changed = scene.replace(solver={"tolerance": tolerance, **caps})
    return Session(changed, frame_rate)


def _task(scene: Scene, method: str, tolerance: float) -> Callable[[], Callable[[], None]]:
    def prepare() -> Callable[[], None]:
        session = _session(scene, tolerance)

        def call() -> None:
            with METHODS[method]():
                finish(session)

        return call

    return prepare


def _table(kind: str, rows: list[Row], effort: Effort) -> Table:
    shown: list[Row] = []
    for method in METHODS:
        for tolerance in effort.of_method(method):
            mine = [
                row
                for row in rows
                if (row["method"], row["tolerance [rad]"]) == (method, tolerance)
            ]
            shown.append(
                {
                    "method": method,
                    "tolerance": tolerance,
                    "on the way": float(np.median(column(mine, "error [rad]"))),
                    "worst end": float(column(mine, "final error [rad]").max()),
                    "same word": f"{int(column(mine, 'same word').sum())} of {len(mine)}",
                    "ms": float(np.median(column(mine, "time [ms]"))),
                    "evals": float(np.median(column(mine, "evaluations"))),
                    "steps": float(np.median(column(mine, "steps"))),
                }
            )
    return Table(
        f"Folds with contact, {kind}: errors [rad] and cost, medians but for the end", shown
    )


def column(rows: list[Row], name: str) -> Array:
    """Return a column of numbers."""
    return np.array([float(row[name]) for row in rows])


def cost_of_close(rows: list[Row], method: str) -> Array:
    """Least time [ms] at which each scene's motion is close to its reference, ∞ if it never is.

    Tighter tolerances must be close too: a lucky hit does not count.
    """
    scenes = list(dict.fromkeys(str(row["scene"]) for row in rows))
    costs: list[float] = []
    for scene in scenes:
        mine = [row for row in rows if (row["scene"], row["method"]) == (scene, method)]
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
