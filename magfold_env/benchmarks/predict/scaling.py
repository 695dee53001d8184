"""How many releases a second, by kind and number of workers, and what threads cannot share."""

from __future__ import annotations

import os
import time

from magfold_env.ensembles import ensemble, generator
from magfold_env.laws.experiment import paper_scene
from magfold_env.parallel import Backend
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.scene import Scene
from magfold_env.simulation.session import Session

RUNS, QUICK_RUNS = 1000, 50
_COUNTS = (2, 4, 8, 16, 32, 64)


def run(quick: bool, progress: Progress) -> Measurement:
    """Time one ensemble on more and more workers; every one must give the same folds."""
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
        begun = time.perf_counter()
        made = ensemble(scene, runs, workers=count, backend=backend)
        rate = runs / (time.perf_counter() - begun)
        if (made.angles != reference.angles).any():
            raise RuntimeError(f"{count} {backend} gave other folds than one thread")
        first = float(rows[0]["releases a second"]) if rows else rate
        row: Row = {"backend": backend, "workers": count}
        rows.append(row | {"releases a second": rate, "times one thread": rate / first})
    table = Table(f"{runs} releases of sequence 3, free", rows)
    inside, outside = locked(scene, runs)
    finding = (
        f"A release takes {1e3 * (inside + outside):.1f} ms of processor time, {1e3 * outside:.1f} "
        "of them outside the kernels, where threads wait for each other: threads cannot be more "
        f"than {(inside + outside) / outside:.0f} times as fast as one, processes can."
    )
    return Measurement("scaling", rows, [table], [finding])


def locked(scene: Scene, runs: int) -> tuple[float, float]:
    """Return the processor time of a free release inside and outside the kernels [s]."""
    inside = outside = 0.0
    for k in range(runs):
        begun = time.thread_time()
        session = Session(scene.draw(generator(0, k)))
        drawn = time.thread_time()
        session.settle()
        settled = time.thread_time()
        session.fold()
        inside += settled - drawn
        outside += time.thread_time() - settled + drawn - begun
    return inside / runs, outside / runs
