"""What predicts a fold: what exact energies and proofs cost, and how often each predictor is right.

By energy, predictors are held against proved ground states. Against the dynamics, they are to name
the most frequent word of many releases: the minimiser's three searches, and the most frequent word
of a few releases with other draws; where words are equally frequent, either is right. Releases are
counted a second, by the workers that share them.
"""

import os
import time
from collections.abc import Callable
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from magfold_bench.laws.experiment import MODES, SEQUENCES, paper_scene, random_scenes
from magfold_bench.laws.random_scenes import random_sequence
from magfold_env.ensembles.releases import PREDICTORS, ensemble, generator, predictions
from magfold_env.fold import FoldStatus
from magfold_env.minimiser import Landscape, Mode, descend, ground_state, minimise
from magfold_env.parallel import Backend
from magfold_env.reporting import timing
from magfold_env.reporting.intervals import share
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, each_case
from magfold_env.scene import Scene
from magfold_env.shapes import folded_words, headings
from magfold_env.simulation.session import Session

SCANNED = 6  # components
SCAN_BUDGET = 3.0  # [s] for every sequence on all folded words
PROVED = {12: 21, 16: 21, 20: 21, 24: 21, 28: 5, 30: 3}  # number of sequences of each length
QUICK_PROVED = {12: 3, 16: 3}
PROOF_BUDGETS = {20: 10.0, 24: 300.0}  # [s], for the median
COMPARED = (6, 10, 14)  # components
SCAN_SEED, PROOF_SEED, COMPARISON_SEED = 3, 4, 5
FEEDS: tuple[Mode, ...] = ("forward", "backward")


def random_scene(rng: np.random.Generator, n: int) -> Scene:
    """Return a chain of n components with random poles."""
    return Scene(sequence=random_sequence(rng, n, "SN"))


def scan(quick: bool, progress: Progress) -> Measurement:
    """Time exact energies of six components: of one word, of all, for every sequence."""
    rng = np.random.default_rng(SCAN_SEED)
    scene = random_scene(rng, SCANNED)
    folded, everything = Landscape(scene, "folded"), Landscape(scene)
    signs = rng.choice([-1.0, 1.0], (1000 if quick else 20_000, SCANNED, 4))
    # The energies of every sequence, and how many sequences and words that is.
    every = 1 << (4 * SCANNED - 1)
    word = folded_words(SCANNED)[0]
    ground = "ground state of every sequence, folded words"
    work: dict[str, tuple[Callable[[], object], int, int]] = {
        "random sequences, folded words": (lambda: folded.energies(signs), len(signs), 26),
        "random sequences, all words": (lambda: everything.energies(signs), len(signs), 229),
        "every sequence, one word": (lambda: folded.every_energy(word), every, 1),
        ground: (folded.every_sequence, every, 26),
    }
    if not quick:
        scanned = (everything.every_sequence, every, 229)
        work["ground state of every sequence, all words"] = scanned
    timings = timing.take_turns(
        {name: timing.unprepared(call) for name, (call, _, _) in work.items()},
        rounds=2 if quick else 7,
        tick=lambda share: progress(share, "scanning"),
    )
    rows: list[Row] = [
        {
            "what": name,
            "sequences": sequences,
            "words": words,
            **timings[name].spread.time_cells("s"),
            "each [ns]": timings[name].median / (sequences * words) * 1e9,
        }
        for name, (_, sequences, words) in work.items()
    ]
    taken = timings[ground].spread
    held = _within(taken.median, SCAN_BUDGET)
    finding = f"every sequence of {SCANNED} on 26 words: {taken} s, {held}"
    return Measurement(rows, [Table("exact energies of chains of six", rows)], [finding])


