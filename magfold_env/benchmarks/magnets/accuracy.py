"""Time against error, for both models of magnets and every way to choose nodes.

Errors are of forces and torques of casings against `reference`, relative to the force between two
flush opposite faces, torques over the side: the quantity that the scene's accuracy bounds. Pairs
of casings are random, touching ones among them; chains of six are unfolded, folded or on the way,
and long chains either.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from magfold_env.benchmarks.magnets.casings import Sample, Sums, sample_of
from magfold_env.benchmarks.magnets.poses import (
    folded,
    random_pair,
    random_scene,
    random_shape,
    unfolded,
)
from magfold_env.engine.state import Array
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick, begin_case
from magfold_env.reporting.timing import Task, take_turns
from magfold_env.scene import Magnets, Scene
from magfold_env.shapes import centres

NAME = "accuracy"
PAIRS, FOLDS, LONG = "pairs of casings", "chains of 6", "chains of 60"
POINTS, NODES, BOUND = "points", "strips, fixed nodes", "strips, error bound"
SEED = 4
LENGTH, LONG_LENGTH = 6, 60


@dataclass(frozen=True)
class Effort:
    """How much work a run of the benchmark may be."""

    pairs: int
    folds: int
    long: int
    charges: tuple[int, ...]
    """Of the point model, a pole face."""
    nodes: tuple[int, ...]
    """Of the strips, a pole face."""
    bounds: tuple[float, ...]
    rounds: int
    """Samples of every timing."""

    @classmethod
    def of(cls, quick: bool) -> Effort:
        """Return the effort of a quick or a full run."""
        if quick:
            return cls(60, 6, 1, (1, 3, 30), (3, 16), (1e-2, 1e-4), 2)
        return cls(
            2000,
            100,
            6,
            (1, 2, 3, 5, 8, 12, 20, 30),
            (1, 2, 3, 4, 6, 8, 12, 16, 24),
            (5e-2, 1e-2, 1e-3, 1e-4, 1e-5),
            7,
        )


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure all settings on pairs and on chains."""
    effort = Effort.of(quick)
    rng = np.random.default_rng(SEED)
    part = Measurement(NAME, [])
    sets = {
        PAIRS: [draw_pair(rng) for _ in range(effort.pairs)],
        FOLDS: [draw_chain(rng) for _ in range(effort.folds)],
        LONG: [draw_long(rng, unfolded if k % 2 else folded) for k in range(effort.long)],
    }
    for k, (name, drawn) in enumerate(sets.items()):
        tick = begin_case(progress, k, len(sets), name)
        sample = sample_of([scene for scene, _ in drawn], [pose for _, pose in drawn])
        rows = measure(name, sample, effort, tick)
        part.rows.extend(rows)
        part.tables.append(_table(name, sample, rows))
        part.findings.extend(_findings(name, sample, rows))
    return part


def draw_pair(rng: np.random.Generator) -> tuple[Scene, tuple[Array, Array]]:
    """Draw the poles and the pose of two casings."""
    scene = random_scene(rng, 2)
    return scene, random_pair(rng, scene.casing.side)


def draw_chain(rng: np.random.Generator) -> tuple[Scene, tuple[Array, Array]]:
    """Draw the poles and the pose of a chain of six."""
    scene = random_scene(rng, LENGTH)
    headings = random_shape(rng, LENGTH, scene.casing.side)
    return scene, (centres(headings, scene.casing.side), headings)


def draw_long(
    rng: np.random.Generator, shape: Callable[[int], Array]
) -> tuple[Scene, tuple[Array, Array]]:
    """Draw the poles of a long chain of a given shape."""
    scene = random_scene(rng, LONG_LENGTH)
    headings = shape(LONG_LENGTH)
    return scene, (centres(headings, scene.casing.side), headings)


def settings(effort: Effort) -> dict[tuple[str, float], Magnets]:
    """Return the magnets of every way to choose nodes and every setting of it."""
    found: dict[tuple[str, float], Magnets] = {}
    for count in effort.charges:
        found[POINTS, count] = Magnets(model="points", nodes=count)
    for count in effort.nodes:
        found[NODES, count] = Magnets(nodes=count)
    for bound in effort.bounds:
        found[BOUND, bound] = Magnets(accuracy=bound)
    return found


def measure(name: str, sample: Sample, effort: Effort, tick: Tick) -> list[Row]:
    """Return a row a setting."""
    sums = {key: Sums(sample, magnets) for key, magnets in settings(effort).items()}
    errors = {key: sample.errors(each.loads()) for key, each in sums.items()}
    tasks: dict[str, Task] = {str(key): _task(each) for key, each in sums.items()}
    times = take_turns(tasks, effort.rounds, tick=tick)
    rows: list[Row] = []
    for key, each in sums.items():
        taken = times[str(key)].spread
        unit = 1e6 / each.evaluations
        rows.append(
            {
                "states": name,
                "model": key[0],
                "setting": key[1],
                "worst error": float(errors[key].max()),
                "median error": float(np.median(errors[key])),
                **taken.time_cells("µs", unit),
            }
        )
    return rows


def _task(sums: Sums) -> Task:
    return lambda: sums.work


def _table(name: str, sample: Sample, rows: list[Row]) -> Table:
    hidden = ("states", "lower quartile [µs]", "upper quartile [µs]")
    shown = [{key: cell for key, cell in row.items() if key not in hidden} for row in rows]
    return Table(
        f"Forces and torques of {sample.size} {name}: errors in flush forces, µs a state", shown
    )


def _findings(name: str, sample: Sample, rows: list[Row]) -> list[str]:
    """Say whether the bounds hold, and what the point model is off by."""
    bounded = [row for row in rows if row["model"] == BOUND]
    used = [float(row["worst error"]) / float(row["setting"]) for row in bounded]
    held = all(share <= 1.0 for share in used)
    shares = ", ".join(
        f"{share:.0%} of {float(row['setting']):g}"
        for share, row in zip(used, bounded, strict=True)
    )
    best = min((row for row in rows if row["model"] == POINTS), key=_worst)
    return [
        f"{sample.size} {name}: the worst errors are {shares}; the bound {_verdict(held)}",
        f"{sample.size} {name}: no number of point charges has a smaller worst error than "
        f"{_worst(best):.2g} flush forces (at h = {best['setting']:.0f})",
    ]


def _worst(row: Row) -> float:
    return float(row["worst error"])


def _verdict(held: bool) -> str:
    return "holds" if held else "FAILS"
