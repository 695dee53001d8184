"""How often each predictor names what the dynamics favour, and how many releases a second go.

The dynamics favour the most frequent word of many releases. Predictors are the minimiser's three
searches and the most frequent word of a few releases with other draws. Where words are equally
frequent, either is right.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from magfold_env.ensembles import PREDICTORS, Ensemble, ensemble, generator, predictions
from magfold_env.fold import FoldStatus
from magfold_env.laws.experiment import MODES, SEQUENCES, paper_scene, random_scenes
from magfold_env.minimiser import Mode
from magfold_env.parallel import Backend
from magfold_env.reporting.intervals import share
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, each_case
from magfold_env.scene import Scene
from magfold_env.simulation.session import Session

MANY, FEW, SCENES = 25, 5, 100
QUICK_MANY, QUICK_SCENES = 6, 2
DYNAMICS = f"dynamics, {FEW} releases"
NAMES = (*PREDICTORS.values(), DYNAMICS)
FOLDED = FoldStatus.FOLDED.value

RUNS, QUICK_RUNS = 1000, 50  # of the ensemble that is timed
COUNTS = (2, 4, 8, 16, 32, 64)  # of its workers


@dataclass(frozen=True)
class Case:
    """A scene, its favoured words, and what each predictor names.

    Attributes
    ----------
    words, folds : tuple of str
        The most frequent words of all releases, and of those that folded fully.
    rate, folded : float
        Share of releases that end in a word of `words`, and share of those that fold fully.
    named_word, named_fold : dict
        The word that each predictor names for either; absent where it names none.
    """

    group: str
    mode: Mode
    sequence: tuple[str, ...]
    words: tuple[str, ...]
    folds: tuple[str, ...]
    rate: float
    folded: float
    named_word: dict[str, str]
    named_fold: dict[str, str]

    def is_named(self, by: str, *, fold: bool) -> bool:
        """Whether a predictor names a favoured word, or a favoured full fold."""
        if fold:
            return self.named_fold.get(by) in self.folds
        return self.named_word.get(by) in self.words

    def to_row(self) -> Row:
        """Return the case as a row of the table."""
        row: Row = {
            "sequences": self.group,
            "mode": self.mode,
            "sequence": " ".join(self.sequence),
            "most frequent word": " ".join(self.words),
            "its share": self.rate,
            "most frequent full fold": " ".join(self.folds),
            "folded": self.folded,
        }
        for name in NAMES:
            row[name] = self.named_word.get(name, "")
        row[f"{DYNAMICS}, full fold"] = self.named_fold.get(DYNAMICS, "")
        return row


def predictors(quick: bool, progress: Progress) -> Measurement:
    """Compare the predictors on the paper's sequences and on random ones, in each mode."""
    count, many = (QUICK_SCENES, QUICK_MANY) if quick else (SCENES, MANY)
    scenes = list(_scenes(count))
    cases: list[Case] = []
    for each, _ in each_case(progress, scenes, lambda each: f"{each[0]}, {each[1]}"):
        cases.append(compare(*each, many))
    title = f"most frequent of {many} releases"
    tables = [
        Table(f"How often the {title} is named: word", summary(cases, fold=False)),
        Table(f"How often the {title} is named: full fold", summary(cases, fold=True)),
    ]
    return Measurement([case.to_row() for case in cases], tables, _findings(cases))


def compare(group: str, mode: Mode, scene: Scene, many: int) -> Case:
    """Simulate a scene's favoured words and ask the predictors."""
    reference = ensemble(scene, many, seed=0)
    few = ensemble(scene, FEW, seed=1)
    by_energy = predictions(scene)
    words = reference.most_frequent()
    return Case(
        group,
        mode,
        scene.sequence,
        words,
        reference.most_frequent(FOLDED),
        reference.words[words[0]].rate,
        reference.probability(status=FOLDED).rate,
        by_energy | _first(few, None),
        by_energy | _first(few, FOLDED),
    )


def _first(few: Ensemble, status: str | None) -> dict[str, str]:
    words = few.most_frequent(status)
    return {DYNAMICS: words[0]} if words else {}


def _scenes(count: int) -> Iterator[tuple[str, Mode, Scene]]:
    for mode in MODES:
        for sequence in SEQUENCES:
            yield "paper", mode, paper_scene(sequence, mode)
        for scene in random_scenes(count, mode):
            yield "random", mode, scene


def summary(cases: list[Case], *, fold: bool) -> list[Row]:
    """Return hits by group and mode; for folds, among the cases in which any release folded."""
    rows: list[Row] = []
    for group in ("paper", "random"):
        for mode in MODES:
            of = [c for c in cases if (c.group, c.mode) == (group, mode)]
            counted = [c for c in of if c.folds] if fold else of
            row: Row = {"sequences": group, "mode": mode, "judged": f"{len(counted)} of {len(of)}"}
            for name in NAMES:
                hits = sum(case.is_named(name, fold=fold) for case in counted)
                row[name] = str(share(hits, len(counted))) if counted else "--"
            rows.append(row)
    return rows


def _findings(cases: list[Case]) -> list[str]:
    found: list[str] = []
    for mode in MODES:
        of = [case for case in cases if (case.group, case.mode) == ("random", mode)]
        folded, rate = np.mean([(case.folded, case.rate) for case in of], axis=0)
        found.append(
            f"Random sequences, {mode}: {folded:.0%} of the releases fold fully; the most frequent "
            f"word takes {rate:.0%} of them on average: naming one word is not right more often."
        )
    return found


def scaling(quick: bool, progress: Progress) -> Measurement:
    """Time one ensemble on more and more workers; every one must give the same folds."""
    runs = QUICK_RUNS if quick else RUNS
    scene = paper_scene(3, "free")
    reference = ensemble(scene, runs, workers=1)  # and compiles
    cores = os.cpu_count() or 1
    counts = sorted({1, cores, *(count for count in COUNTS if count < cores)})
    backends: tuple[Backend, ...] = ("threads", "processes")
    kinds: list[tuple[Backend, int]] = [
        (backend, count)
        for backend in backends
        for count in counts
        if count > 1 or backend == "threads"  # one process is this one, as is one thread
    ]
    rows: list[Row] = []
    for (backend, count), _ in each_case(progress, kinds, lambda kind: f"{kind[1]} {kind[0]}"):
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
    return Measurement(rows, [table], [finding])


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
