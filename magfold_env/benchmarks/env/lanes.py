"""What many chains at once in the lanes of vectors could gain, at most.

Of an episode only the accelerations without constraints are the same work for every chain; stops,
contacts, friction that holds, impacts and steps' lengths are not: their share bounds the gain. Then
lanes do what one of them needs: joints at their stops leave other pairs to look up in every chain,
even if as many components are outside. And chains take different numbers of evaluations: lanes
whose chains have ended take the next one, and stand still when none is left.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magfold_env.benchmarks.env import tolerance
from magfold_env.benchmarks.magnets.chains import states_of
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.magnets.chain import AT_STOP, HALF_PI
from magfold_env.engine.state import Array, IntArray, Model, Work
from magfold_env.engine.stepping.dynamics import smooth_accelerations
from magfold_env.engine.workspace import new_work
from magfold_env.reporting import tables, timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.scene import Scene
from magfold_env.simulation.pack import pack
from magfold_env.simulation.session import Session
from magfold_env.simulation.simulate import simulate_batch

LENGTHS = (6, 8)
EPISODES, FEW = 256, 8
TIMED = 24  # episodes that are timed, and whose states are evaluated
GROUPS = 1000  # of states side by side
WIDTHS = (8, 16, 32)  # lanes
# How many times as fast a chain's accelerations are in lanes as alone: in a trial with 32 of them,
# free joints and the folding of stencils included, and in an ideal one.
FASTER = (2.6, math.inf)
WANTED = 1.3
SEED = 3
TURNING = 1.0  # [rad/s] rates of the joints, which change nothing about the time


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure chains of each length."""
    rows: list[Row] = []
    for n, tick in tables.each_case(progress, LENGTHS, lambda n: f"n = {n}"):
        rows += measure(n, FEW if quick else EPISODES, tick)
    title = "Random episodes side by side in lanes: how many times as fast at most"
    best = max(float(row[_column(FASTER[0])]) for row in rows)
    found = (
        f"Lanes as fast as in a trial gain {best:.2f} times at most; {WANTED:g} times was asked for"
    )
    return Measurement(rows, [Table(title, rows)], [found])


def measure(n: int, count: int, tick: Tick) -> list[Row]:
    """Return a row for each number of lanes."""
    scenes = tolerance.record(n, count, tick)
    share, trials, evaluations = laneable(scenes, tick)
    needed = np.concatenate([trial.needed() for trial in trials])
    held = np.concatenate([trial.held for trial in trials])
    rows: list[Row] = []
    for lanes in WIDTHS:
        busy = busy_share(evaluations, lanes)
        useful = useful_share(needed, held, lanes)
        row: Row = {"n": n, "lanes": lanes, "share of the time": share}
        row |= {"busy lanes": busy, "useful pairs": useful}
        gains = {_column(faster): gain(share, faster * busy * useful) for faster in FASTER}
        rows.append(row | gains)
    return rows


def _column(faster: float) -> str:
    return f"gain, lanes {faster:g} times as fast"


def gain(share: float, faster: float) -> float:
    """How many times as fast all is when a share of it is so many times as fast."""
    return 1.0 / (1.0 - share + share / faster)


def busy_share(work: Sequence[int] | NDArray[Any], lanes: int) -> float:
    """Share of lanes that work, if each takes the next chain when it has done with its last."""
    ends = [0.0] * lanes
    for each in work:
        heapq.heapreplace(ends, ends[0] + float(each))
    return float(np.sum(work)) / (lanes * max(ends))


def useful_share(needed: NDArray[np.bool_], held: IntArray, lanes: int) -> float:
    """Share of the pairs that lanes work on, all that one of them needs, that each needs itself.

    Chains side by side have as many components outside.

    Parameters
    ----------
    needed
        What pairs are looked up in states, (states, pairs).
    held
        How many components the tube holds, (states,).
    """
    rng, useful, done = np.random.default_rng(SEED), 0, 0
    for k in rng.integers(len(needed), size=GROUPS):
        alike = np.flatnonzero(held == held[k])
        together = needed[rng.choice(alike, lanes)]
        useful += together.sum()
        done += lanes * together.any(axis=0).sum()
    return float(useful / done)


def laneable(scenes: Sequence[Scene], tick: Tick) -> tuple[float, list[Trial], NDArray[np.int64]]:
    """Return what can be done in lanes of the time of some episodes, as a share.

    And these episodes, and the evaluations of all.
    """
    trials = [Trial(scene) for scene in scenes[:TIMED]]

    def episodes() -> Callable[[], None]:
        return partial(_settle_all, [Session(scene) for scene in scenes[:TIMED]])

    tasks: dict[str, timing.Task] = {
        "all": episodes,
        "smooth": timing.unprepared(lambda: _settle_all(trials)),
    }
    times = timing.take_turns(tasks, tick=lambda part: tick(0.5 + 0.5 * part))
    folds = simulate_batch(scenes, range(len(scenes)))
    evaluations = np.array([fold.evaluations for fold in folds])
    return timing.ratio(times["smooth"], times["all"]).median, trials, evaluations


def _settle_all(runs: Sequence[Session | Trial]) -> None:
    for each in runs:
        each.settle()


class Trial:
    """The evaluations of an episode, without its constraints."""

    def __init__(self, scene: Scene) -> None:
        states, self._model = states_of(scene), pack(scene)
        out = states.lo < scene.n
        self.held, self._q = states.lo[out], np.ascontiguousarray(states.q[out])
        self._v, self._charge = np.full(scene.n + 2, TURNING), self._model.charge.copy()
        self._work, self._out = new_work(self._model), np.zeros(scene.n + 2)

    def needed(self) -> NDArray[np.bool_]:
        """Which pairs of components are looked up, (states, pairs)."""
        n = self._model.n
        angles = np.abs(np.diff(self._q[:, :n], axis=1))
        turns = np.abs(angles - HALF_PI) > AT_STOP
        pairs = [
            (self.held <= i) & turns[:, i:j].any(axis=1) for i in range(n) for j in range(i + 1, n)
        ]
        return np.stack(pairs, axis=1)

    def settle(self) -> None:
        """Evaluate all."""
        moving = self.held, self._q, self._v
        evaluate(self._model, *moving, self._charge, self._work, self._out)


@kernel
def evaluate(
    model: Model, lo: IntArray, q: Array, v: Array, charge: Array, work: Work, out: Array
) -> None:
    """Find the accelerations at states (states, n + 2), with magnets outside the tube alone."""
    for k in range(lo.size):
        for i in range(model.n):
            for face in range(4):
                model.charge[i, face] = charge[i, face] if i >= lo[k] else 0.0
        smooth_accelerations(lo[k], model, q[k], v, work, out)
