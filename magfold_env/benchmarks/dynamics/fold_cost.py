"""What a whole fold of six components costs, from release to rest, at several tolerances.

Sequences are drawn so that they pull towards a folded word, and kept if the reference, at a
tolerance of `REFERENCE`, folds. Errors are those of the relative angles at the end. A fold that
ends at its stops is exact there or wrong by much, so a tolerance counts as good enough only if
every fold ends within `CLOSE` of its reference.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from magfold_env.benchmarks.dynamics.features import finish
from magfold_env.fold import Fold, FoldStatus
from magfold_env.laws.random_scenes import designed_sequence
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.reporting.timing import Task, take_turns
from magfold_env.scene import Scene, Solver
from magfold_env.simulation.session import Session

COMPONENTS = 6
FRICTION = 0.35
SPEED = 0.1  # [m/s] of the tube's feed
REFERENCE = 1e-5  # [rad]
CLOSE = 0.02  # [rad]
DEFAULT = Solver().tolerance

KINDS = {
    "free, no friction": {"mount": "free", "friction": 0.0},
    f"free, friction {FRICTION}": {"mount": "free", "friction": FRICTION},
    f"tube, {SPEED} m/s": {"mount": "tube", "friction": FRICTION},
}


@dataclass(frozen=True)
class Effort:
    """How much work a run of the benchmark may be."""

    sequences: int
    rounds: int
    tolerances: tuple[float, ...]

    @classmethod
    def of(cls, quick: bool) -> Effort:
        """Return the effort of a quick or a full run."""
        if quick:
            return cls(3, 2, (1e-2, DEFAULT))
        return cls(40, 5, (1e-2, 3e-3, 1e-3, DEFAULT))


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every kind of fold at every tolerance."""
    effort = Effort.of(quick)
    part = Measurement("folds", [])
    for k, kind in enumerate(KINDS):
        progress(k / len(KINDS), kind)
        scenes = {f"{s}": scene_of(kind, s) for s in range(effort.sequences)}
        exact = {name: fold(scene, REFERENCE) for name, scene in scenes.items()}
        good = {name: s for name, s in scenes.items() if exact[name].status is FoldStatus.FOLDED}
        tasks = {
            f"{name} {tolerance}": _task(scene, tolerance)
            for name, scene in good.items()
            for tolerance in effort.tolerances
        }
        times = take_turns(tasks, effort.rounds, shortest=0.0)
        for name, scene in good.items():
            for tolerance in effort.tolerances:
                end = fold(scene, tolerance)
                off = np.abs(end.joint_angles - exact[name].joint_angles).max()
                part.rows.append(
                    {
                        "kind": kind,
                        "sequence": name,
                        "word": end.word,
                        "status": end.status.value,
                        "tolerance [rad]": tolerance,
                        "final error [rad]": float(off),
                        "steps": end.steps,
                        "evaluations": end.evaluations,
                        **times[f"{name} {tolerance}"].spread.time_cells("ms", 1e3),
                    }
                )
        part.tables.append(_table(kind, part.rows, effort))
        part.findings.append(_finding(kind, part.rows, effort))
    return part


def scene_of(kind: str, seed: int) -> Scene:
    """Return a drawn scene; in tubes every other one is fed backward."""
    rng = np.random.default_rng([seed, COMPONENTS])
    feed = {"speed": SPEED, "direction": ("forward", "backward")[seed % 2]}
    scene = Scene(sequence=designed_sequence(rng, COMPONENTS))
    return scene.replace(feed=feed, **KINDS[kind]).draw(rng)


def fold(scene: Scene, tolerance: float) -> Fold:
    """Simulate a drawn scene at a tolerance [rad]."""
    session = _session(scene, tolerance)
    finish(session)
    return session.fold()


def _session(scene: Scene, tolerance: float) -> Session:
    return Session(scene.replace(solver={"tolerance": tolerance}))


def _task(scene: Scene, tolerance: float) -> Task:
    def prepare() -> Callable[[], None]:
        session = _session(scene, tolerance)
        return lambda: finish(session)

    return prepare


def _of(kind: str, tolerance: float, rows: list[Row]) -> list[Row]:
    return [r for r in rows if r["kind"] == kind and r["tolerance [rad]"] == tolerance]


def _values(rows: list[Row], name: str) -> list[float]:
    return [float(row[name]) for row in rows]


def _close(rows: list[Row]) -> int:
    return sum(error <= CLOSE for error in _values(rows, "final error [rad]"))


def _table(kind: str, rows: list[Row], effort: Effort) -> Table:
    shown: list[Row] = []
    for tolerance in effort.tolerances:
        mine = _of(kind, tolerance, rows)
        if mine:
            low, median, high = np.quantile(_values(mine, "time [ms]"), [0.25, 0.5, 0.75])
            shown.append(
                {
                    "tolerance": tolerance,
                    "folds": len(mine),
                    f"within {CLOSE} rad": _close(mine),
                    "evals": float(np.median(_values(mine, "evaluations"))),
                    "steps": float(np.median(_values(mine, "steps"))),
                    "ms": float(median),
                    "quartiles, ms": f"{low:.2f} to {high:.2f}",
                    "longest, ms": max(_values(mine, "time [ms]")),
                }
            )
    return Table(f"A whole fold of {COMPONENTS} components, {kind}: medians", shown)


def _finding(kind: str, rows: list[Row], effort: Effort) -> str:
    """Return the cost at the default tolerance, and at the loosest that is good enough."""
    parts: list[str] = []
    for tolerance in sorted(effort.tolerances, reverse=True):
        mine = _of(kind, tolerance, rows)
        if mine and _close(mine) == len(mine):
            price = np.median(_values(mine, "time [ms]"))
            parts.append(f"{price:.3g} ms at tolerance {tolerance:g} (all {len(mine)} folds)")
            break
    mine = _of(kind, DEFAULT, rows)
    if mine:
        price = np.median(_values(mine, "time [ms]"))
        close = f"{_close(mine)} of {len(mine)}"
        parts.append(f"{price:.3g} ms at the default, {DEFAULT:g} ({close})")
    return f"{kind}: median time of a fold that ends within {CLOSE} rad: " + ", ".join(parts)
