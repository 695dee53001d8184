"""The cost of each feature of a scene; unused features must cost nothing.

From a scene with all features, each feature is removed separately; then all are removed one after
another, until a pinned pendulum is left. The lower bound, or floor, is a program that can simulate
nothing but that pendulum. Because the chain moves differently in every scene, the benchmark divides
the time of a run, with everything that the run does, by its number of evaluations of accelerations.
The preparation of a run, which converts a scene to arrays, is timed separately.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from magfold_bench import tables, timing
from magfold_bench.bare_pendulum import prepare_swing
from magfold_bench.runs import ended, run_task
from magfold_bench.tables import Measurement, Progress, Row, Table
from magfold_env.scene import Scene, load_scene
from magfold_env.simulation.session import Session

SEQUENCE = "paper/sequence-3"
FRAME_RATE = 240.0  # [1/s]
SEED = 0  # of the start angles
WIDTH = 0.005  # [rad] largest start angles for which a tube has room
SPEED = 0.2  # [m/s] of the feed
TILT = (0.5, 0.0)  # [m/s²] along the feed, as on a 3° slope
LONGEST = 10.0  # [s] after the last release; friction stops chains far sooner
FIELD = {
    "uniform": (0.0, 2e-5),  # [T] about as strong as the Earth's field
    "magnet": {
        "position": (0.05, 0.3),  # [m]
        "heading": -0.5 * math.pi,
        "width": 0.04,
        "height": 0.04,
        "thickness": 0.02,
    },
}
MOST_STEPS = 1000  # twice what scenes need, except the one in which magnets pass through others
ALLOWED = 1.1  # largest time without any feature, relative to the floor

RECORDING = "recording"
SWITCHED_OFF: dict[str, dict[str, Any]] = {
    RECORDING: {},
    "outer field": {"field": None},
    "friction": {"friction": 0.0},
    "tube": {"mount": "pinned"},
    "magnets": {"magnets": None},
    "contact": {"contact": False},
}
"""Changes that switch features off, in the order of removal."""

EVERYTHING, ONE, TOGETHER, FLOOR = "everything", "one off", "together off", "floor"
BEFORE, BEFORE_FLOOR = "preparation", "preparation of the floor"
OVER = "over the floor"
OVER_SPREAD = (OVER, f"{OVER}, lower quartile", f"{OVER}, upper quartile")


class Variant(NamedTuple):
    """The scene without some of its features."""

    group: str
    name: str
    scene: Scene
    recorded: bool

    @property
    def frame_rate(self) -> float | None:
        """Frames recorded per second [1/s]."""
        return FRAME_RATE if self.recorded else None


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every variant and the floor."""
    found = {f"{each.group}: {each.name}": each for each in variants()}
    bare = list(found.values())[-1]
    tasks: dict[str, timing.Task] = {
        name: run_task(each.scene, frame_rate=each.frame_rate) for name, each in found.items()
    }
    tasks[FLOOR] = lambda: prepare_swing(bare.scene)
    tasks[BEFORE] = timing.unprepared(lambda: Session(bare.scene, bare.frame_rate))
    tasks[BEFORE_FLOOR] = timing.unprepared(lambda: prepare_swing(bare.scene))
    times = timing.take_turns(tasks, 3 if quick else 15, tick=lambda share: progress(share, "runs"))
    swung = prepare_swing(bare.scene)()

    def row(key: str, group: str, name: str, evaluations: int) -> Row:
        share, over = swung / evaluations, timing.ratio(times[key], times[FLOOR])
        return {
            "group": group,
            "off": name,
            **times[key].spread.time_cells("ms", 1e3),
            "evaluations": evaluations,
            "each [µs]": 1e6 * times[key].median / evaluations,
            **{name: share * cell for name, cell in over.cells(OVER).items()},
        }

    rows: list[Row] = []
    for key, each in found.items():
        session = ended(each.scene, each.frame_rate)
        cells = row(key, each.group, each.name, session.evaluations)
        rows.append({**cells, "end": str(session.status), "simulated [s]": session.time})
    last = row(FLOOR, FLOOR, "bare pendulum", swung)
    rows.append({**last, "end": "unsettled", "simulated [s]": bare.scene.duration})
    title = f"The cost of unused features: {SEQUENCE}, fed backward on a slope"
    table = Table(title, tables.without_quartiles(rows))
    spread = timing.Spread(*(float(rows[-2][name]) for name in OVER_SPREAD))
    own, other = (1e6 * times[name].median for name in (BEFORE, BEFORE_FLOOR))
    findings = [
        f"a scene without any feature takes {spread} times as long per evaluation as the floor; "
        f"at most {ALLOWED:g} is allowed: {tables.verdict(spread.median <= ALLOWED)}",
        f"preparing the run, which is not included above, takes {own:.0f} µs for that scene and "
        f"{other:.0f} µs for the floor",
    ]
    return Measurement(rows, [table], findings)


def variants() -> list[Variant]:
    """Return scenes with all features, with all but one, and with fewer and fewer features."""
    scene = load_scene(SEQUENCE)
    whole = scene.replace(
        mount="tube",
        start_angles=np.random.default_rng(SEED).uniform(-WIDTH, WIDTH, scene.n - 1),
        duration=LONGEST,
        solver={"max_steps": MOST_STEPS},
        feed={"speed": SPEED, "direction": "backward"},
        gravity={"in_plane": TILT},
        field=FIELD,
    )

    def without(group: str, name: str, off: list[str]) -> Variant:
        scene = whole
        for feature in off:
            scene = scene.replace(**SWITCHED_OFF[feature])
        return Variant(group, name, scene, RECORDING not in off)

    names = list(SWITCHED_OFF)
    return [
        without(EVERYTHING, "nothing off", []),
        *(without(ONE, name, [name]) for name in names),
        *(
            without(TOGETHER, f"and {name}" if k else name, names[: k + 1])
            for k, name in enumerate(names)
        ),
    ]
