"""What each feature of a scene costs: per evaluation of the accelerations and per run.

A scene starts from the bare chain and features are switched on. Runs last at most `DURATION` and
chains that fold come to rest before it; magnets without contact are stopped at `BLIND`, before they
run into each other. The time of a run is split by measured prices: the share of the chain, and that
of magnets and sliding friction (forces), are their prices an evaluation, at the mean of start and
end, times the evaluations; what is left is contact, friction at rest, stepping and the calls.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from magfold_env.benchmarks.diagrams import name_bars
from magfold_env.benchmarks.runs import ended, run_task
from magfold_env.engine.state import Array
from magfold_env.engine.workspace import new_work
from magfold_env.laws.integrators import double_euler
from magfold_env.reporting import plotting, tables, timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.scene import Scene, load_scene
from magfold_env.shapes import headings
from magfold_env.simulation.pack import pack

SEQUENCE = "paper/sequence-3"
DURATION = 1.0  # [s] at most, from the last release
BLIND = 0.01  # [s] for magnets without contact, before they run into each other
FRAME_RATE = 240.0  # [1/s]
EVALUATIONS = 1000  # in one sample of the kernel
SEED = 0  # of the start angles

BARE: dict[str, Any] = {"mount": "free", "magnets": None, "friction": 0.0, "contact": False}
MAGNETS: dict[str, Any] = load_scene(SEQUENCE).model_dump()["magnets"]
POINTS = {"model": "points", "remanence": 0.6, "width": 0.006, "thickness": 0.0025, "nodes": 3}
GRAVITY = {"in_plane": (0.0, -9.8)}
TUBE = {"mount": "tube", "feed": {"speed": 0.1, "loading": "preloaded"}}
AT_MOUTH = {"mount": "tube", "feed": {"speed": 0.1, "loading": "at_mouth"}}
REAL = {"magnets": MAGNETS, "contact": True, "friction": 0.35}

CHAIN = "pinned, gravity"  # the row without forces between components or from the floor
RECORDED = "the same, recorded"
FEATURES: dict[str, dict[str, Any]] = {
    CHAIN: {"mount": "pinned", "gravity": GRAVITY},
    "pinned, gravity, contact": {"mount": "pinned", "gravity": GRAVITY, "contact": True},
    "pinned, gravity, friction": {"mount": "pinned", "gravity": GRAVITY, "friction": 0.35},
    "magnets": {"magnets": MAGNETS},
    "magnets as points": {"magnets": POINTS},
    "magnets, gravity": {"magnets": MAGNETS, "gravity": GRAVITY},
    "magnets, contact": {"magnets": MAGNETS, "contact": True},
    "magnets, friction": {"magnets": MAGNETS, "friction": 0.35},
    "magnets, contact, friction": REAL,
    RECORDED: REAL,
    "the same, in a tube": REAL | TUBE,
    "the same, loaded at mouth": REAL | AT_MOUTH,
}
PARTS = {
    "chain [%]": "chain",
    "forces [%]": "magnets, sliding friction",
    "rest [%]": "contact, rest, stepping, calls",
}
"""What the time of a run is spent on, by column."""


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every row of `FEATURES`."""
    rounds = 3 if quick else 9
    scenes = {name: build(changes) for name, changes in FEATURES.items()}
    rates = {name: FRAME_RATE if name == RECORDED else None for name in scenes}
    progress(0.0, "runs")
    runs = {name: run_task(scene, frame_rate=rates[name]) for name, scene in scenes.items()}
    times = timing.take_turns(runs, rounds, tick=lambda share: progress(0.6 * share, "runs"))
    sessions = {name: ended(scene, rates[name]) for name, scene in scenes.items()}
    kernels: dict[tuple[str, str], timing.Task] = {}
    for name, scene in scenes.items():
        kernels[name, "start"] = _evaluations(scene, headings(np.array(scene.start_angles)))
        kernels[name, "end"] = _evaluations(scene, sessions[name].angles)
    taken = timing.take_turns(
        kernels, rounds, tick=lambda share: progress(0.6 + 0.4 * share, "kernels")
    )
    ends = {name: taken[name, "start"].median + taken[name, "end"].median for name in scenes}
    prices = {name: 1e6 * both / (2 * EVALUATIONS) for name, both in ends.items()}
    chain = prices[CHAIN]
    rows: list[Row] = []
    shown: list[Row] = []
    for name, session in sessions.items():
        count, run_time, price = session.evaluations, 1e6 * times[name].median, prices[name]
        spent = {"forces [%]": count * (price - chain), "chain [%]": count * chain}
        shares = {part: 100.0 * time / run_time for part, time in spent.items()}
        row: Row = {
            "features": name,
            "end": str(session.status),
            "simulated [s]": session.time,
            "steps": session.steps,
            "evaluations": count,
            "run [µs]": run_time,
            "lower quartile [µs]": 1e6 * times[name].spread.low,
            "upper quartile [µs]": 1e6 * times[name].spread.high,
            "run / evaluations [µs]": run_time / max(count, 1),
            "smooth evaluation [µs]": price,
            **shares,
            "rest [%]": 100.0 * (1.0 - count * price / run_time),
        }
        rows.append(row)
        shown.append(
            {
                "features": name,
                "evals": count,
                "run, ms": 1e-3 * run_time,
                "each, µs": row["run / evaluations [µs]"],
                "smooth, µs": price,
                "forces %": round(float(row["forces [%]"])),
                "chain %": round(float(row["chain [%]"])),
                "rest %": round(float(row["rest [%]"])),
            }
        )
    title = f"Cost by feature, {SEQUENCE}, at most {DURATION} s simulated"
    return Measurement(rows, [Table(title, shown)])


