"""What the magnets of a chain of six cost on average over real folds, at several accuracies.

A fold is simulated once; the states it was evaluated at are put back along its steps, as many on
each as the integrator took there. The magnets' forces are then timed over all of them in a
compiled loop, in order, so that what is kept of joints at their stops is kept as long as in the
fold. Beside it, every pair summed. Errors are of the torques at the joints.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from magfold_env.benchmarks.magnets import samples
from magfold_env.benchmarks.magnets.samples import Chain, States, joint_torques
from magfold_env.engine.chain.feed import place_all
from magfold_env.engine.state import LO, Array, IntArray, Pose
from magfold_env.laws import exact_magnets
from magfold_env.laws.along_folds import SteppedSession
from magfold_env.reporting import plotting, tables
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.scene import Scene, load_scene
from magfold_env.simulation.pack import pack

BOUNDS = (1e-2, 1e-3, 1e-4)
ASKED = {1e-2: 10.0, 1e-4: 30.0}  # [µs] at most, on average over a fold
SPEED = 0.1  # [m/s] of the tube's feed
DURATION = 1.0  # [s] from the last release
SEED = 0


class Effort(NamedTuple):
    """How much work a run of the benchmark may be."""

    sequences: tuple[int, ...]
    checked: int  # states of a fold at which errors are found
    rounds: int  # samples of every timing


QUICK, FULL = Effort((3,), 5, 2), Effort((1, 2, 3), 60, 9)


class RecordedSession(SteppedSession):
    """A session that keeps where it was after every step."""

    def __init__(self, scene: Scene) -> None:
        self.path: list[Array] = []
        self.los: list[int] = []
        self.counts: list[int] = []
        super().__init__(scene, RecordedSession.keep)
        self.keep()

    def keep(self) -> None:
        """Keep coordinates (n + 2,), the first free component and the evaluations so far."""
        self.path.append(self._state.q.copy())
        self.los.append(int(self._state.counter[LO]))
        self.counts.append(self.evaluations)


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every fold at every accuracy."""
    effort = QUICK if quick else FULL
    rows: list[Row] = []
    scenes = list(folds(effort).items())
    for (name, scene), tick in tables.each_case(progress, scenes, lambda case: case[0]):
        rows.extend(_measure(name, scene, effort, tick))
    table = Table("Magnets of a chain of six, averages over a fold", tables.without_quartiles(rows))
    return Measurement(rows, [table], _findings(rows))


def folds(effort: Effort) -> dict[str, Scene]:
    """Return the paper's sequences, drawn, free on the floor and pushed out of a tube.

    Component 1 is held in the tube, so that the engine counts as the sequence does.
    """
    mounts = {
        "free": {"mount": "free"},
        f"tube, {SPEED} m/s": {"mount": "tube", "feed": {"direction": "backward", "speed": SPEED}},
    }
    found: dict[str, Scene] = {}
    for mount, changes in mounts.items():
        for number in effort.sequences:
            scene = load_scene(f"paper/sequence-{number}").replace(duration=DURATION, **changes)
            found[f"sequence {number}, {mount}"] = scene.draw(np.random.default_rng(SEED))
    return found


def states_of(scene: Scene) -> States:
    """Simulate a drawn scene and return the states of its evaluations, by straight steps."""
    session = RecordedSession(scene)
    session.run()
    path, los = np.array(session.path), np.array(session.los, dtype=np.int64)
    counts = np.diff(session.counts)
    step = np.repeat(np.arange(counts.size), counts)
    share = np.concatenate([np.arange(1, count + 1) / count for count in counts if count])
    q = path[step] + share[:, None] * (path[step + 1] - path[step])
    # Ends are what they are: a joint at its stop must not be rounded off it.
    q[share == 1.0] = path[step[share == 1.0] + 1]
    return placed(scene, q, los[step + 1])


def placed(scene: Scene, q: Array, los: IntArray) -> States:
    """Return states with the poses that coordinates (states, n + 2) stand for."""
    model = pack(scene)
    poses = Pose(*(np.zeros((len(q), scene.n)) for _ in range(4)))
    first: IntArray = np.zeros(len(q), dtype=np.int64)
    for k, lo in enumerate(los.tolist()):
        pose = Pose(poses.cos[k], poses.sin[k], poses.x[k], poses.y[k])
        first[k] = place_all(lo, model, q[k], pose)
    return States(first, los, q, poses)


