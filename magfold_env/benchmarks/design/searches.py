"""The searches side by side: against proven optima by energy, and in releases that they need."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from magfold_env.benchmarks.design.judged import judged
from magfold_env.designer import Design, design
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.scene import load_scene
from magfold_env.shapes import folded_words

QUICK_WORDS, WORDS = 1, 9
RUNS = 100

_CASES: tuple[tuple[str, str], ...] = (
    ("gap", "exhaustive"),
    ("gap", "annealing"),
    ("sensitivity", "exhaustive"),
    ("sensitivity", "annealing"),
    ("probability", "exhaustive"),
    ("probability", "annealing"),
    ("probability", "cross-entropy"),
)


def run(quick: bool, progress: Progress) -> Measurement:
    """Let every search design for the same targets of six components, fed forward."""
    scene = load_scene("design")
    words = folded_words(scene.n)[:: 26 // WORDS][: QUICK_WORDS if quick else WORDS]
    design(words[0], scene, runs=0)  # compiles, and compares all sequences once for all
    rows: list[Row] = []
    bounds: dict[tuple[str, str], float] = {}
    for k, (objective, search) in enumerate(_CASES):
        for m, word in enumerate(words):
            progress((k + m / len(words)) / len(_CASES), f"{objective}, {search}, {word}")
            kinds: dict[str, Any] = {"objective": objective, "search": search}
            begun = time.process_time()
            found = design(word, scene, runs=0, workers=1, **kinds)
            taken = time.process_time() - begun
            rate = found.score
            if objective == "probability":
                rate = judged(found, 10 if quick else RUNS)
            if search == "exhaustive" and found.bound is not None:
                bounds[objective, word] = found.bound
            rows.append(_row(found, word, rate, bounds.get((objective, word)), taken))
    return Measurement("searches", rows, [Table("searches, medians over targets", _table(rows))])


def _row(found: Design, word: str, score: float | None, bound: float | None, taken: float) -> Row:
    return {
        "objective": found.objective,
        "search": found.search,
        "target": word,
        "score": score if score is not None else 0.0,
        "of the optimum": score / bound if score is not None and bound else "",
        "releases": found.calls.get("releases", 0),
        "time [s]": taken,
    }


def _table(rows: Sequence[Row]) -> list[Row]:
    table: list[Row] = []
    for objective, search in _CASES:
        mine = [r for r in rows if (r["objective"], r["search"]) == (objective, search)]

        def values(key: str, mine: list[Row] = mine) -> list[float]:
            return [float(row[key]) for row in mine if row[key] != ""]

        of_best = values("of the optimum")
        table.append(
            {
                "objective": objective,
                "search": search,
                "targets": len(mine),
                "of the optimum": f"{min(of_best):.2f}–{max(of_best):.2f}" if of_best else "",
                "success, mean": f"{np.mean(values('score')):.1%}"
                if objective == "probability"
                else "",
                "releases": int(np.median(values("releases"))),
                "time [s]": f"{np.median(values('time [s]')):.2g}",
            }
        )
    return table