def build(changes: dict[str, Any]) -> Scene:
    """Return the drawn scene of a row."""
    scene = load_scene(SEQUENCE).replace(**{**BARE, **changes})
    blind = scene.magnets is not None and not scene.contact
    scene = scene.replace(duration=BLIND if blind else DURATION)
    return scene.draw(np.random.default_rng(SEED))


def _evaluations(scene: Scene, angles: Array) -> timing.Task:
    """Evaluate the smooth accelerations `EVALUATIONS` times at headings (n,) [rad].

    Double Euler without any time to go does it, within a compiled loop as integrators do.
    """
    model = pack(scene.replace(mount="pinned"))
    work, y = new_work(model), np.zeros(2 * (scene.n + 2))
    y[: scene.n] = angles
    return timing.unprepared(lambda: double_euler(model, work, y, 0.0, EVALUATIONS))


def draw(rows: list[Row]) -> Any:
    """Bars of the time an evaluation takes in a run, by what it is spent on."""
    figure, (axis,) = plotting.panels(1, "Cost of an evaluation by feature", 9.5, 5.2)
    place = np.arange(len(rows))
    total = tables.numbers(rows, "run / evaluations [µs]")
    left = np.zeros(len(rows))
    for (column, label), k in zip(PARTS.items(), (1, 5, 3), strict=True):
        width = total * np.clip(tables.numbers(rows, column), 0.0, 100.0) / 100.0
        colour = plotting.COLOURS[k]
        axis.barh(place, width, left=left, color=colour, label=label, height=0.65)
        left += width
    for y, value, row in zip(place, total, rows, strict=True):
        per_run = float(row["run [µs]"]) / 1e3
        text = f" {value:.3g} µs × {float(row['evaluations']):.0f} = {per_run:.3g} ms"
        axis.text(max(left[y], value), y, text, va="center", fontsize=8, color=plotting.INK)
    axis.set_xlim(0.0, 1.4 * float(total.max()))
    names = [str(row["features"]) for row in rows]
    name_bars(axis, names, "run time / evaluations [µs]; at the bar: × evaluations = a run")
    plotting.legend(axis, "upper right")
    return figure
