"""Every target of six components in every mode: the design, and the minimiser's alone beside it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import get_args

from magfold_env.designer import GapDesign, design, gap_designs
from magfold_env.designer.task import SPEEDS, Choice
from magfold_env.ensembles import ensemble, release
from magfold_env.minimiser import Mode
from magfold_env.reporting.statistics import Share
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.scene import Scene, load_scene
from magfold_env.shapes import folded_words

RUNS = 100
SELECTION = 16
"""Releases a speed by which the minimiser's design gets its speed."""

WANTED = 0.9


def run(quick: bool, progress: Progress) -> Measurement:
    """Design for each target, and count successes on releases that no search has seen."""
    scene = load_scene("design")
    if quick:
        scene = scene.replace(sequence=scene.sequence[:4])
    words = folded_words(scene.n)[: 2 if quick else None]
    runs = 10 if quick else RUNS
    by_energy = gap_designs(scene, words)
    rows: list[Row] = []
    table: list[Row] = []
    modes = get_args(Mode)
    for k, word in enumerate(words):
        cells: Row = {"target": word}
        for m, mode in enumerate(modes):
            progress((k + m / len(modes)) / len(words), f"{word}, {mode}")
            row = _row(scene, word, mode, by_energy, runs)
            rows.append(row)
            cells |= {
                mode: f"{row['successes']}",
                f"{mode}: releases": row["releases of the search"],
                f"{mode}: minimiser": f"{row['minimiser']}",
            }
        table.append(cells)
    return Measurement(
        "targets", rows, [Table(f"successes of {runs} releases", table)], _findings(rows)
    )


def minimisers_choice(
    scene: Scene, word: str, mode: Mode, by_energy: Mapping[str, GapDesign | None], seed: int
) -> Choice | None:
    """Return the sequence of the largest gap at the speed at which it does best."""
    found = by_energy[word]
    if found is None:
        return None
    if mode == "free":
        return Choice(found.sequence, None)
    choices = [Choice(found.sequence, speed) for speed in SPEEDS]

    def successes(choice: Choice) -> int:
        made = ensemble(choice.applied(release(scene, mode)), SELECTION, seed)
        return made.probability(word, "folded").successes

    return max(choices, key=successes)


def _row(
    scene: Scene, word: str, mode: Mode, by_energy: Mapping[str, GapDesign | None], runs: int
) -> Row:
    found = design(word, scene, mode, runs=runs)
    choice = minimisers_choice(scene, word, mode, by_energy, seed=1)
    alone: Share | None = None
    if choice is not None:
        released = choice.applied(release(scene, mode))
        alone = ensemble(released, runs, found.releases_seed).probability(word, "folded")
    probability = found.probability
    return {
        "target": word,
        "mode": mode,
        "sequence": " ".join(found.sequence) if found.scene else "",
        "speed [m/s]": found.speed if isinstance(found.speed, float) else "",
        "successes": probability.successes if probability else 0,
        "runs": runs,
        "low": probability.low if probability else 0.0,
        "high": probability.high if probability else 0.0,
        "releases of the search": found.calls["releases"],
        "gap [mJ]": 1e3 * found.evidence.gap if found.evidence else "",
        "minimiser": alone.successes if alone else 0,
        "minimiser's speed [m/s]": (choice.speed or "") if choice else "",
    }


def _findings(rows: list[Row]) -> list[str]:
    def reached(key: str) -> int:
        return sum(float(row[key]) >= WANTED * float(row["runs"]) for row in rows)

    def mean(key: str) -> float:
        return sum(float(row[key]) for row in rows) / sum(float(row["runs"]) for row in rows)

    return [
        f"at least {WANTED:.0%} of the releases succeed for {reached('successes')} of {len(rows)} "
        f"targets and modes, mean {mean('successes'):.1%}; with the minimiser's designs at their "
        f"best speeds for {reached('minimiser')}, mean {mean('minimiser'):.1%}"
    ]
