"""How long it takes to prove the ground states of long chains."""

from __future__ import annotations

import time

import numpy as np

from magfold_env.benchmarks.energy.scenes import random_scene
from magfold_env.minimiser import ground_state
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.reporting.timing import spread_of

NAME = "ground-states"
LENGTHS = {12: 21, 16: 21, 20: 21, 24: 21, 28: 5, 30: 3}  # number of sequences of each length
QUICK = {12: 3, 16: 3}
BUDGETS = {20: 10.0, 24: 300.0}  # [s], for the median
SEED = 4


def run(quick: bool, progress: Progress) -> Measurement:
    """Time proofs, one core, couplings of the length known."""
    lengths = QUICK if quick else LENGTHS
    rng = np.random.default_rng(SEED)
    ground_state(random_scene(rng, 4))  # compiles
    rows: list[Row] = []
    for n, count in lengths.items():
        ground_state(random_scene(rng, n), node_limit=0)
        taken: list[float] = []
        nodes: list[int] = []
        proved = 0
        for k in range(count):
            progress((len(rows) + k / count) / len(lengths), f"{n} components")
            scene = random_scene(rng, n)
            begun = time.thread_time()
            found = ground_state(scene)
            taken.append(time.thread_time() - begun)
            nodes.append(found.nodes)
            proved += found.proved
        spread = spread_of(np.array(taken))
        rows.append(
            {
                "components": n,
                "sequences": count,
                "proved": proved,
                "median [s]": spread.median,
                "lower quartile [s]": spread.low,
                "upper quartile [s]": spread.high,
                "slowest [s]": max(taken),
                "nodes": int(np.median(nodes)),
            }
        )
    findings = [
        f"ground state of {n} components proved in {row['median [s]']:.2g} s (median), "
        f"{'within' if float(row['median [s]']) <= BUDGETS[n] else 'NOT within'} {BUDGETS[n]:.0f} s"
        for row in rows
        if (n := int(row["components"])) in BUDGETS
    ]
    return Measurement(NAME, rows, [Table("proofs of ground states", rows)], findings)
