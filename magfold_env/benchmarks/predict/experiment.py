"""The paper's experiment: 100 free folds, 50 forward and 50 backward feeds of each sequence."""

from __future__ import annotations

from magfold_env.benchmarks.predict.scenes import MODES, SEQUENCES, paper_scene
from magfold_env.ensembles import ensemble
from magfold_env.ensembles.bars import Bar, bars
from magfold_env.ensembles.predictions import PREDICTORS, predictions
from magfold_env.minimiser import Mode
from magfold_env.reporting.part import Part, Progress, Row, Table

RUNS: dict[Mode, int] = {"free": 100, "forward": 50, "backward": 50}
QUICK_RUNS = 4

# What the paper says of its experiment, in words and in its names for the shapes.
_LEAST = "least lateral movement, not the global minimum"
_ONLY = "S3A (LRLLL) or a misfold"
PAPER: dict[tuple[int, Mode], str] = {
    (1, "free"): _LEAST,
    (1, "forward"): _LEAST,
    (1, "backward"): "S1A and S1C about equally often",
    (2, "free"): "S2B (LRLRL), not the global minimum",
    (2, "forward"): "S2B (LRLRL), not the global minimum",
    (2, "backward"): "several shapes about equally often",
    (3, "free"): _ONLY,
    (3, "forward"): _ONLY,
    (3, "backward"): _ONLY,
}

_COLUMNS = ("sequence", "releases", "share", "word", "status", "minimiser", "in the paper")


def run(quick: bool, progress: Progress) -> Part:
    """Release the paper's sequences as it did, and count where they end."""
    rows: list[Row] = []
    table: list[Row] = []
    cases: list[tuple[int, Mode]] = [(sequence, mode) for sequence in SEQUENCES for mode in MODES]
    for k, (sequence, mode) in enumerate(cases):
        progress(k / len(cases), f"sequence {sequence}, {mode}")
        scene = paper_scene(sequence, mode)
        made = ensemble(scene, QUICK_RUNS if quick else RUNS[mode])
        found = bars(made)
        rows += [_row(sequence, mode, len(made), bar) for bar in found]
        said = (predictions(scene)[PREDICTORS[mode]], PAPER[sequence, mode])
        case = (str(sequence), f"{len(made)} {mode}")
        for bar in found:
            cells = (*case, f"{bar.rate:.0%}", bar.word, bar.status, *said)
            table.append(dict(zip(_COLUMNS, cells, strict=True)))
            case, said = ("", ""), ("", "")
    return Part("experiment", rows, [Table("The paper's experiment, simulated", table)])


def bar_of(row: Row) -> Bar:
    """Return the bar that a row was made of."""
    joints = tuple(float(angle) for angle in str(row["joint angles (rad)"]).split())
    rate, low, high = (float(row[name]) for name in ("probability", "low", "high"))
    return Bar(str(row["word"]), str(row["status"]), rate, low, high, joints)


def _row(sequence: int, mode: Mode, runs: int, bar: Bar) -> Row:
    return {
        "sequence": sequence,
        "mode": mode,
        "runs": runs,
        "word": bar.word,
        "status": bar.status,
        "probability": bar.rate,
        "low": bar.low,
        "high": bar.high,
        "joint angles (rad)": " ".join(f"{angle:.6f}" for angle in bar.joints),
    }
