"""Run time against error of whole folds: solver tolerance × accuracy of the magnets × time step.

Ten named scenes are each run from several starts at every setting. A setting's error is its median
over the starts, its time their mean. Errors are of the joints' angles, against the same scene run
far more exactly (`motions`). Starts whose outcome a nudge of 1e-6 rad decides are set aside, and
those whose reference has not converged.
The paper's solver runs the pinned scenes. It stops joints in its own way, so that its error does
not vanish with its step. Sessions are prepared untimed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from magfold_env.benchmarks.dynamics.contact_scenes import CLOSE, NUDGE
from magfold_env.benchmarks.dynamics.features import finish
from magfold_env.benchmarks.whole.front import fastest, front, without_luck
from magfold_env.benchmarks.whole.motions import Reference, recorded, reference
from magfold_env.benchmarks.whole.scenes import drawn, named_scenes
from magfold_env.benchmarks.whole.settings import Setting, settings_of
from magfold_env.engine.state import Array
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick, begin_case
from magfold_env.reporting.timing import Task, Timing, ratio, take_turns
from magfold_env.scene import Scene
from magfold_env.simulation.session import Session

NAME = "work-precision"
ALLOWED = 1.5  # times the front's run time that the default may take
WAY, END = "error on the way [rad]", "final error [rad]"
BEHIND, SURELY, AT_END = "default / fastest", "without luck", "at the end"
JUDGED = {
    BEHIND: "on the way",
    SURELY: "on the way, settings that are as exact by luck alone left out",
    AT_END: "at the end",
}
"""Columns that tell how many times longer the default takes than what is as exact, and where."""
TABLES = {
    "The default: medians over starts": ("words right", "set aside", WAY, END, "ms"),
    "The default beside the fastest setting that is as exact": (
        "fastest as exact",
        *JUDGED,
    ),
}
"""Columns of the tables, by title."""
SET_ASIDE = {
    "sensitive": f"a start moved by {NUDGE:g} rad ends elsewhere",
    "unsure": f"the reference is not known to {CLOSE:g} rad",
}
FRONT = {WAY: "on the front on the way", END: "on the front at the end"}


@dataclass(frozen=True)
class Effort:
    """How much work a run of the benchmark may be."""

    starts: int
    tolerances: tuple[float, ...]
    accuracies: tuple[float, ...]
    time_steps: tuple[float, ...]
    """Of the paper's solver [s]; the paper's own is 1/1200."""
    reference: tuple[float, float]
    """Tolerance [rad] and accuracy of the magnets."""
    rounds: int
    """Samples of every timing."""

    @classmethod
    def of(cls, quick: bool) -> Effort:
        """Return the effort of a quick or a full run."""
        steps = tuple(1.0 / (300 * 4**k) for k in range(5))
        if quick:
            return cls(1, (1e-3, 1e-4), (1e-2, 1e-3), steps[1:2], (1e-6, 1e-6), 3)
        tolerances = tuple(10.0**-k for k in range(2, 7))
        return cls(5, tolerances, (1e-2, 1e-3, 1e-4, 1e-5), steps, (1e-7, 1e-6), 5)


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every scene."""
    effort = Effort.of(quick)
    scenes = named_scenes()
    part = Measurement(NAME, [])
    shown: list[Row] = []
    for k, (name, scene) in enumerate(scenes.items()):
        rows, summary = measure(name, scene, effort, begin_case(progress, k, len(scenes), name))
        part.rows.extend(rows)
        shown.append(summary)
    for title, columns in TABLES.items():
        cells: list[Row] = [{name: row[name] for name in ("scene", *columns)} for row in shown]
        part.tables.append(Table(title, cells))
    part.findings.extend(_findings(shown, part.rows))
    return part


