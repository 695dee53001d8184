"""How much friction chains bear, by their length: why the longer suites have less of it."""

from __future__ import annotations

from collections import Counter

import numpy as np

from magfold_env.designer.annealing import anneal_sequence
from magfold_env.designer.task import Choice
from magfold_env.ensembles import ensemble, release
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.scene import load_scene
from magfold_env.shapes import folded_words

LENGTHS, QUICK_LENGTHS = (6, 8, 10, 12, 16), (6, 8)
FRICTIONS = (0.35, 0.2, 0.1, 0.05)
SPEED = 0.2  # [m/s]
WORDS, RUNS = 8, 6


def run(quick: bool, progress: Progress) -> Measurement:
    """Feed designs forward over floors of different friction; a design is made without a floor."""
    lengths = QUICK_LENGTHS if quick else LENGTHS
    scene = load_scene("design-long")
    rng = np.random.default_rng(0)
    rows: list[Row] = []
    for k, n in enumerate(lengths):
        words = rng.choice(folded_words(n), 2 if quick else WORDS, replace=False).tolist()
        longer = release(scene.replace(sequence=("NNNN",) * n), "forward")
        sequences = [
            anneal_sequence(longer, word, rng, Counter(), stable=True).sequence for word in words
        ]
        for m, friction in enumerate(FRICTIONS):
            progress((k + m / len(FRICTIONS)) / len(lengths), f"{n} components, {friction}")
            floor = longer.replace(friction=friction)
            hits = [
                ensemble(Choice(sequence, SPEED).applied(floor), RUNS)
                .probability(word, "folded")
                .successes
                for word, sequence in zip(words, sequences, strict=True)
            ]
            share = sum(hits) / (len(words) * RUNS)
            rows.append({"components": n, "friction": friction, "success": share})
    table: list[Row] = [
        {
            "components": n,
            **{
                f"friction {row['friction']}": f"{row['success']:.0%}"
                for row in rows
                if row["components"] == n
            },
        }
        for n in lengths
    ]
    title = f"successes of {WORDS} targets × {RUNS} releases, fed forward at {SPEED} m/s"
    return Measurement("friction", rows, [Table(title, table)])
