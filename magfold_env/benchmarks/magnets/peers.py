"""How much faster than a general magnetics library, at equal or smaller error.

All find what the magnets of a chain do: magpylib with magnets cut into a given number of cells, and
the engine under a given bound, in two ways. Sums over nodes give the force and torque on every
casing. The dynamics look neighbours up; they find torques at the joints, and are compared by those.
Beside each mesh stands how much longer it takes than the fastest bound with no larger error. Folded
joints are a little off their stops, so that nothing is kept from one evaluation to the next.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from magfold_env.benchmarks.magnets.casings import Sample, Sums, sample_of
from magfold_env.benchmarks.magnets.chains import Chain, joint_torques, pinned_states
from magfold_env.benchmarks.magnets.kernels import Loads
from magfold_env.benchmarks.magnets.magpylib_peer import MAGPYLIB, Mesh, Peer, installed
from magfold_env.benchmarks.magnets.poses import random_scene
from magfold_env.benchmarks.magnets.scaling import FOLDED, UNFOLDED, shapes
from magfold_env.engine.state import Array
from magfold_env.laws import exact_magnets
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick, begin_case
from magfold_env.reporting.timing import Spread, Task, Timing, ratio, take_turns
from magfold_env.scene import Magnets
from magfold_env.shapes import centres

NAME = "peers"
SUMS, DYNAMICS = "sums", "dynamics"  # two ways of the engine
BOUNDS = (5e-2, 1e-2, 1e-3, 1e-4, 1e-5)
WANTED = 1000.0
SEED = 3


@dataclass(frozen=True)
class Effort:
    """How much work a run of the benchmark may be."""

    meshes: dict[int, tuple[Mesh, ...]]
    """By number of components."""
    rounds: int
    """Samples of every timing."""

    @classmethod
    def of(cls, quick: bool) -> Effort:
        """Return the effort of a quick or a full run."""
        if quick:
            return cls({6: ((1, 2, 2),)}, 2)
        fine = ((1, 2, 2), (2, 4, 4), (3, 7, 7), (4, 10, 10))  # their cells are nearly cubes
        return cls({6: fine, 60: fine[:2]}, 3)


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
        return Measurement(NAME, [], findings=[text])
    effort = Effort.of(quick)
    part = Measurement(NAME, [])
    cases = [(n, shape) for n in effort.meshes for shape in (UNFOLDED, FOLDED)]
    for k, (n, shape) in enumerate(cases):
        tick = begin_case(progress, k, len(cases), f"n = {n}, {shape}")
        part.rows.extend(measure(n, shape, effort, tick))
    part.tables.append(_table(part.rows))
    part.findings.extend(_findings(part.rows))
    return part


def chain_sample(n: int, shape: str) -> Sample:
    """Return a chain of random poles in one shape, and its exact forces."""
    scene = random_scene(np.random.default_rng(SEED), n)
    headings = shapes(n)[shape]
    return sample_of([scene], [(centres(headings, scene.casing.side), headings)])


def measure(n: int, shape: str, effort: Effort, tick: Tick) -> list[Row]:
    """Return a row a contender."""
    sample = chain_sample(n, shape)
    peer = Peer(sample.scenes[0], sample.places[0], sample.headings[0])
    with peer.one_thread():
        contenders = [_peer(sample, peer, mesh) for mesh in effort.meshes[n]]
        for bound in BOUNDS:
            contenders += [_sums(sample, bound), _dynamics(sample, bound)]
        tasks: dict[str, Task] = {each.key: _task(each) for each in contenders}
        taken = take_turns(tasks, effort.rounds, tick=tick)
    times = {c.key: Timing(taken[c.key].samples / c.evaluations) for c in contenders}
    return [_row(n, shape, each, contenders, times) for each in contenders]


def _peer(sample: Sample, peer: Peer, mesh: Mesh) -> Contender:
    found = peer.loads(mesh)
    errors = float(sample.errors(found)[0]), joint_error(sample, found)
    name = " × ".join(str(cells) for cells in mesh)
    return Contender(MAGPYLIB, name, *errors, lambda: peer.loads(mesh), 1)


def _sums(sample: Sample, bound: float) -> Contender:
    sums = Sums(sample, Magnets(accuracy=bound))
    found = sums.loads()
    errors = float(sample.errors(found)[0]), joint_error(sample, found)
    return Contender(SUMS, f"{bound:g}", *errors, sums.work, sums.evaluations)


def _dynamics(sample: Sample, bound: float) -> Contender:
    scene = sample.scenes[0]
    states = pinned_states(list(sample.headings), scene.casing.side)
    changed = scene.replace(magnets={"accuracy": bound})
    chain = Chain(changed, states)
    error = joint_error(sample, chain.loads())
    return Contender(DYNAMICS, f"{bound:g}", float("nan"), error, chain.work, chain.evaluations)


def joint_error(sample: Sample, loads: Loads) -> float:
    """Worst error of the torques at the joints over the side, in flush forces."""
    scene = sample.scenes[0]
    side = scene.casing.side
    states = pinned_states(list(sample.headings), side)
    exact = Loads(sample.force[..., 0], sample.force[..., 1], sample.torque)
    apart: Array = joint_torques(loads, states, side) - joint_torques(exact, states, side)
    return float(np.abs(apart).max()) / side / exact_magnets.flush_force(scene)


def _task(contender: Contender) -> Task:
    return lambda: contender.work


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
    taken = times[each.key].spread
    row: Row = {
        "n": n,
        "shape": shape,
        "by": each.by,
        "mesh or bound": each.setting,
        "force error": each.force_error,
        "joint error": each.joint_error,
        **taken.time_cells("µs", 1e6),
    }
    for by in (SUMS, DYNAMICS):
        fast = fastest(contenders, times, each, by) if each.by == MAGPYLIB else ""
        quotient = ratio(times[each.key], times[fast]) if fast else NONE
        row |= {
            f"time / {by}": quotient.median,
            f"time / {by}, lower quartile": quotient.low,
            f"time / {by}, upper quartile": quotient.high,
        }
    return row


NONE = Spread(float("nan"), float("nan"), float("nan"))


def _table(rows: list[Row]) -> Table:
    shown: list[Row] = []
    for row in rows:
        line: Row = {}
        for key, cell in row.items():
            if "quartile" not in key:
                line[key] = "" if isinstance(cell, float) and np.isnan(cell) else cell
        shown.append(line)
    return Table("All magnets of a chain, beside magpylib: errors in flush forces", shown)


def _findings(rows: list[Row]) -> list[str]:
    found: list[str] = []
    for n in dict.fromkeys(int(row["n"]) for row in rows):
        mine = [row for row in rows if row["n"] == n and row["by"] == MAGPYLIB]
        for by in (SUMS, DYNAMICS):
            factors = [float(row[f"time / {by}"]) for row in mine]
            held = sum(factor >= WANTED for factor in factors)
            found.append(
                f"n = {n}: magpylib's getFT takes {min(factors):.3g} to {max(factors):.3g} times "
                f"as long as the engine's {by} at no larger error; at least {WANTED:g} is asked "
                f"for: holds for {held} of {len(factors)} meshes and shapes"
            )
    return found
