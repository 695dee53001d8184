"""What a scene does not need must cost nothing: its features switched off, one by one and together.

A scene that has everything loses one feature, then, beginning anew, one after the other, until a
pinned pendulum is left. Beside it swings the floor (`floor`), which knows of no features at all.
Every scene moves in its own way, so what is compared is the time an evaluation of the accelerations
takes in a run, all else that the run does included; calls from Python are part of it. What comes
before a run, a scene's numbers as arrays and where these lie, is timed on its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from magfold_env.benchmarks.dynamics.features import FRAME_RATE, SEED, finish
from magfold_env.benchmarks.whole import floor
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.reporting.timing import Spread, Task, Timing, ratio, take_turns
from magfold_env.scene import Scene, load_scene
from magfold_env.simulation.session import Session

NAME = "skipping"
SEQUENCE = "paper/sequence-3"
SPEED = 0.2  # [m/s] of the feed
TILT = (0.5, 0.0)  # [m/s²] along the feed: a floor that slopes by 3°
DURATION = 10.0  # [s] at most, from the last release; what friction stops rests far sooner
FIELD = {
    "uniform": (0.0, 2e-5),  # [T] as much as the Earth's
    "magnet": {
        "position": (0.05, 0.3),  # [m]
        "heading": -0.5 * math.pi,
        "width": 0.04,
        "height": 0.04,
        "thickness": 0.02,
    },
}
MOST_STEPS = 1000  # twice what any scene needs but the one in which magnets pass each other
ALLOWED = 1.1  # time of the scene that lacks everything over the floor's

RECORDING = "recording"
FEATURES: dict[str, dict[str, Any]] = {
    RECORDING: {},
    "outer field": {"field": None},
    "friction": {"friction": 0.0},
    "tube": {"mount": "pinned"},
    "magnets": {"magnets": None},
    "contact": {"contact": False},
}
"""What switches a feature off, in the order in which they go together."""

EVERYTHING, ONE, TOGETHER, FLOOR = "everything", "one off", "together off", "floor"
BEFORE, BEFORE_FLOOR = "preparation", "preparation of the floor"


@dataclass(frozen=True)
class Variant:
    """The scene without some of its features."""

    group: str
    name: str
    scene: Scene
    recorded: bool

    def session(self) -> Session:
        """Return the scene at its start."""
        return Session(self.scene, FRAME_RATE if self.recorded else None)

    def task(self) -> Task:
        """Return a run as something to time, its preparation left out."""

        def prepare() -> Callable[[], None]:
            session = self.session()
            return lambda: finish(session)

        return prepare


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every variant and the floor."""
    found = {f"{each.group}: {each.name}": each for each in variants()}
    bare = list(found.values())[-1]
    tasks = {name: each.task() for name, each in found.items()}
    tasks[FLOOR] = lambda: floor.prepare_swing(bare.scene)
    tasks[BEFORE] = lambda: bare.session
    tasks[BEFORE_FLOOR] = lambda: lambda: floor.prepare_swing(bare.scene)
    times = take_turns(tasks, 3 if quick else 15, tick=lambda share: progress(share, "runs"))
    swung = floor.prepare_swing(bare.scene)()
    rows: list[Row] = []
    for name, each in found.items():
        session = each.session()
        finish(session)
        price = ratio(times[name], times[FLOOR])
        row = _row(each.group, each.name, session.evaluations, times[name], price, swung)
        rows.append({**row, "end": str(session.status), "simulated [s]": session.time})
    itself = ratio(times[FLOOR], times[FLOOR])
    last = _row(FLOOR, "bare pendulum", swung, times[FLOOR], itself, swung)
    rows.append({**last, "end": "unsettled", "simulated [s]": bare.scene.duration})
    return Measurement(NAME, rows, _tables(rows), [*_findings(rows), _before(times)])


def variants() -> list[Variant]:
    """Return the scene with everything, without each feature, and with fewer and fewer."""
    found = [_variant(EVERYTHING, "nothing off", [])]
    found += [_variant(ONE, name, [name]) for name in FEATURES]
    names = list(FEATURES)
    for k in range(1, len(names) + 1):
        name = ", ".join(names[:k]) if k == 1 else f"and {names[k - 1]}"
        found.append(_variant(TOGETHER, name, names[:k]))
    return found


def _variant(group: str, name: str, off: list[str]) -> Variant:
    scene = load_scene(SEQUENCE).replace(
        mount="tube",
        duration=DURATION,
        solver={"max_steps": MOST_STEPS},
        feed={"speed": SPEED, "direction": "backward"},
        gravity={"in_plane": TILT},
        field=FIELD,
    )
    for feature in off:
        scene = scene.replace(**FEATURES[feature])
    return Variant(group, name, scene.draw(np.random.default_rng(SEED)), RECORDING not in off)


def _row(group: str, name: str, evaluations: int, taken: Timing, runs: Spread, swung: int) -> Row:
    """Return a row; ``runs`` is its run's time over the floor's, of ``swung`` evaluations."""
    share = swung / evaluations
    return {
        "group": group,
        "off": name,
        **taken.spread.time_cells("ms", 1e3),
        "evaluations": evaluations,
        "each [µs]": 1e6 * taken.median / evaluations,
        "over the floor": runs.median * share,
        "over the floor, lower quartile": runs.low * share,
        "over the floor, upper quartile": runs.high * share,
    }


def _tables(rows: list[Row]) -> list[Table]:
    shown: list[Row] = [
        {
            "group": row["group"],
            "off": row["off"],
            "run, ms": row["time [ms]"],
            "simulated, s": row["simulated [s]"],
            "end": row["end"],
            "evals": row["evaluations"],
            "each, µs": row["each [µs]"],
            "× floor": row["over the floor"],
        }
        for row in rows
    ]
    return [Table(f"What a scene does not need: {SEQUENCE}, fed backward on a slope", shown)]


def _findings(rows: list[Row]) -> list[str]:
    bare = rows[-2]
    spread = Spread(*(float(bare[f"over the floor{which}"]) for which in SPREAD))
    verdict = "holds" if spread.median <= ALLOWED else "FAILS"
    return [
        f"a scene that lacks everything takes {spread} times as long an evaluation as the floor; "
        f"{ALLOWED:g} is asked for: {verdict}"
    ]


def _before(times: Mapping[str, Timing]) -> str:
    own, other = (1e6 * times[name].median for name in (BEFORE, BEFORE_FLOOR))
    return (
        f"before its run, which is left out above, that scene takes {own:.0f} µs to be prepared, "
        f"the floor {other:.0f} µs"
    )


SPREAD = ("", ", lower quartile", ", upper quartile")
