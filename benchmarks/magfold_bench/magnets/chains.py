"""What the magnets cost in the dynamics: with features of real devices, and over real folds.

Devices: each feature is put into the default chain, four equal magnets in every component, one at a
time; those that a scene does not have must cost nothing. Times are of what the dynamics do at one
evaluation, in turns with the default chain, which takes part twice to show the noise.

Folds: a fold of a chain of six is simulated once; the states it was evaluated at are put back along
its steps, as many on each as the integrator took there. The magnets' forces are then timed over all
of them in a compiled loop, in order, so that what is kept of joints at their stops is kept as long
as in the fold. Beside it, every pair summed. Errors are of the torques at the joints.
"""

from typing import Any, NamedTuple

import numpy as np

from magfold_bench.laws import exact_magnets
from magfold_bench.laws.along_folds import SteppedSession
from magfold_bench.magnets import samples
from magfold_bench.magnets.samples import AT_STOPS, FOLDED, Chain, States, joint_torques
from magfold_bench.presentation import name_bars
from magfold_env.engine import entries as at
from magfold_env.engine.chain.feed import place_all
from magfold_env.engine.state import Array, IntArray, Pose
from magfold_env.reporting import plotting, tables, timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.scene import Scene, load_scene
from magfold_env.simulation.pack import pack

LENGTHS, QUICK_LENGTHS = (6, 60), (6,)
DEFAULT, AGAIN = "default chain", "default chain again"
STOPS = "all joints at stops"
COSTLY = ("unequal heights", "unequal sizes", "an even field", "a fixed magnet")  # may take longer
NOISE = 1.05  # a ratio that counts as 1
EMPTY = "-"
FIXED = {
    "position": (0.03, -0.04),
    "heading": 0.7,
    "width": 0.02,
    "height": 0.02,
    "thickness": 0.01,
}
DEVICES_SEED = 13

BOUNDS = (1e-2, 1e-3, 1e-4)
ASKED = {1e-2: 10.0, 1e-4: 30.0}  # [µs] at most, on average over a fold
SPEED = 0.1  # [m/s] of the tube's feed
DURATION = 1.0  # [s] from the last release
FOLDS_SEED = 0


def devices(quick: bool, progress: Progress) -> Measurement:
    """Measure every feature on unfolded and folded chains."""
    lengths, rounds = (QUICK_LENGTHS, 2) if quick else (LENGTHS, 9)
    found = Measurement()
    for (n, shape), tick in samples.each_chain(progress, lengths):
        found.rows.extend(_measure_devices(n, shape, rounds, tick))
    found.tables.extend(_table(n, tables.select(found.rows, n=n)) for n in lengths)
    found.findings.extend(_devices_findings(found.rows))
    return found


def features(n: int) -> dict[str, Scene]:
    """Return the default chain of n components, and with one feature each, by their names."""
    rng = np.random.default_rng(DEVICES_SEED)
    scene = samples.random_scene(rng, n).replace(friction=0.0)
    faces = np.array([list(letters) for letters in scene.sequence])
    gaps = rng.permuted(np.tile(np.arange(4), (n, 1)), axis=1)  # the faces, in any order

    def without(count: int, every: int = 1) -> Scene:
        """Leave out so many faces of every so many-th component."""
        left = faces.copy()
        for i in range(0, n, every):
            left[i, gaps[i, :count]] = EMPTY
        return scene.replace(sequence=tuple("".join(letters) for letters in left))

    heights = (0.004, 0.005, 0.006, 0.007)
    sizes = {
        "height": heights,
        "width": (0.006, 0.005, 0.004, 0.005),
        "thickness": (0.002, 0.0025, 0.0015, 0.002),
        "inset": (0.0005, 0.0006, 0.0008, 0.0005),
    }
    strengths = rng.uniform(0.3, 0.9, (n, 4)).tolist()
    return {
        DEFAULT: scene,
        AGAIN: scene,
        "one face in four empty": without(1),
        "two faces in four empty": without(2),
        "every other component without magnets": without(4, 2),
        "no component with magnets": without(4),
        "no magnets in the scene": scene.replace(magnets=None),
        "unequal strengths": scene.replace(magnets={"remanence": strengths}),
        "unequal heights": scene.replace(magnets={"height": heights}),
        "unequal sizes": scene.replace(magnets=sizes),
        "an even field": scene.replace(field={"uniform": (0.01, 0.02)}),
        "a fixed magnet": scene.replace(field={"magnet": FIXED}),
    }


