"""What exact energies cost: of one word, of all, for many sequences and for every one."""

from __future__ import annotations

import numpy as np

from magfold_env.benchmarks.energy.scenes import random_scene, random_signs
from magfold_env.engine.state import Array
from magfold_env.minimiser import Landscape
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.reporting.timing import Task, take_turns
from magfold_env.shapes import folded_words

NAME = "scan"
LENGTH = 6
BUDGET = 3.0  # [s] for every sequence on all folded words
SEED = 3


def run(quick: bool, progress: Progress) -> Measurement:
    """Time the scans of six components."""
    rng = np.random.default_rng(SEED)
    scene = random_scene(rng, LENGTH)
    folded, everything = Landscape(scene, "folded"), Landscape(scene)
    signs = random_signs(rng, 1000 if quick else 20_000, LENGTH)
    # The energies of every sequence, and how many sequences and words that is.
    every = 1 << (4 * LENGTH - 1)
    word = folded_words(LENGTH)[0]
    work: dict[str, tuple[Task, int, int]] = {
        "random sequences, folded words": (_energies(folded, signs), len(signs), 26),
        "random sequences, all words": (_energies(everything, signs), len(signs), 229),
        "every sequence, one word": (lambda: lambda: folded.every_energy(word), every, 1),
        "ground state of every sequence, folded words": (lambda: folded.every_sequence, every, 26),
    }
    if not quick:
        scan = (lambda: everything.every_sequence, every, 229)
        work["ground state of every sequence, all words"] = scan
    timings = take_turns(
        {name: task for name, (task, _, _) in work.items()},
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
    taken = timings["ground state of every sequence, folded words"].spread
    verdict = "within" if taken.median <= BUDGET else "NOT within"
    finding = f"every sequence of {LENGTH} on 26 words: {taken} s, {verdict} {BUDGET:.0f} s"
    return Measurement(NAME, rows, [Table("exact energies of chains of six", rows)], [finding])


def _energies(landscape: Landscape, signs: Array) -> Task:
    return lambda: lambda: landscape.energies(signs)
