"""The tolerance of the environments' scenes: which ends it changes, and what it saves.

Random episodes are recorded as scenes, and simulated again at every tolerance. The reference is a
far tighter one, and a second one beside it says how many ends are decided by less than either: of
these episodes no tolerance is to be blamed. A chain that ends alike at two tolerances should cost
little more at the tighter one: many times as much means that its steps are cut short by something
that no tolerance knows of.
"""

import math
from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import NDArray

from magfold_bench.env import players
from magfold_bench.env.players import TUBE_FEED
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
LOOSER, DEARER = 10.0, 3.0  # times: at most so many more evaluations at a tolerance so much tighter
GROWTH = (f"as at {LOOSER:g} times that", f"at most {DEARER:g} times the cost", "most [times]")
SEED = 29

Ends = list[tuple[str, str]]
Runs = dict[float, tuple[Ends, NDArray[np.int64]]]


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure chains of each length."""
    count = FEW if quick else EPISODES
    rows: list[Row] = []
    for n, tick in tables.each_case(progress, LENGTHS, lambda n: f"n = {n}"):
        rows += measure(n, record(n, count, tick), tick)
    title = f"Random episodes that end as at {REFERENCE:g} rad"
    return Measurement(rows, [Table(title, rows)], [_finding(rows), _growth_finding(rows)])


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
    runs: Runs = {}
    for k, tolerance in enumerate(TOLERANCES):
        runs[tolerance] = ends(scenes, tolerance)
        tick(0.3 + 0.7 * (k + 1) / len(TOLERANCES))
    for tolerance, (found, evaluations) in runs.items():
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
                "evaluations": float(evaluations.mean()),
                **_growth(tolerance, runs),
            }
        )
    return rows


def _growth(tolerance: float, runs: Runs) -> Row:
    """Compare evaluations with those of a looser tolerance, of chains that end alike at both."""
    looser = next((each for each in runs if math.isclose(each, LOOSER * tolerance)), None)
    if looser is None:
        return dict.fromkeys(GROWTH, "")
    (found, much), (other, little) = runs[tolerance], runs[looser]
    alike = np.array([one == two for one, two in zip(found, other, strict=True)])
    times = much[alike] / little[alike]
    counts = times.size, int((times <= DEARER).sum()), float(times.max(initial=0.0))
    return dict(zip(GROWTH, counts, strict=True))


def ends(scenes: Sequence[Scene], tolerance: float) -> tuple[Ends, NDArray[np.int64]]:
    """Return words and statuses at a tolerance [rad], and the numbers of evaluations."""
    at = [scene.replace(solver={"tolerance": tolerance}) for scene in scenes]
    # Recorded scenes are drawn: seeds change nothing.
    folds = simulate_batch(at, range(len(at)))
    evaluations = np.array([fold.evaluations for fold in folds])
    return [(fold.word, fold.status.value) for fold in folds], evaluations


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


def _growth_finding(rows: list[Row]) -> str:
    compared = [row for row in rows if row[GROWTH[0]] != ""]
    alike, cheap = (sum(int(row[name]) for row in compared) for name in GROWTH[:2])
    most = max(float(row[GROWTH[2]]) for row in compared)
    return (
        f"Of {alike} pairs of episodes that end alike at a tolerance and at one {LOOSER:g} times "
        f"looser, {100.0 * cheap / alike:.2f} % take at most {DEARER:g} times the evaluations, "
        f"none more than {most:.2f} times; 99.9 % was asked for."
    )
