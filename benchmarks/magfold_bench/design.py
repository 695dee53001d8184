"""Design: every target and mode, searches side by side, longer chains, and how much friction."""

import time
from collections import Counter
from collections.abc import Mapping
from itertools import product
from typing import Any, get_args

import numpy as np

from magfold_bench.presentation import median
from magfold_env.designer import Design, GapDesign, design, gap_designs
from magfold_env.designer.annealing import anneal_sequence
from magfold_env.designer.make_suites import suite_words
from magfold_env.designer.task import SPEEDS, Choice, default_scene
from magfold_env.ensembles.releases import ensemble, release
from magfold_env.minimiser import Mode
from magfold_env.reporting import tables
from magfold_env.reporting.intervals import Share
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.scene import Scene, load_scene
from magfold_env.shapes import folded_words

WANTED = 0.9  # share of successes
RUNS = 100
SELECTION = 16
"""Releases a speed by which the minimiser's design gets its speed."""
QUICK_WORDS, WORDS = 1, 9
"""Targets of the searches."""
SEARCHES: tuple[tuple[str, str], ...] = (
    ("gap", "exhaustive"),
    ("gap", "annealing"),
    ("sensitivity", "exhaustive"),
    ("sensitivity", "annealing"),
    ("probability", "exhaustive"),
    ("probability", "annealing"),
    ("probability", "cross-entropy"),
)
SUITES, QUICK_SUITES = {8: 15, 10: 15, 12: 50, 16: 9}, {8: 2}
"""Targets of longer chains, by their components."""
SUITE_RUNS = 40
LIMITED, LIMIT = 12, 60.0  # components, and [s] that each of their targets may take
LENGTHS, QUICK_LENGTHS = (6, 8, 10, 12, 16), (6, 8)
FRICTIONS = (0.35, 0.2, 0.1, 0.05)
FRICTION_SPEED = 0.2  # [m/s]
FRICTION_WORDS, FRICTION_RUNS = 8, 6


def success_rate(found: Design, runs: int) -> float:
    """Return the share of successes on releases unknown to the search; 0 without a design.

    Counted apart from a search that is timed alone.
    """
    if found.scene is None:
        return 0.0
    made = ensemble(found.scene, runs, found.releases_seed)
    return made.probability(found.target, "folded").rate


def targets(quick: bool, progress: Progress) -> Measurement:
    """Design for each target, and count successes on releases that no search has seen."""
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


