"""What the first use of the engine costs, which compiles it, and later ones, which load it."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time

from magfold_env.reporting.tables import Measurement, Progress, Row, Table

LIMITS = {"first use": 60.0, "later use": 3.0}  # [s]
LATER = 5

_FOLD = (
    "import magfold_env as mf; "
    "mf.simulate(mf.load_scene('paper/sequence-3').replace(mount='tube', feed={'speed': 0.5}))"
)


def run(quick: bool, progress: Progress) -> Measurement:
    """Start Python, import the package and fold a chain out of its tube; first without a cache."""
    rows: list[Row] = []
    later = 1 if quick else LATER
    with tempfile.TemporaryDirectory() as cache:
        for k in range(1 + later):
            kind = "later use" if k else "first use"
            progress(k / (1 + later), kind)
            rows.append({"process": kind, **_timed(cache)})
    table: list[Row] = []
    for kind, limit in LIMITS.items():
        mine = sorted(float(row["processor time [s]"]) for row in rows if row["process"] == kind)
        middle = mine[len(mine) // 2]
        within = "within" if middle <= limit else "NOT within"
        verdict = f"{within} {limit:.0f} s"
        table.append({"process": kind, "processor time [s]": round(middle, 1), "wanted": verdict})
    return Measurement("first-use", rows, [Table("one fold in a process of its own", table)])


def _timed(cache: str) -> Row:
    begun, used = time.perf_counter(), _children()
    environment = {**os.environ, "NUMBA_CACHE_DIR": cache, "OMP_NUM_THREADS": "1"}
    subprocess.run([sys.executable, "-c", _FOLD], env=environment, check=True, capture_output=True)
    taken = time.perf_counter() - begun
    return {"processor time [s]": _children() - used, "time [s]": taken}


def _children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
