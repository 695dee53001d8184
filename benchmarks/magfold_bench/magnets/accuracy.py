"""Time against error for both magnet models and every way to choose nodes.

Forces and torques on casings are compared with `laws.exact_magnets`. Torques are divided by the
side, and the unit of errors is the force between two flush opposite faces, as it is for a scene's
`accuracy`. Pairs of casings lie at random, and some touch. Chains of six are unfolded, folded or in
between, and long chains are unfolded or folded.
"""

from typing import NamedTuple

import numpy as np

from magfold_bench import tables, timing
from magfold_bench.magnets import samples
from magfold_bench.presentation import Lines
from magfold_bench.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.engine.state import Array
from magfold_env.scene import Casing, Magnets, Scene
from magfold_env.shapes import centres

PAIRS, FOLDS, LONG = "pairs of casings", "chains of 6", "chains of 60"
POINTS, NODES, BOUND = "points", "strips, fixed nodes", "strips, error bound"
SEED = 4
LENGTH, LONG_LENGTH = 6, 60


class Effort(NamedTuple):
    """How much a run of the benchmark measures."""

    pairs: int
    folds: int
    long: int
    charges: tuple[int, ...]  # numbers of point charges per pole face
    nodes: tuple[int, ...]  # numbers of the strips' nodes per pole face
    bounds: tuple[float, ...]
    rounds: int  # number of samples per timing


QUICK = Effort(60, 6, 1, (1, 3, 30), (3, 16), (1e-2, 1e-4), 2)
FULL = Effort(
    2000,
    100,
    6,
    (1, 2, 3, 5, 8, 12, 20, 30),
    (1, 2, 3, 4, 6, 8, 12, 16, 24),
    (5e-2, 1e-2, 1e-3, 1e-4, 1e-5),
    7,
)


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure errors and times of all magnet models and node choices, on pairs and on chains."""
    effort = QUICK if quick else FULL
    rng = np.random.default_rng(SEED)
    found, side = Measurement(), Casing().side
    sets = {
        PAIRS: [
            (samples.random_scene(rng, 2), samples.random_pair(rng, side))
            for _ in range(effort.pairs)
        ],
        FOLDS: [draw_chain(rng, LENGTH) for _ in range(effort.folds)],
        LONG: [
            draw_chain(rng, LONG_LENGTH, (samples.folded, samples.unfolded)[k % 2](LONG_LENGTH))
            for k in range(effort.long)
        ],
    }
    for name, tick in tables.each_case(progress, list(sets)):
        scenes, poses = zip(*sets[name], strict=True)
        sample = samples.sample_of(scenes, poses)
        rows = measure(name, sample, effort, tick)
        found.rows.extend(rows)
        title = f"Forces and torques of {sample.size} {name}: errors in flush forces, µs per state"
        found.tables.append(Table(title, tables.without_quartiles(rows, "states")))
        found.findings.extend(_findings(name, sample, rows))
    return found


def draw_chain(
    rng: np.random.Generator, n: int, headings: Array | None = None
) -> tuple[Scene, tuple[Array, Array]]:
    """Return a chain with random poles, and its pose, which is random unless headings are given."""
    scene = samples.random_scene(rng, n)
    if headings is None:
        headings = samples.random_shape(rng, n, scene.casing.side)
    return scene, (centres(headings, scene.casing.side), headings)


def measure(name: str, sample: samples.Sample, effort: Effort, tick: Tick) -> list[Row]:
    """Return a row for every setting of every model and every way to choose nodes."""
    settings: dict[tuple[str, float], Magnets] = {
        **{(POINTS, count): Magnets(model="points", nodes=count) for count in effort.charges},
        **{(NODES, count): Magnets(nodes=count) for count in effort.nodes},
        **{(BOUND, bound): Magnets(accuracy=bound) for bound in effort.bounds},
    }
    sums = {key: samples.Sums(sample, magnets) for key, magnets in settings.items()}
    errors = {key: sample.errors(each.loads()) for key, each in sums.items()}
    tasks = {key: timing.unprepared(each.work) for key, each in sums.items()}
    taken = timing.take_turns(tasks, effort.rounds, tick=tick)
    times = {key: taken[key].each_of(each.evaluations) for key, each in sums.items()}
    return [
        {
            "states": name,
            "model": model,
            "setting": setting,
            "worst error": float(errors[model, setting].max()),
            "median error": float(np.median(errors[model, setting])),
            **time.spread.time_cells("µs", 1e6),
        }
        for (model, setting), time in times.items()
    ]


def _findings(name: str, sample: samples.Sample, rows: list[Row]) -> list[str]:
    """Return the findings: whether the bounds hold, and the error of the point model."""
    bounded = tables.select(rows, model=BOUND)
    used = tables.numbers(bounded, "worst error") / tables.numbers(bounded, "setting")
    shares = ", ".join(
        f"{share:.0%} of {float(row['setting']):g}"
        for share, row in zip(used, bounded, strict=True)
    )
    best = min(tables.select(rows, model=POINTS), key=lambda row: float(row["worst error"]))
    return [
        f"{sample.size} {name}: the worst errors are {shares}; the bound "
        f"{tables.verdict((used <= 1.0).all())}",
        f"{sample.size} {name}: no number of point charges has a smaller worst error than "
        f"{float(best['worst error']):.2g} flush forces (at h = {best['setting']:.0f})",
    ]


DIAGRAM = Lines(
    "Magnet forces: worst error, in flush forces, against time",
    "time [µs]",
    "worst error",
    "model",
    ("states",),
    text="setting",
    shared=False,
)
