"""The tolerance of the environments' scenes: which ends it changes, and what it saves.

Random episodes are recorded as scenes, and simulated again at every tolerance. The reference is a
far tighter one, and a second one beside it says how many ends are decided by less than either: of
these episodes no tolerance is to be blamed.
"""

from collections.abc import Sequence
from typing import cast

import numpy as np

from magfold_env.benchmarks.env import players
from magfold_env.benchmarks.env.players import TUBE_FEED
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.reporting import intervals, tables
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.scene import Scene
from magfold_env.simulation.simulate import simulate_batch

LENGTHS = (6, 8)
EPISODES, FEW = 550, 10  # of each length
REFERENCE = 2e-6  # [rad]
TOLERANCES = (5e-6, 1e-4, 3e-4, 1e-3, 3e-3)
WANTED = 0.995  # share of ends that a tolerance is to keep
SEED = 29

Ends = list[tuple[str, str]]


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure chains of each length."""
    count = FEW if quick else EPISODES
    rows: list[Row] = []
    for n, tick in tables.each_case(progress, LENGTHS, lambda n: f"n = {n}"):
        rows += measure(n, record(n, count, tick), tick)
    title = f"Random episodes that end as at {REFERENCE:g} rad"
    return Measurement(rows, [Table(title, rows)], [_finding(rows)])


def record(n: int, count: int, tick: Tick) -> list[Scene]:
    """Return the scenes of random episodes of chains of n components."""
    env = players.single(TUBE_FEED, components=n, actions="box", baseline=None)
    played = cast("TubeFeedEnv", env.unwrapped)
    actions = players.log_uniform(np.random.default_rng([SEED, n]), n, count)
    scenes: list[Scene] = []
    for k in range(count):
        players.play_single(env, SEED + k, actions[:, k : k + 1])
        scenes.append(played.to_scene())
        tick(0.2 * (k + 1) / count)
    return scenes


def measure(n: int, scenes: Sequence[Scene], tick: Tick) -> list[Row]:
    """Return a row for each tolerance."""
    reference, _ = ends(scenes, REFERENCE)
    rows: list[Row] = []
    for k, tolerance in enumerate(TOLERANCES):
        found, evaluations = ends(scenes, tolerance)
        same = sum(one == other for one, other in zip(found, reference, strict=True))
        share = intervals.share(same, len(scenes))
        rows.append(
            {
                "n": n,
                "tolerance [rad]": tolerance,
                "episodes": len(scenes),
                "same end": same,
                "low": share.low,
                "high": share.high,
                "evaluations": evaluations,
            }
        )
        tick(0.3 + 0.7 * (k + 1) / len(TOLERANCES))
    return rows


def ends(scenes: Sequence[Scene], tolerance: float) -> tuple[Ends, float]:
    """Return words and statuses at a tolerance [rad], and the mean number of evaluations."""
    at = [scene.replace(solver={"tolerance": tolerance}) for scene in scenes]
    # Recorded scenes are drawn: seeds change nothing.
    folds = simulate_batch(at, range(len(at)))
    mean = float(np.mean([fold.evaluations for fold in folds]))
    return [(fold.word, fold.status.value) for fold in folds], mean


def _finding(rows: list[Row]) -> str:
    said: list[str] = []
    for tolerance in TOLERANCES:
        mine = [row for row in rows if row["tolerance [rad]"] == tolerance]
        same, played = (sum(int(row[name]) for row in mine) for name in ("same end", "episodes"))
        said.append(f"{100.0 * same / played:.1f} % at {tolerance:g}")
    return (
        f"Of random episodes end as at {REFERENCE:g} rad: {', '.join(said)}; "
        f"{100.0 * WANTED:g} % was asked for."
    )
