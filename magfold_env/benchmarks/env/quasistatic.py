"""Steps a second without dynamics, on one core: random actions, beginning anew included."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from magfold_env.benchmarks.env.players import ENVS, TUBE_FEED, stepping
from magfold_env.benchmarks.env.rates import rate_cells, verdict
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.reporting.timing import Task, take_turns

NAME = "quasistatic"
FORMS = {"single": None, f"vector of {ENVS}": ENVS}
SHAPINGS = {"none": False, "similarity": "similarity"}
WANTED = 20_000.0  # steps a second
SEED = 5


@dataclass(frozen=True)
class Effort:
    """How much work a run of the benchmark may be."""

    steps: int
    """Of a sample, in all environments."""
    rounds: int

    @classmethod
    def of(cls, quick: bool) -> Effort:
        """Return the effort of a quick or a full run."""
        return cls(10 * ENVS, 3) if quick else cls(100 * ENVS, 15)


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every form, with and without shaping."""
    effort = Effort.of(quick)
    ways = list(product(FORMS, SHAPINGS))
    tasks = {f"{form} {shaping}": _task(form, shaping, effort.steps) for form, shaping in ways}
    times = take_turns(tasks, effort.rounds, 0.0, tick=lambda share: progress(share, "steps"))
    rows: list[Row] = []
    for form, shaping in ways:
        row: Row = {"form": form, "shaping": shaping}
        mine = times[f"{form} {shaping}"]
        price: Row = {"µs a step": 1e6 * mine.median / effort.steps}
        rows.append(row | rate_cells("steps", mine, effort.steps) | price)
    findings = [
        f"{row['form']}, shaping {row['shaping']}: {float(row['steps/s']):,.0f} steps/s on one "
        f"core; {verdict(float(row['steps/s']), WANTED)}"
        for row in rows
    ]
    title = "Quasistatic tube-feed steps a second on one core, n = 6"
    return Measurement(NAME, rows, [Table(title, rows)], findings)


def _task(form: str, shaping: str, steps: int) -> Task:
    options = {"fidelity": "quasistatic", "shaping": SHAPINGS[shaping]}
    return stepping(TUBE_FEED, FORMS[form], steps, SEED, **options)
