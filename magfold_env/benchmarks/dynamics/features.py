"""What each feature of a scene costs: per evaluation of the accelerations and per run.

A scene starts from the bare chain and features are switched on. All runs last at most the same
simulated time; chains that fold come to rest before it. The time of a run is split by measured
prices: the chain's and the magnets' share is their price an evaluation times the evaluations, and
what is left is contact, friction, stepping and the calls from Python.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from magfold_env.benchmarks.dynamics.part import Part, Progress, Row, Table
from magfold_env.benchmarks.timing import Task, take_turns
from magfold_env.engine.dynamics import smooth_accelerations
from magfold_env.engine.jit import kernel
from magfold_env.engine.pack import pack
from magfold_env.engine.session import Session
from magfold_env.engine.state import Array, Model, Work
from magfold_env.engine.workspace import new_work
from magfold_env.scene import Scene
from magfold_env.scene_io import load_scene

SEQUENCE = "paper/sequence-3"
DURATION = 0.3  # [s] at most, from the last release
FRAME_RATE = 240.0  # [1/s]
EVALUATIONS = 200  # in one sample of the kernel
SEED = 0  # of the start angles

BARE: dict[str, Any] = {"mount": "free", "magnets": None, "friction": 0.0, "contact": False}
MAGNETS: dict[str, Any] = load_scene(SEQUENCE).model_dump()["magnets"]
POINTS = {"model": "points", "remanence": 0.6, "width": 0.006, "thickness": 0.0025, "nodes": 3}
GRAVITY = {"in_plane": (0.0, -9.8)}
TUBE = {"mount": "tube", "feed": {"speed": 0.1, "loading": "preloaded"}}
AT_MOUTH = {"mount": "tube", "feed": {"speed": 0.1, "loading": "at_mouth"}}
REAL = {"magnets": MAGNETS, "contact": True, "friction": 0.35}

FEATURES: dict[str, dict[str, Any]] = {
    "pinned, gravity": {"mount": "pinned", "gravity": GRAVITY},
    "pinned, gravity, contact": {"mount": "pinned", "gravity": GRAVITY, "contact": True},
    "pinned, gravity, friction": {"mount": "pinned", "gravity": GRAVITY, "friction": 0.35},
    "magnets": {"magnets": MAGNETS},
    "magnets as points": {"magnets": POINTS},
    "magnets, gravity": {"magnets": MAGNETS, "gravity": GRAVITY},
    "magnets, contact": {"magnets": MAGNETS, "contact": True},
    "magnets, friction": {"magnets": MAGNETS, "friction": 0.35},
    "magnets, contact, friction": REAL,
    "the same, recorded": REAL,
    "the same, tube preloaded": REAL | TUBE,
    "the same, tube loaded at mouth": REAL | AT_MOUTH,
}


def run(quick: bool, progress: Progress) -> Part:
    """Measure every row of `FEATURES`."""
    rounds = 3 if quick else 9
    scenes = {name: build(changes) for name, changes in FEATURES.items()}
    progress(0.0, "features")
    runs = {name: _run(scene, name) for name, scene in scenes.items()}
    times = take_turns(runs, rounds, tick=lambda share: progress(0.6 * share, "runs"))
    bare = {name: scene.replace(magnets=None) for name, scene in scenes.items()}
    kernels = {name: _evaluations(scene) for name, scene in scenes.items()}
    kernels |= {f"{name} bare": _evaluations(scene) for name, scene in bare.items()}
    prices = take_turns(kernels, rounds, tick=lambda share: progress(0.6 + 0.4 * share, "kernels"))
    rows: list[Row] = []
    for name, scene in scenes.items():
        session = _session(scene, name)
        finish(session)
        count = session.evaluations
        taken = 1e6 * times[name].median
        price = 1e6 * prices[name].median / EVALUATIONS
        chain = 1e6 * prices[f"{name} bare"].median / EVALUATIONS
        rows.append(
            {
                "features": name,
                "end": "moving" if session.status is None else session.status.value,
                "simulated [s]": session.time,
                "steps": session.steps,
                "evaluations": count,
                "run [µs]": taken,
                "run / evaluations [µs]": taken / max(count, 1),
                "smooth evaluation [µs]": price,
                "magnets [%]": 100.0 * count * (price - chain) / taken,
                "chain [%]": 100.0 * count * chain / taken,
                "rest [%]": 100.0 * (1.0 - count * price / taken),
            }
        )
    shown: list[Row] = [{k: row[k] for k in row if k != "simulated [s]"} for row in rows]
    title = f"Cost by feature, {SEQUENCE}, at most {DURATION} s simulated"
    return Part("features", rows, [Table(title, shown)])


def build(changes: dict[str, Any]) -> Scene:
    """Return the drawn scene of a row."""
    scene = load_scene(SEQUENCE).replace(**{**BARE, **changes}, duration=DURATION)
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


def _evaluations(scene: Scene) -> Task:
    """Evaluate the smooth accelerations `EVALUATIONS` times at the start of a scene."""
    model = pack(scene)
    work, q = new_work(model), np.zeros(scene.n + 2)
    q[1 : scene.n] = np.cumsum(np.asarray(scene.start_angles))
    v, out = np.full(scene.n + 2, 0.1), np.zeros(scene.n + 2)
    return lambda: lambda: repeat(EVALUATIONS, model, q, v, work, out)


@kernel
def repeat(count: int, model: Model, q: Array, v: Array, work: Work, out: Array) -> None:
    """Evaluate the smooth accelerations many times, nothing being in a tube."""
    for _ in range(count):
        smooth_accelerations(0, model, q, v, work, out)
