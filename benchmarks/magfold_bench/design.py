"""Design chains for every target and mode of release, and compare them with designs by energy."""

from collections.abc import Mapping
from itertools import product
from typing import get_args

from magfold_bench import tables
from magfold_bench.tables import Measurement, Progress, Row, Table
from magfold_env.designer import design, gap_designs
from magfold_env.designer.task import SPEEDS, Choice
from magfold_env.ensembles.releases import ensemble, release
from magfold_env.minimiser import Mode
from magfold_env.reporting.intervals import Share
from magfold_env.scene import Scene, load_scene
from magfold_env.shapes import folded_words

WANTED = 0.9  # required share of successes
RUNS = 100
SELECTION = 16
"""Number of releases at each speed that select the best speed for the minimiser's design."""


def targets(quick: bool, progress: Progress) -> Measurement:
    """Design a chain for each target, and count successes in releases that no search has used."""
    scene = load_scene("design")
    if quick:
        scene = scene.replace(sequence=scene.sequence[:4])
    words = folded_words(scene.n)[: 2 if quick else None]
    runs = 10 if quick else RUNS
    by_energy = gap_designs(scene, words)
    rows: list[Row] = []
    shown: dict[str, Row] = {word: {"target": word} for word in words}
    cases: list[tuple[str, Mode]] = list(product(words, get_args(Mode)))
    for (word, mode), _ in tables.each_case(progress, cases, ", ".join):
        row = _target_row(scene, word, mode, by_energy, runs)
        rows.append(row)
        shown[word] |= {
            mode: f"{row['successes']}",
            f"{mode}: releases": row["releases of the search"],
            f"{mode}: minimiser": f"{row['minimiser']}",
        }
    table = Table(f"successes of {runs} releases", list(shown.values()))
    counts = tables.numbers(rows, "runs")

    def said(key: str) -> tuple[str, str]:
        hits = tables.numbers(rows, key)
        return f"{int((hits >= WANTED * counts).sum())}", f"mean {hits.sum() / counts.sum():.1%}"

    ours, theirs = said("successes"), said("minimiser")
    finding = (
        f"at least {WANTED:.0%} of the releases succeed for {ours[0]} of {len(rows)} "
        f"targets and modes, {ours[1]}; with the minimiser's designs at their "
        f"best speeds for {theirs[0]}, {theirs[1]}"
    )
    return Measurement(rows, [table], [finding])


def minimisers_choice(
    scene: Scene, word: str, mode: Mode, by_energy: Mapping[str, tuple[str, ...] | None], seed: int
) -> Choice | None:
    """Return the word's sequence with the largest energy gap, at its best speed, or None."""
    sequence = by_energy[word]
    if sequence is None:
        return None
    if mode == "free":
        return Choice(sequence, None)
    choices = [Choice(sequence, speed) for speed in SPEEDS]

    def successes(choice: Choice) -> int:
        made = ensemble(choice.applied(release(scene, mode)), SELECTION, seed)
        return made.probability(word, "folded").successes

    return max(choices, key=successes)


def _target_row(
    scene: Scene, word: str, mode: Mode, by_energy: Mapping[str, tuple[str, ...] | None], runs: int
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
