"""The predictors by energy: what exact energies and proofs cost, and how often others agree."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress

import numpy as np

from magfold_env.laws.random_scenes import random_sequence
from magfold_env.minimiser import Landscape, Mode, descend, ground_state, minimise
from magfold_env.reporting import timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.scene import Scene
from magfold_env.shapes import folded_words, headings

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


def predictors(quick: bool, progress: Progress) -> Measurement:
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
