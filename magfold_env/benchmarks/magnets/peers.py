"""How much faster than a general magnetics library, at equal or smaller error.

All find what the magnets of a chain do: magpylib with magnets cut into a given number of cells, and
the engine under a given bound, in two ways. Sums over nodes give the force and torque on every
casing. The dynamics look neighbours up; they find torques at the joints, and are compared by those.
Beside each mesh stands how much longer it takes than the fastest bound with no larger error. Folded
joints are a little off their stops, so that nothing is kept from one evaluation to the next.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from magfold_env.benchmarks.contenders.magpylib import MAGPYLIB, Mesh, Peer, installed
from magfold_env.benchmarks.magnets import samples
from magfold_env.benchmarks.magnets.poses import FOLDED, UNFOLDED, random_scene, shapes
from magfold_env.benchmarks.magnets.samples import Loads, Sample
from magfold_env.engine.state import Array
from magfold_env.laws import exact_magnets
from magfold_env.reporting import tables
from magfold_env.reporting.plotting import COLOURS, curve, legend, panels
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.reporting.timing import Spread, Timing, ratio, take_turns, unprepared
from magfold_env.scene import Magnets
from magfold_env.shapes import centres

SUMS, DYNAMICS = "sums", "dynamics"  # two ways of the engine
BOUNDS = (5e-2, 1e-2, 1e-3, 1e-4, 1e-5)
WANTED = 1000.0
SEED = 3
DRAWN = {MAGPYLIB: "magpylib getFT", SUMS: "engine, sums", DYNAMICS: "engine, dynamics"}
NO_RATIO = Spread(math.nan, math.nan, math.nan)

# Cells of a magnet, nearly cubes, by number of components; then samples of every timing.
FINE: tuple[Mesh, ...] = ((1, 2, 2), (2, 4, 4), (3, 7, 7), (4, 10, 10))
QUICK: tuple[dict[int, tuple[Mesh, ...]], int] = ({6: FINE[:1]}, 2)
FULL: tuple[dict[int, tuple[Mesh, ...]], int] = ({6: FINE, 60: FINE[:2]}, 3)


@dataclass(frozen=True, eq=False)
class Contender:
    """One way to find the magnets' forces, at one setting."""

    by: str
    setting: str
    force_error: float
    """Of forces and torques on casings, in flush forces; nan if it finds none."""
    joint_error: float
    """Of torques at the joints over the side, in flush forces."""
    work: Callable[[], object]
    """What is timed."""
    evaluations: int
    """How many it does."""

    @property
    def key(self) -> str:
        """A name that no other contender has."""
        return f"{self.by} {self.setting}"


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every mesh and bound on every chain; without magpylib nothing is measured."""
    if not installed():
        text = "magpylib is absent; the extra brings it: pip install 'magfold_env[peers]'"
        return Measurement(findings=[text])
    meshes, rounds = QUICK if quick else FULL
    rows: list[Row] = []
    cases = list(product(meshes, (UNFOLDED, FOLDED)))
    for (n, shape), tick in tables.each_case(
        progress, cases, lambda case: f"n = {case[0]}, {case[1]}"
    ):
        rows.extend(measure(n, shape, meshes[n], rounds, tick))
    return Measurement(rows, [_table(rows)], _findings(rows))


def chain_sample(n: int, shape: str) -> Sample:
    """Return a chain of random poles in one shape, and its exact forces."""
    scene = random_scene(np.random.default_rng(SEED), n)
    headings = shapes(n)[shape]
    return samples.sample_of([scene], [(centres(headings, scene.casing.side), headings)])


def measure(n: int, shape: str, meshes: tuple[Mesh, ...], rounds: int, tick: Tick) -> list[Row]:
    """Return a row a contender."""
    sample = chain_sample(n, shape)
    peer = Peer(sample.scenes[0], sample.places[0], sample.headings[0])
    with peer.one_thread():
        contenders = [_peer(sample, peer, mesh) for mesh in meshes]
        for bound in BOUNDS:
            contenders += [_sums(sample, bound), _dynamics(sample, bound)]
        tasks = {each.key: unprepared(each.work) for each in contenders}
        taken = take_turns(tasks, rounds, tick=tick)
    times = {c.key: taken[c.key].each_of(c.evaluations) for c in contenders}
    return [_row(n, shape, each, contenders, times) for each in contenders]


def _peer(sample: Sample, peer: Peer, mesh: Mesh) -> Contender:
    found = peer.loads(mesh)
    errors = float(sample.errors(found)[0]), joint_error(sample, found)
    name = " × ".join(str(cells) for cells in mesh)
    return Contender(MAGPYLIB, name, *errors, lambda: peer.loads(mesh), 1)


def _sums(sample: Sample, bound: float) -> Contender:
    sums = samples.Sums(sample, Magnets(accuracy=bound))
    found = sums.loads()
    errors = float(sample.errors(found)[0]), joint_error(sample, found)
    return Contender(SUMS, f"{bound:g}", *errors, sums.work, sums.evaluations)


def _dynamics(sample: Sample, bound: float) -> Contender:
    scene = sample.scenes[0]
    states = samples.pinned_states(list(sample.headings), scene.casing.side)
    changed = scene.replace(magnets={"accuracy": bound})
    chain = samples.Chain(changed, states)
    error = joint_error(sample, chain.loads())
    return Contender(DYNAMICS, f"{bound:g}", math.nan, error, chain.work, chain.evaluations)


def joint_error(sample: Sample, loads: Loads) -> float:
    """Worst error of the torques at the joints over the side, in flush forces."""
    scene = sample.scenes[0]
    side = scene.casing.side
    states = samples.pinned_states(list(sample.headings), side)
    exact = Loads(sample.force[..., 0], sample.force[..., 1], sample.torque)
    apart: Array = samples.joint_torques(loads, states, side) - samples.joint_torques(
        exact, states, side
    )
    return float(np.abs(apart).max()) / side / exact_magnets.flush_force(scene)


def fastest(contenders: list[Contender], times: dict[str, Timing], peer: Contender, by: str) -> str:
    """Key of the fastest way of one kind whose error is not above a peer's; empty if none is.

    Errors are of the forces where it finds them, else of the torques at the joints.
    """
    enough = [
        each.key
        for each in contenders
        if each.by == by
        and (
            each.force_error <= peer.force_error
            or (np.isnan(each.force_error) and each.joint_error <= peer.joint_error)
        )
    ]
    return min(enough, key=lambda key: times[key].median, default="")


def _row(
    n: int, shape: str, each: Contender, contenders: list[Contender], times: dict[str, Timing]
) -> Row:
    row: Row = {
        "n": n,
        "shape": shape,
        "by": each.by,
        "mesh or bound": each.setting,
        "force error": each.force_error,
        "joint error": each.joint_error,
        **times[each.key].spread.time_cells("µs", 1e6),
    }
    for by in (SUMS, DYNAMICS):
        fast = fastest(contenders, times, each, by) if each.by == MAGPYLIB else ""
        quotient = ratio(times[each.key], times[fast]) if fast else NO_RATIO
        row |= quotient.cells(f"time / {by}")
    return row


def _table(rows: list[Row]) -> Table:
    shown: list[Row] = [
        {
            key: "" if isinstance(cell, float) and math.isnan(cell) else cell
            for key, cell in row.items()
        }
        for row in tables.without_quartiles(rows)
    ]
    return Table("All magnets of a chain, beside magpylib: errors in flush forces", shown)


def _findings(rows: list[Row]) -> list[str]:
    found: list[str] = []
    for n in tables.distinct(rows, "n"):
        mine = tables.select(rows, n=n, by=MAGPYLIB)
        for by in (SUMS, DYNAMICS):
            factors = tables.numbers(mine, f"time / {by}")
            held = int((factors >= WANTED).sum())
            found.append(
                f"n = {n}: magpylib's getFT takes {min(factors):.3g} to {max(factors):.3g} times "
                f"as long as the engine's {by} at no larger error; at least {WANTED:g} is asked "
                f"for: holds for {held} of {len(factors)} meshes and shapes"
            )
    return found


def draw(rows: list[Row]) -> Any:
    """Error of the torques at the joints against time beside magpylib, a panel a chain."""
    chains = list(dict.fromkeys((row["n"], row["shape"]) for row in rows))
    figure, axes = panels(len(chains), "Beside magpylib: worst error against time", 3.4, 4.2)
    for axis, (n, shape) in zip(axes, chains, strict=True):
        for k, (by, label) in enumerate(DRAWN.items()):
            mine = [
                row | {"time [s]": 1e-6 * float(row["time [µs]"])}
                for row in tables.select(rows, n=n, shape=shape, by=by)
            ]
            colour = COLOURS[(2, 1, 3)[k]]
            curve(axis, mine, "time [s]", "joint error", k, color=colour, label=label)
        axis.set_title(f"n = {n}, {shape}", fontsize=11)
        axis.set_xlabel("time of an evaluation [s]")
    axes[0].set_ylabel("torque at a joint: worst error\n/ (side × flush force)", fontsize=9)
    legend(axes[0], "upper right")
    return figure