def _measure(name: str, scene: Scene, effort: Effort, tick: Tick) -> list[Row]:
    """Return a row an accuracy."""
    states = states_of(scene)
    magnets = {bound: scene.replace(magnets={"accuracy": bound}) for bound in BOUNDS}
    chains = {
        (bound, contact): Chain(each.replace(contact=contact), states)
        for bound, each in magnets.items()
        for contact in (True, False)
    }
    times = samples.time_each(chains, effort.rounds, tick)
    errors = errors_of(magnets, states, effort.checked)
    return [
        {
            "fold": name,
            "accuracy": bound,
            "evaluations": states.first.size,
            **times[bound, True].spread.time_cells("µs", 1e6),
            "all pairs summed [µs]": 1e6 * times[bound, False].median,
            "worst error": errors[bound],
        }
        for bound in BOUNDS
    ]


def errors_of(scenes: dict[float, Scene], states: States, count: int) -> dict[float, float]:
    """Worst errors of the joints' torques over the side, in flush forces, by accuracy.

    At some states in which the whole chain is free, evenly over the fold.
    """
    free = np.flatnonzero(states.lo == 0)
    chosen = free[np.linspace(0, free.size - 1, min(count, free.size)).astype(np.int64)]
    poses = Pose(*(each[chosen] for each in states.poses))
    some = States(states.first[chosen], states.lo[chosen], states.q[chosen], poses)
    scene = next(iter(scenes.values()))
    side = scene.casing.side
    places = np.stack([poses.x, poses.y], axis=2)
    placed = list(zip(places, some.q[:, : scene.n], strict=True))
    exact = samples.sample_of([scene] * len(placed), placed).exact
    wanted = joint_torques(exact, some, side)
    unit = side * exact_magnets.flush_force(scene)
    return {
        bound: float(np.abs(joint_torques(Chain(each, some).loads(), some, side) - wanted).max())
        / unit
        for bound, each in scenes.items()
    }


def _findings(rows: list[Row]) -> list[str]:
    found: list[str] = []
    for bound in BOUNDS:
        mine = tables.select(rows, accuracy=bound)
        times, error = tables.numbers(mine, "time [µs]"), tables.numbers(mine, "worst error").max()
        asked = ""
        if bound in ASKED:
            held = tables.verdict(times.max() <= ASKED[bound])
            asked = f"; at most {ASKED[bound]:g} is asked for: {held}"
        found.append(
            f"accuracy {bound:g}: the magnets take {times.min():.3g} to {times.max():.3g} µs an "
            f"evaluation, averages over {len(mine)} folds{asked}; worst error {error:.2g}"
        )
    return found


def draw(rows: list[Row]) -> Any:
    """Bars of the average time by fold and accuracy; ticks stand for all pairs summed."""
    figure, axes = plotting.panels(1, "Magnets of a chain of six: average over a fold", 8.0, 4.6)
    axis = axes[0]
    names, bounds = tables.distinct(rows, "fold"), tables.distinct(rows, "accuracy")
    for k, bound in enumerate(bounds):
        mine = tables.select(rows, accuracy=bound)
        place = [names.index(str(row["fold"])) + (k - 1) * 0.26 for row in mine]
        colour = plotting.COLOURS[k + 1]
        axis.bar(
            place,
            tables.numbers(mine, "time [µs]"),
            0.24,
            color=colour,
            label=f"accuracy {bound:g}",
        )
        axis.scatter(
            place, tables.numbers(mine, "all pairs summed [µs]"), color=colour, marker="_", s=130
        )
        if bound in ASKED:
            axis.axhline(ASKED[bound], color=colour, linewidth=1.0, linestyle="--")
    axis.set_xticks(range(len(names)), [name.replace(", ", "\n", 1) for name in names], fontsize=8)
    axis.set_ylim(0.0, 1.25 * float(tables.numbers(rows, "all pairs summed [µs]").max()))
    axis.grid(visible=False, axis="x")
    axis.set_ylabel("time an evaluation [µs]")
    axis.set_xlabel(
        "dashed: at most that is asked for; short strokes: all pairs summed", fontsize=9
    )
    plotting.legend(axis, "upper left", ncols=len(bounds))
    return figure
