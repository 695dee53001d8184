"""What each feature of a scene costs: per evaluation of the accelerations and per run.

A scene starts from the bare chain and features are switched on. Runs last at most `DURATION` and
chains that fold come to rest before it; magnets without contact are stopped at `BLIND`, before they
run into each other. The time of a run is split by measured prices: the share of the chain, and that
of magnets and sliding friction (forces), are their prices an evaluation, at the mean of start and
end, times the evaluations; what is left is contact, friction at rest, stepping and the calls.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.engine.workspace import new_work
from magfold_env.laws.integrators import double_euler
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.reporting.timing import Task, take_turns
from magfold_env.scene import Scene, load_scene
from magfold_env.shapes import headings
from magfold_env.simulation.pack import pack
from magfold_env.simulation.session import Session

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
    "the same, recorded": REAL,
    "the same, in a tube": REAL | TUBE,
    "the same, loaded at mouth": REAL | AT_MOUTH,
}


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every row of `FEATURES`."""
    rounds = 3 if quick else 9
    scenes = {name: build(changes) for name, changes in FEATURES.items()}
    progress(0.0, "runs")
    runs = {name: _run(scene, name) for name, scene in scenes.items()}
    times = take_turns(runs, rounds, tick=lambda share: progress(0.6 * share, "runs"))
    ended = {name: _ended(scene, name) for name, scene in scenes.items()}
    kernels: dict[str, Task] = {}
    for name, scene in scenes.items():
        kernels[f"{name}, start"] = _evaluations(scene, headings(np.array(scene.start_angles)))
        kernels[f"{name}, end"] = _evaluations(scene, ended[name].angles)
    taken = take_turns(kernels, rounds, tick=lambda share: progress(0.6 + 0.4 * share, "kernels"))
    prices = {
        name: 1e6
        * (taken[f"{name}, start"].median + taken[f"{name}, end"].median)
        / (2 * EVALUATIONS)
        for name in scenes
    }
    chain = prices[CHAIN]
    rows: list[Row] = []
    for name, session in ended.items():
        count, run_time, price = session.evaluations, 1e6 * times[name].median, prices[name]
        rows.append(
            {
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
                "forces [%]": 100.0 * count * (price - chain) / run_time,
                "chain [%]": 100.0 * count * chain / run_time,
                "rest [%]": 100.0 * (1.0 - count * price / run_time),
            }
        )
    shown: list[Row] = [
        {
            "features": row["features"],
            "evals": row["evaluations"],
            "run, ms": 1e-3 * float(row["run [µs]"]),
            "each, µs": row["run / evaluations [µs]"],
            "smooth, µs": row["smooth evaluation [µs]"],
            "forces %": round(float(row["forces [%]"])),
            "chain %": round(float(row["chain [%]"])),
            "rest %": round(float(row["rest [%]"])),
        }
        for row in rows
    ]
    title = f"Cost by feature, {SEQUENCE}, at most {DURATION} s simulated"
    return Measurement("features", rows, [Table(title, shown)])


def build(changes: dict[str, Any]) -> Scene:
    """Return the drawn scene of a row."""
    scene = load_scene(SEQUENCE).replace(**{**BARE, **changes})
    blind = scene.magnets is not None and not scene.contact
    scene = scene.replace(duration=BLIND if blind else DURATION)
    return scene.draw(np.random.default_rng(SEED))


def finish(session: Session) -> None:
    """Run a session to its end."""
    while session.status is None and session.released < session.n:
        session.feed_one()
    session.settle()


def _session(scene: Scene, name: str) -> Session:
    return Session(scene, FRAME_RATE if name.endswith("recorded") else None)


def _run(scene: Scene, name: str) -> Task:
    def prepare() -> Callable[[], None]:
        session = _session(scene, name)
        return lambda: finish(session)

    return prepare


def _ended(scene: Scene, name: str) -> Session:
    session = _session(scene, name)
    finish(session)
    return session


def _evaluations(scene: Scene, angles: Array) -> Task:
    """Evaluate the smooth accelerations `EVALUATIONS` times at headings (n,) [rad].

    Double Euler without any time to go does it, within a compiled loop as integrators do.
    """
    model = pack(scene.replace(mount="pinned"))
    work, y = new_work(model), np.zeros(2 * (scene.n + 2))
    y[: scene.n] = angles
    return lambda: lambda: double_euler(model, work, y, 0.0, EVALUATIONS)
