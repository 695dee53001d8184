"""Longer chains: how many targets of the suites are solved, and in what time on one core."""

from __future__ import annotations

import time
from typing import get_args

import numpy as np

from magfold_env.benchmarks.design.judged import judged
from magfold_env.designer import design
from magfold_env.designer.make_suites import suite_words
from magfold_env.designer.task import default_scene
from magfold_env.minimiser import Mode
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.scene import load_scene

COUNTS = {8: 15, 10: 15, 12: 50, 16: 9}
QUICK = {8: 2}
RUNS = 40
WANTED = 0.9
LIMIT = 60.0  # [s] a target of twelve components


def run(quick: bool, progress: Progress) -> Measurement:
    """Design for targets of the suites, the modes in turn, with one worker."""
    counts = QUICK if quick else COUNTS
    total = sum(counts.values())
    rows: list[Row] = []
    modes: tuple[Mode, ...] = get_args(Mode)
    for n, count in counts.items():
        words = suite_words(n)
        scene = load_scene(default_scene(n))
        design(words[0], scene, objective="ground", runs=0)  # compiles
        for k, word in enumerate(words[:count]):
            mode = modes[k % len(modes)]
            progress(len(rows) / total, f"{word}, {mode}")
            begun = time.process_time()
            found = design(word, scene, mode, runs=0, workers=1)
            taken = time.process_time() - begun
            # Judged apart, so that the time is the search's.
            success = judged(found, RUNS)
            rows.append(
                {
                    "components": n,
                    "target": word,
                    "mode": mode,
                    "success": success,
                    "releases": found.calls["releases"],
                    "time [s]": taken,
                }
            )
    table = [_summary(n, [row for row in rows if row["components"] == n]) for n in counts]
    findings: list[str] = []
    if 12 in counts:
        mine = [row for row in rows if row["components"] == 12]
        solved = sum(
            float(row["success"]) >= WANTED and float(row["time [s]"]) <= LIMIT for row in mine
        )
        findings.append(
            f"{solved} of {len(mine)} targets of 12 components solved within {LIMIT:.0f} s of one "
            f"core each (success at least {WANTED:.0%} of {RUNS} releases of their own)"
        )
    return Measurement("lengths", rows, [Table("targets of the suites", table)], findings)


def _summary(n: int, rows: list[Row]) -> Row:
    times = [float(row["time [s]"]) for row in rows]
    return {
        "components": n,
        "targets": len(rows),
        "solved": sum(float(row["success"]) >= WANTED for row in rows),
        "success, mean": f"{np.mean([float(row['success']) for row in rows]):.1%}",
        "releases, median": int(np.median([int(row["releases"]) for row in rows])),
        "time, median [s]": f"{np.median(times):.3g}",
        "time, longest [s]": f"{max(times):.3g}",
    }
