"""Time that it takes to prove which fold of a long chain has the lowest energy."""

import time

import numpy as np

from magfold_bench import timing
from magfold_bench.laws.random_scenes import random_sequence
from magfold_bench.tables import Measurement, Progress, Row, Table
from magfold_env.minimiser import ground_state
from magfold_env.scene import Scene

PROVED = {12: 21, 16: 21, 20: 21, 24: 21, 28: 5, 30: 3}  # number of sequences of each length
QUICK_PROVED = {12: 3, 16: 3}
PROOF_BUDGETS = {20: 10.0, 24: 300.0}  # largest median time [s], by length
PROOF_SEED = 4


def random_scene(rng: np.random.Generator, n: int) -> Scene:
    """Return a chain of n components with random poles."""
    return Scene(sequence=random_sequence(rng, n, "SN"))


def run(quick: bool, progress: Progress) -> Measurement:
    """Time the proofs of long chains' ground states on one core, without computing couplings."""
    lengths = QUICK_PROVED if quick else PROVED
    rng = np.random.default_rng(PROOF_SEED)
    ground_state(random_scene(rng, 4))  # compiles
    rows: list[Row] = []
    for n, count in lengths.items():
        ground_state(random_scene(rng, n))  # the first chain of each length computes the couplings
        taken: list[float] = []
        nodes: list[int] = []
        for k in range(count):
            progress((len(rows) + k / count) / len(lengths), f"{n} components")
            scene = random_scene(rng, n)
            begun = time.thread_time()
            found = ground_state(scene)
            taken.append(time.thread_time() - begun)
            nodes.append(found.examined)
        spread = timing.spread_of(np.array(taken))
        rows.append(
            {
                "components": n,
                "sequences": count,
                "median [s]": spread.median,
                "lower quartile [s]": spread.low,
                "upper quartile [s]": spread.high,
                "slowest [s]": max(taken),
                "nodes": int(np.median(nodes)),
            }
        )
    findings = [
        f"ground state of {n} components proved in {taken:.2g} s (median), "
        f"{'' if taken <= PROOF_BUDGETS[n] else 'NOT '}within {PROOF_BUDGETS[n]:.0f} s"
        for n, taken in ((int(row["components"]), float(row["median [s]"])) for row in rows)
        if n in PROOF_BUDGETS
    ]
    return Measurement(rows, [Table("proofs of ground states", rows)], findings)
