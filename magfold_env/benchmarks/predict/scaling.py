"""How many releases a second, by kind and number of workers."""

from __future__ import annotations

import os
import time

from magfold_env.benchmarks.part import Part, Progress, Row, Table
from magfold_env.benchmarks.predict.scenes import paper_scene
from magfold_env.ensembles import ensemble
from magfold_env.parallel import Backend

RUNS, QUICK_RUNS = 1000, 50
_COUNTS = (2, 4, 8, 16, 32, 64)


def run(quick: bool, progress: Progress) -> Part:
    """Time one ensemble on more and more workers; every one must give the same words."""
    runs = QUICK_RUNS if quick else RUNS
    scene = paper_scene(3, "free")
    reference = ensemble(scene, runs, workers=1)  # and compiles
    cores = os.cpu_count() or 1
    counts = sorted({1, cores, *(count for count in _COUNTS if count < cores)})
    backends: tuple[Backend, ...] = ("threads", "processes")
    kinds: list[tuple[Backend, int]] = [
        (backend, count)
        for backend in backends
        for count in counts
        if count > 1 or backend == "threads"  # one process is this one, as is one thread
    ]
    rows: list[Row] = []
    for k, (backend, count) in enumerate(kinds):
        progress(k / len(kinds), f"{count} {backend}")
        begun, busy = time.perf_counter(), time.process_time()
        made = ensemble(scene, runs, workers=count, backend=backend)
        taken, used = time.perf_counter() - begun, time.process_time() - busy
        if (made.angles != reference.angles).any():
            raise RuntimeError(f"{count} {backend} gave other folds than one thread")
        rate = runs / taken
        rows.append(
            {
                "backend": backend,
                "workers": count,
                "releases a second": rate,
                "times one thread": rate / float(rows[0]["releases a second"]) if rows else 1.0,
                "processor time of this process (s)": used,
            }
        )
    table = Table(f"{runs} releases of sequence 3, free", rows)
    return Part("scaling", rows, [table])