def ground_states(quick: bool, progress: Progress) -> Measurement:
    """Time proofs of long chains' ground states, one core, couplings of the length known."""
    lengths = QUICK_PROVED if quick else PROVED
    rng = np.random.default_rng(PROOF_SEED)
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
        spread = timing.spread_of(np.array(taken))
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
        f"{_within(float(row['median [s]']), PROOF_BUDGETS[n])}"
        for row in rows
        if (n := int(row["components"])) in PROOF_BUDGETS
    ]
    return Measurement(rows, [Table("proofs of ground states", rows)], findings)


def by_energy(quick: bool, progress: Progress) -> Measurement:
    """Compare feeds and descents with the proved ground states of random sequences."""
    count = 5 if quick else 60
    rng = np.random.default_rng(COMPARISON_SEED)
    rows: list[Row] = []
    for n in COMPARED[:2] if quick else COMPARED:
        hits = dict.fromkeys([*FEEDS, "descent"], 0)
        for k in range(count):
            progress((len(rows) + k / count) / len(COMPARED), f"{n} components")
            scene = random_scene(rng, n)
            lowest = ground_state(scene).best.word
            for feed in FEEDS:
                with suppress(ValueError):  # a feed that shuts itself in names none
                    hits[feed] += minimise(scene, feed).best.word == lowest
            spread = scene.start_angle_spread
            start = headings(rng.uniform(-spread, spread, n - 1))
            hits["descent"] += descend(scene, start).word == lowest
        rows.append({"components": n, **{name: hit / count for name, hit in hits.items()}})
    table = Table(f"share of {count} random sequences whose ground state is named", rows)
    return Measurement(rows, [table])


def _within(seconds: float, budget: float) -> str:
    return f"{'within' if seconds <= budget else 'NOT within'} {budget:.0f} s"


MANY, FEW, SCENES = 25, 5, 100
QUICK_MANY, QUICK_SCENES = 6, 2
DYNAMICS = f"dynamics, {FEW} releases"
NAMES = (*PREDICTORS.values(), DYNAMICS)
FOLDED = FoldStatus.FOLDED.value

RUNS, QUICK_RUNS = 1000, 50  # of the ensemble that is timed
COUNTS = (2, 4, 8, 16, 32, 64)  # of its workers


class Case(NamedTuple):
    """A scene, its favoured words, and what each predictor names."""

    group: str
    mode: Mode
    sequence: tuple[str, ...]
    words: tuple[str, ...]  # the most frequent ones of all releases
    folds: tuple[str, ...]  # and of those that folded fully
    rate: float  # share of releases that end in one of `words`
    folded: float  # share of those that fold fully
    named_word: dict[str, str]  # by predictor; absent where it names none
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
    scenes: list[tuple[str, Mode, Scene]] = []
    for mode in MODES:
        scenes.extend(("paper", mode, paper_scene(sequence, mode)) for sequence in SEQUENCES)
        scenes.extend(("random", mode, scene) for scene in random_scenes(count, mode))
    named = each_case(progress, scenes, lambda each: f"{each[0]}, {each[1]}")
    cases = [compare(*each, many) for each, _ in named]
    title = f"most frequent of {many} releases"
    tables = [
        Table(f"How often the {title} is named: word", summary(cases, fold=False)),
        Table(f"How often the {title} is named: full fold", summary(cases, fold=True)),
    ]
    return Measurement([case.to_row() for case in cases], tables, _findings(cases))


def compare(group: str, mode: Mode, scene: Scene, many: int) -> Case:
    """Simulate a scene's favoured words and ask the predictors."""
    reference = ensemble(scene, many, seed=0)
    few, by_energy = ensemble(scene, FEW, seed=1), predictions(scene)
    words = reference.most_frequent()

    def named(status: str | None) -> dict[str, str]:
        """Return what each predictor names; of the few releases only those with a status count."""
        most = few.most_frequent(status)
        return by_energy | ({DYNAMICS: most[0]} if most else {})

    return Case(
        group,
        mode,
        scene.sequence,
        words,
        reference.most_frequent(FOLDED),
        reference.words[words[0]].rate,
        reference.probability(status=FOLDED).rate,
        named(None),
        named(FOLDED),
    )


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
