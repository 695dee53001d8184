"""The paper's experiment: 100 free folds, 50 forward and 50 backward feeds of each sequence.

The chains are released as if by hand: start angles, friction, masses, magnets and feed vary.
"""

from typing import Any, Literal

from magfold_bench.tables import Measurement, Progress, Row, Table, each_case
from magfold_env.ensembles.releases import PREDICTORS, Bar, bars, ensemble, predictions, release
from magfold_env.minimiser import Mode
from magfold_env.scene import Scene, Spreads, load_scene

MODES: tuple[Mode, ...] = ("free", "forward", "backward")
SEQUENCES = (1, 2, 3)
COMPONENTS = 6

SPEED = 0.05
"""Assumed feed speed [m/s]; in the paper, chains are fed by hand at a constant speed."""

SPREADS = Spreads(
    friction=0.2, mass=0.05, remanence=0.05, feed_speed=0.3, feed_jitter=0.2, magnet=0.05
)
"""Assumed variation between releases by hand; the paper gives no numbers."""

ANGLE = 0.1
"""Assumed half-width of the range of joint angles at release [rad].

The paper's chain starts 3 mm from its model, on average, because its hinges are strings.
"""


def by_hand(scene: Scene, mode: Mode, speed: float = SPEED) -> Scene:
    """Return a scene for releases by hand in one of the modes."""
    varied = scene.replace(spreads=SPREADS, start_angle_spread=ANGLE, start_angles=None)
    return release(varied, mode, speed)


Kind = Literal["", "-strong"]
"""Suffix of a paper scene's name: none for the device as given, or one for strong magnets."""


def paper_scene(sequence: int, mode: Mode, kind: Kind = "") -> Scene:
    """Return the scene of one of the paper's sequences, released by hand."""
    return by_hand(load_scene(f"paper/sequence-{sequence}{kind}"), mode)


RUNS: dict[Mode, int] = {"free": 100, "forward": 50, "backward": 50}
QUICK_RUNS = 4

# How the paper describes the outcomes of its experiment, with its names for the shapes.
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


def run(quick: bool, progress: Progress, kind: Kind = "") -> Measurement:
    """Release the paper's sequences as in the experiment, and count the outcomes."""
    rows: list[Row] = []
    table: list[Row] = []
    cases: list[tuple[int, Mode]] = [(sequence, mode) for sequence in SEQUENCES for mode in MODES]
    for (sequence, mode), _ in each_case(progress, cases, lambda c: f"sequence {c[0]}, {c[1]}"):
        scene = paper_scene(sequence, mode, kind)
        made = ensemble(scene, QUICK_RUNS if quick else RUNS[mode])
        found = bars(made)
        rows += [
            {
                "sequence": sequence,
                "mode": mode,
                "runs": len(made),
                "word": bar.word,
                "status": bar.status,
                "probability": bar.rate,
                "low": bar.low,
                "high": bar.high,
                "joint angles (rad)": " ".join(f"{angle:.6f}" for angle in bar.joints),
            }
            for bar in found
        ]
        said = (predictions(scene)[PREDICTORS[mode]], PAPER[sequence, mode])
        case = (str(sequence), f"{len(made)} {mode}")
        for bar in found:
            cells = (*case, f"{bar.rate:.0%}", bar.word, bar.status, *said)
            table.append(dict(zip(_COLUMNS, cells, strict=True)))
            case, said = ("", ""), ("", "")
    return Measurement(rows, [Table("The paper's experiment, simulated", table)])


def draw_experiment(rows: list[Row]) -> Any:
    """Draw the nine ensembles as bars, one row per sequence, like the paper's Figure 18."""
    from magfold_env.render.charts import bar_chart  # noqa: PLC0415 - an extra

    panels: dict[str, list[Bar]] = {}
    for row in rows:
        name = f"sequence {row['sequence']}, {row['mode']}: {row['runs']} releases"
        joints = tuple(float(angle) for angle in str(row["joint angles (rad)"]).split())
        rate, low, high = (float(row[name]) for name in ("probability", "low", "high"))
        bar = Bar(str(row["word"]), str(row["status"]), rate, low, high, joints)
        panels.setdefault(name, []).append(bar)
    return bar_chart(panels)