def measure(name: str, scene: Scene, effort: Effort, tick: Tick) -> tuple[list[Row], Row]:
    """Return a row for every setting of a scene, and what is to be read of them."""
    references = [reference(drawn(scene, seed), *effort.reference) for seed in range(effort.starts)]
    clear = [each for each in references if not (each.sensitive or each.unsure)] or references
    tick(0.3)
    settings = settings_of(scene, effort.tolerances, effort.accuracies, effort.time_steps)
    found = {setting: _errors(setting, clear) for setting in settings}
    tick(0.6)
    tasks = {str(setting): _task(setting, clear) for setting in settings}
    taken = take_turns(tasks, effort.rounds, 0.0, tick=lambda share: tick(0.6 + 0.4 * share))
    times = [taken[str(setting)] for setting in settings]
    rows = [
        {
            "scene": name,
            "setting": str(setting),
            "method": setting.method,
            "step": setting.step,
            "magnets": setting.accuracy or 0.0,
            "default": int(setting.is_default),
            **found[setting],
            **time.spread.time_cells("ms", 1e3 / len(clear)),
            "starts": len(clear),
            "sensitive": sum(each.sensitive for each in references),
            "unsure": sum(each.unsure and not each.sensitive for each in references),
            "reference known to [rad]": max(each.known for each in clear),
            "nudge grows to [rad]": max(each.sensitivity for each in references),
        }
        for setting, time in zip(settings, times, strict=True)
    ]
    medians = np.array([time.median for time in times])
    for error, flag in FRONT.items():
        marked = front(medians, column(rows, error))
        for k, row in enumerate(rows):
            row[flag] = int(k in marked)
    return rows, _summary(rows, settings, times)


def column(rows: Sequence[Row], name: str) -> Array:
    """Return a column of numbers."""
    return np.array([float(row[name]) for row in rows])


def _errors(setting: Setting, references: Sequence[Reference]) -> Row:
    """Return a setting's errors over the starts, and how many words it gets right."""
    runs = [recorded(setting.on(each.scene)) for each in references]
    pairs = list(zip(runs, references, strict=True))
    way = [each.error_on_the_way(run) for run, each in pairs]
    end = [each.final_error(run) for run, each in pairs]
    return {
        WAY: float(np.median(way)),
        END: float(np.median(end)),
        f"worst {WAY}": max(way),
        f"worst {END}": max(end),
        "words right": sum(run.word == each.fold.word for run, each in pairs),
        "evaluations": sum(run.evaluations for run in runs),
    }


def _task(setting: Setting, references: Sequence[Reference]) -> Task:
    """Return the runs of a setting from all starts, one after another, as something to time."""
    scenes = [setting.on(each.scene) for each in references]

    def prepare() -> Callable[[], None]:
        sessions = [Session(scene) for scene in scenes]

        def call() -> None:
            for session in sessions:
                finish(session)

        return call

    return prepare


def _summary(rows: list[Row], settings: Sequence[Setting], times: Sequence[Timing]) -> Row:
    """Return the default's errors and time, and how many times the front's time that is."""
    medians = np.array([time.median for time in times])
    default = next(k for k, setting in enumerate(settings) if setting.is_default)
    way, end = column(rows, WAY), column(rows, END)
    sure = without_luck(settings, way)
    best = fastest(medians, way, way[default])
    spread = ratio(times[default], times[best])
    first = rows[0]
    return {
        "scene": first["scene"],
        "words right": f"{rows[default]['words right']} of {first['starts']}",
        "set aside": int(first["sensitive"]) + int(first["unsure"]),
        WAY: way[default],
        END: end[default],
        "ms": float(rows[default]["time [ms]"]),
        "fastest as exact": str(settings[best]),
        BEHIND: f"{spread}",
        SURELY: _behind(medians, sure, default),
        AT_END: _behind(medians, end, default),
    }


def _behind(times: Array, errors: Array, default: int) -> float:
    """Return the default's time over that of the fastest setting that is as exact."""
    return float(times[default] / times[fastest(times, errors, errors[default])])


def _findings(shown: list[Row], rows: list[Row]) -> list[str]:
    found: list[str] = []
    for heading, what in JUDGED.items():
        behind = {str(row["scene"]): float(str(row[heading]).split()[0]) for row in shown}
        late = [f"{name} ({value:.2f})" for name, value in behind.items() if value > ALLOWED]
        said = f"FAILS in {', '.join(late)}" if late else "holds"
        found.append(
            f"{what}: the default takes at most {ALLOWED:g} times as long as the fastest setting "
            f"that is as exact in {len(behind) - len(late)} of {len(behind)} scenes: {said}"
        )
    for word, why in SET_ASIDE.items():
        count = {str(row["scene"]): int(row[word]) for row in rows}
        where = ", ".join(f"{name} {k}" for name, k in count.items() if k)
        found.append(f"starts set aside because {why}: {where or 'none'}")
    for scene in dict.fromkeys(str(row["scene"]) for row in rows if row["method"] == "paper"):
        mine = [row for row in rows if (row["scene"], row["method"]) == (scene, "paper")]
        best = min(mine, key=lambda row: float(row[WAY]))
        found.append(
            f"{scene}: the paper's solver comes within {float(best[WAY]):.2g} rad on the way, in "
            f"{float(best['time [ms]']):.3g} ms ({best['setting']})"
        )
    return found