def _measure_devices(n: int, shape: str, rounds: int, tick: Tick) -> list[Row]:
    """Rows of all features in one shape; joints at their stops belong to the folded one."""
    scenes, headings = features(n), samples.shapes(n)
    chains = {name: Chain.pinned(scene, headings[shape]) for name, scene in scenes.items()}
    if shape == FOLDED:
        chains[STOPS] = Chain.pinned(scenes[DEFAULT], headings[AT_STOPS])
    times = samples.time_each(chains, rounds, tick)
    return [
        {
            "n": n,
            "shape": shape,
            "feature": name,
            **time.spread.time_cells("µs", 1e6),
            **timing.ratio(time, times[DEFAULT]).cells("time / default"),
        }
        for name, time in times.items()
    ]


def _table(n: int, rows: list[Row]) -> Table:
    """Return times and ratios of one length, a row a feature and two columns a shape."""
    lines: dict[str, Row] = {}
    for row in rows:
        line = lines.setdefault(str(row["feature"]), {"feature": row["feature"]})
        for key in ("time [µs]", "time / default"):
            line[f"{row['shape']}: {key}"] = row[key]
    # Not every feature is in both shapes.
    shown: list[Row] = [
        {key: line.get(key, "") for key in lines[DEFAULT]} for line in lines.values()
    ]
    return Table(f"Magnets of {n} components in the dynamics, feature by feature", shown)


def _devices_findings(rows: list[Row]) -> list[str]:
    """Say what each feature costs, and whether those that leave less to do take no longer."""
    found: list[str] = []
    for name in tables.distinct(rows, "feature"):
        if name == DEFAULT:
            continue
        shares = tables.numbers(tables.select(rows, feature=name), "time / default")
        asked = ""
        if name not in COSTLY:
            held = tables.verdict(shares.max() <= NOISE)
            asked = f"; at most 1 is asked for, to within {NOISE - 1.0:.0%}: {held}"
        found.append(
            f"{name}: {shares.min():.2g} to {shares.max():.2g} times as long as the default{asked}"
        )
    return found


def draw_devices(rows: list[Row]) -> Any:
    """Bars of the time over the default chain's, feature by feature, a colour a chain."""
    rows = [row for row in rows if row["feature"] != DEFAULT]
    chains = list(dict.fromkeys((row["n"], row["shape"]) for row in rows))
    names = tables.distinct(rows, "feature")
    figure, axes = plotting.panels(
        1, "Magnets in the dynamics: time over the default chain's", 9.0, 5.0
    )
    axis = axes[0]
    height = 0.8 / len(chains)
    for k, (n, shape) in enumerate(chains):
        mine = tables.select(rows, n=n, shape=shape)
        place = [names.index(str(row["feature"])) + (k + 0.5) * height - 0.4 for row in mine]
        shares = tables.numbers(mine, "time / default")
        axis.barh(
            place, shares, 0.9 * height, color=plotting.COLOURS[k + 1], label=f"n = {n}, {shape}"
        )
    axis.axvline(1.0, color=plotting.INK, linewidth=1.0, linestyle="--")
    name_bars(axis, names, "time / time of the default chain")
    plotting.legend(axis, "upper right")
    return figure


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
        self.los.append(int(self._state.counter[at.LO]))
        self.counts.append(self.evaluations)


def folds(quick: bool, progress: Progress) -> Measurement:
    """Measure every fold at every accuracy."""
    effort = QUICK if quick else FULL
    rows: list[Row] = []
    scenes = list(fold_scenes(effort).items())
    for (name, scene), tick in tables.each_case(progress, scenes, lambda case: case[0]):
        rows.extend(_measure_fold(name, scene, effort, tick))
    table = Table("Magnets of a chain of six, averages over a fold", tables.without_quartiles(rows))
    return Measurement(rows, [table], _folds_findings(rows))


def fold_scenes(effort: Effort) -> dict[str, Scene]:
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
            found[f"sequence {number}, {mount}"] = scene.draw(np.random.default_rng(FOLDS_SEED))
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


def _measure_fold(name: str, scene: Scene, effort: Effort, tick: Tick) -> list[Row]:
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


def _folds_findings(rows: list[Row]) -> list[str]:
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


def draw_folds(rows: list[Row]) -> Any:
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