def _target_row(
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


def searches(quick: bool, progress: Progress) -> Measurement:
    """Let every search design for the same targets of six components, fed forward.

    They are held against proven optima by energy, and compared in releases that they need.
    """
    scene = load_scene("design")
    words = folded_words(scene.n)[:: 26 // WORDS][: QUICK_WORDS if quick else WORDS]
    design(words[0], scene, runs=0)  # compiles, and compares all sequences once for all
    rows: list[Row] = []
    bounds: dict[tuple[str, str], float] = {}
    cases = [(*kind, word) for kind, word in product(SEARCHES, words)]
    for (objective, search, word), _ in tables.each_case(progress, cases, ", ".join):
        kinds: dict[str, Any] = {"objective": objective, "search": search}
        begun = time.process_time()
        found = design(word, scene, runs=0, workers=1, **kinds)
        taken = time.process_time() - begun
        score = found.score
        if objective == "probability":
            score = success_rate(found, 10 if quick else RUNS)
        if search == "exhaustive" and found.bound is not None:
            bounds[objective, word] = found.bound
        bound = bounds.get((objective, word))
        rows.append(
            {
                "objective": found.objective,
                "search": found.search,
                "target": word,
                "score": score if score is not None else 0.0,
                "of the optimum": score / bound if score is not None and bound else "",
                "releases": found.calls.get("releases", 0),
                "time [s]": taken,
            }
        )
    shown: list[Row] = []
    for objective, search in SEARCHES:
        mine = tables.select(rows, objective=objective, search=search)
        of_best = [float(row["of the optimum"]) for row in mine if row["of the optimum"] != ""]
        mean = f"{tables.numbers(mine, 'score').mean():.1%}" if objective == "probability" else ""
        shown.append(
            {
                "objective": objective,
                "search": search,
                "targets": len(mine),
                "of the optimum": f"{min(of_best):.2f}–{max(of_best):.2f}" if of_best else "",
                "success, mean": mean,
                "releases": int(median(mine, "releases")),
                "time [s]": f"{median(mine, 'time [s]'):.2g}",
            }
        )
    return Measurement(rows, [Table("searches, medians over targets", shown)])


def lengths(quick: bool, progress: Progress) -> Measurement:
    """Design for targets of the suites, the modes in turn, with one worker."""
    counts = QUICK_SUITES if quick else SUITES
    total = sum(counts.values())
    rows: list[Row] = []
    modes: tuple[Mode, ...] = get_args(Mode)
    for n, count in counts.items():
        words = suite_words(n)
        scene = load_scene(default_scene(n))
        design(words[0], scene, objective="ground", runs=0)  # compiles
        for k, word in enumerate(words[:count]):
            mode = modes[k % len(modes)]
            progress(len(rows) / total, f"{word}, {mode}")
            begun = time.process_time()
            found = design(word, scene, mode, runs=0, workers=1)
            taken = time.process_time() - begun
            rows.append(
                {
                    "components": n,
                    "target": word,
                    "mode": mode,
                    "success": success_rate(found, SUITE_RUNS),
                    "releases": found.calls["releases"],
                    "time [s]": taken,
                }
            )
    shown: list[Row] = []
    findings: list[str] = []
    for n in counts:
        mine = tables.select(rows, components=n)
        times, success = tables.numbers(mine, "time [s]"), tables.numbers(mine, "success")
        shown.append(
            {
                "components": n,
                "targets": len(mine),
                "solved": int((success >= WANTED).sum()),
                "success, mean": f"{success.mean():.1%}",
                "releases, median": int(median(mine, "releases")),
                "time, median [s]": f"{median(mine, 'time [s]'):.3g}",
                "time, longest [s]": f"{times.max():.3g}",
            }
        )
        if n == LIMITED:
            solved = int(((success >= WANTED) & (times <= LIMIT)).sum())
            findings.append(
                f"{solved} of {len(mine)} targets of {n} components solved within "
                f"{LIMIT:.0f} s of one core each (success at least {WANTED:.0%} of {SUITE_RUNS} "
                "releases of their own)"
            )
    return Measurement(rows, [Table("targets of the suites", shown)], findings)


def friction(quick: bool, progress: Progress) -> Measurement:
    """Feed designs forward over floors of different friction; a design is made without a floor.

    It is why the suites of longer chains have less of it.
    """
    scene = load_scene("design-long")
    rng = np.random.default_rng(0)
    rows: list[Row] = []
    table: list[Row] = []
    cases = QUICK_LENGTHS if quick else LENGTHS
    for n, tick in tables.each_case(progress, cases, lambda n: f"{n} components"):
        words = rng.choice(folded_words(n), 2 if quick else FRICTION_WORDS, replace=False).tolist()
        longer = release(scene.replace(sequence=("NNNN",) * n), "forward")
        sequences = [
            anneal_sequence(longer, word, rng, Counter(), stable=True).sequence for word in words
        ]
        line: Row = {"components": n}
        for m, value in enumerate(FRICTIONS):
            tick(m / len(FRICTIONS))
            floor = longer.replace(friction=value)
            hits = [
                ensemble(Choice(sequence, FRICTION_SPEED).applied(floor), FRICTION_RUNS)
                .probability(word, "folded")
                .successes
                for word, sequence in zip(words, sequences, strict=True)
            ]
            rate = sum(hits) / (len(words) * FRICTION_RUNS)
            rows.append({"components": n, "friction": value, "success": rate})
            line[f"friction {value}"] = f"{rate:.0%}"
        table.append(line)
    title = f"successes of {FRICTION_WORDS} targets × {FRICTION_RUNS} releases, "
    return Measurement(rows, [Table(f"{title}fed forward at {FRICTION_SPEED} m/s", table)])
