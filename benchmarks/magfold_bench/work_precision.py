"""Run time against error of whole folds, by solver tolerance, accuracy of magnets and time step.

Ten named scenes are each run from several starts with every setting. A setting's error is its
median error over the starts, and its time is the mean. Errors are those of joint angles, relative
to a far more exact run of the same scene. Starts are set aside if a nudge of 1e-6 rad changes their
outcome, or if their reference has not converged. The paper's solver runs only the pinned scenes. It
stops joints in its own way, so its error does not vanish with its step. The preparation of sessions
is not timed.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from magfold_bench import runs, tables, timing
from magfold_bench.laws.outcomes import moved_start
from magfold_bench.presentation import Lines
from magfold_bench.runs import CLOSE, NUDGE, Setting, has_accuracy, recorded
from magfold_bench.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.engine.state import Array
from magfold_env.fold import Fold
from magfold_env.scene import Magnets, Scene, Solver, load_scene

ALLOWED = 1.5  # relative to the run time of the fastest equally exact setting
WAY, END = "error on the way [rad]", "final error [rad]"
BEHIND, SURELY, AT_END = "default / fastest", "without luck", "at the end"
COMPARED = {
    BEHIND: "on the way",
    SURELY: "on the way, without settings that are as exact only by luck",
    AT_END: "at the end",
}
"""Columns with the ratio of the default's time to that of the fastest equally exact setting; the
values state which errors and settings are compared."""
TABLES = {
    "The default: medians over starts": ("words right", "set aside", WAY, END, "ms"),
    "The default and the fastest setting that is as exact": ("fastest as exact", *COMPARED),
}
"""Columns of the tables, by title."""
SET_ASIDE = {
    "sensitive": f"a start moved by {NUDGE:g} rad ends elsewhere",
    "unsure": f"the reference is not known to {CLOSE:g} rad",
}

LONGEST = 1.0  # [s] simulated after the last release; most folds come to rest earlier
SWING = 0.3  # [s] of the pendulum, seven times √(d/g): longer swings are chaotic
SPREAD = 0.03  # [rad] of the start angles
LONG = 12  # number of components in the longest chain
PENDULUM = "pendulum of three"
LOOSER = 10.0


class Effort(NamedTuple):
    """How much a run of the benchmark measures."""

    starts: int
    tolerances: tuple[float, ...]
    accuracies: tuple[float, ...]
    time_steps: tuple[float, ...]  # of the paper's solver [s]; the paper used 1/1200
    reference: tuple[float, float]  # tolerance [rad], and accuracy of the magnets
    rounds: int  # number of samples per timing


QUICK = Effort(1, (1e-3, 1e-4), (1e-2, 1e-3), (1 / 1200,), (1e-6, 1e-6), 3)
FULL = Effort(
    5,
    tuple(10.0**-k for k in range(2, 7)),
    (1e-2, 1e-3, 1e-4, 1e-5),
    tuple(1.0 / (300 * 4**k) for k in range(5)),
    (1e-7, 1e-6),
    5,
)


def named_scenes() -> dict[str, Scene]:
    """Return typical users' scenes, with every mount and the solver's default settings.

    Their start angles are not yet drawn.
    """
    one, two, three = (load_scene(f"paper/sequence-{k}") for k in (1, 2, 3))
    scenes = {
        "sequence 1, free": one,
        "sequence 2, frictionless": two.replace(friction=0.0),
        "sequence 3, free": three,
        "sequence 3, fed backward": three.replace(mount="tube", feed={"direction": "backward"}),
        "tube-feed": load_scene("tube-feed"),
        "anchor": load_scene("anchor"),
        f"{LONG} components": one.replace(
            sequence=one.sequence * (LONG // one.n),
            mount="tube",
            feed={"speed": 0.2},
            friction=0.1,
        ),
        "sequence 3, pinned": three.replace(mount="pinned"),
        "sequence 3, literal": load_scene("paper/sequence-3-literal"),
        PENDULUM: load_scene("pendulum-3"),
    }
    for name, scene in scenes.items():
        duration = SWING if name == PENDULUM else LONGEST
        plain = scene.replace(duration=duration, solver=Solver(), start_angle_spread=SPREAD)
        if has_accuracy(plain):
            plain = plain.replace(magnets={"accuracy": Magnets().accuracy})
        scenes[name] = plain
    return scenes


def settings_of(scene: Scene, effort: Effort) -> list[Setting]:
    """Return all settings that a scene allows; the paper's solver needs a pinned chain."""
    chosen = effort.accuracies if has_accuracy(scene) else (None,)
    found = [Setting("adaptive", t, accuracy) for accuracy in chosen for t in effort.tolerances]
    if scene.mount == "pinned":
        found += [Setting("paper", h, accuracy) for accuracy in chosen for h in effort.time_steps]
    return found


class Reference(NamedTuple):
    """The reference run of a drawn scene, and its accuracy."""

    scene: Scene
    fold: Fold
    known: float  # largest change at any time with ten times looser settings [rad]
    sensitivity: float  # largest change at any time if the start moves by `NUDGE` [rad]

    @property
    def sensitive(self) -> bool:
        """Whether small changes to the scene, rather than the setting, decide the result."""
        return self.sensitivity > CLOSE

    @property
    def unsure(self) -> bool:
        """Whether the reference is too inaccurate for a comparison."""
        return self.known > CLOSE

    def error_on_the_way(self, run: Fold) -> float:
        """Return a joint's largest error at any time [rad], or the reference's own if larger."""
        return max(runs.difference(run, self.fold), self.known, NUDGE)


def reference(scene: Scene, tolerance: float, accuracy: float) -> Reference:
    """Run a drawn scene as the reference, and twice more to measure the reference's accuracy."""
    tight, looser = (
        Setting("adaptive", k * tolerance, k * accuracy if has_accuracy(scene) else None)
        for k in (1.0, LOOSER)
    )
    exact, second = recorded(tight.on(scene)), recorded(looser.on(scene))
    size = scene.n + 1 if scene.mount == "tube" else scene.n - 1
    nudged = moved_start(scene, np.where(np.arange(size) % 2, -NUDGE, NUDGE))
    moved = recorded(looser.on(nudged))
    return Reference(scene, exact, runs.difference(second, exact), runs.difference(moved, second))


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every named scene with every setting."""
    found = Measurement()
    shown: list[Row] = []
    scenes = list(named_scenes().items())
    for (name, scene), tick in tables.each_case(progress, scenes, lambda case: case[0]):
        rows, summary = measure(name, scene, QUICK if quick else FULL, tick)
        found.rows.extend(rows)
        shown.append(summary)
    for title, columns in TABLES.items():
        cells: list[Row] = [{name: row[name] for name in ("scene", *columns)} for row in shown]
        found.tables.append(Table(title, cells))
    found.findings.extend(_findings(shown, found.rows))
    return found


def measure(name: str, scene: Scene, effort: Effort, tick: Tick) -> tuple[list[Row], Row]:
    """Return a row for every setting of a scene, and a summary row."""
    starts = [scene.draw(np.random.default_rng(seed)) for seed in range(effort.starts)]
    known = [reference(start, *effort.reference) for start in starts]
    clear = [each for each in known if not (each.sensitive or each.unsure)] or known
    tick(0.3)
    settings = settings_of(scene, effort)
    found = {setting: _errors(setting, clear) for setting in settings}
    tick(0.6)
    tasks = {
        setting: runs.run_task(*(setting.on(each.scene) for each in clear)) for setting in settings
    }
    taken = timing.take_turns(tasks, effort.rounds, 0.0, tick=lambda share: tick(0.6 + 0.4 * share))
    rows = [
        {
            "scene": name,
            "setting": str(setting),
            "method": setting.method,
            "line": f"{setting.method}, magnets {setting.accuracy or 'as given'}",
            "step": setting.step,
            "magnets": setting.accuracy or 0.0,
            "default": int(setting.is_default),
            **found[setting],
            **time.spread.time_cells("ms", 1e3 / len(clear)),
            "starts": len(clear),
            "sensitive": sum(each.sensitive for each in known),
            "unsure": sum(each.unsure and not each.sensitive for each in known),
            "reference known to [rad]": max(each.known for each in clear),
            "nudge grows to [rad]": max(each.sensitivity for each in known),
        }
        for setting, time in taken.items()
    ]
    return rows, _summary(rows, settings, list(taken.values()))


def _errors(setting: Setting, references: Sequence[Reference]) -> Row:
    """Return a setting's errors over the starts, and its number of correct words."""
    folds = [recorded(setting.on(each.scene)) for each in references]
    pairs = list(zip(folds, references, strict=True))
    way = [each.error_on_the_way(run) for run, each in pairs]
    end = [max(runs.final_difference(run, each.fold), NUDGE) for run, each in pairs]
    return {
        WAY: float(np.median(way)),
        END: float(np.median(end)),
        f"worst {WAY}": max(way),
        f"worst {END}": max(end),
        "words right": sum(run.word == each.fold.word for run, each in pairs),
        "evaluations": sum(run.evaluations for run in folds),
    }


def _summary(rows: list[Row], settings: Sequence[Setting], times: Sequence[timing.Timing]) -> Row:
    """Return the default's errors and time, and its ratio to the time of the fastest setting."""
    medians = np.array([time.median for time in times])
    default = next(k for k, setting in enumerate(settings) if setting.is_default)
    way, end = tables.numbers(rows, WAY), tables.numbers(rows, END)
    best = fastest(medians, way, way[default])
    first = rows[0]

    def behind(errors: Array) -> float:
        return float(medians[default] / medians[fastest(medians, errors, errors[default])])

    return {
        "scene": first["scene"],
        "words right": f"{rows[default]['words right']} of {first['starts']}",
        "set aside": int(first["sensitive"]) + int(first["unsure"]),
        WAY: way[default],
        END: end[default],
        "ms": float(rows[default]["time [ms]"]),
        "fastest as exact": str(settings[best]),
        BEHIND: f"{timing.ratio(times[default], times[best])}",
        SURELY: behind(without_luck(settings, way)),
        AT_END: behind(end),
    }


def fastest(times: Array, errors: Array, error: float) -> int:
    """Return the index of the fastest setting whose error is at most `error`."""
    return int(np.argmin(np.where(errors <= error, times, np.inf)))


def without_luck(settings: Sequence[Setting], errors: Array) -> Array:
    """Return, for each setting, the largest error among all settings at least as tight.

    Errors do not fall steadily: a loose setting may be accurate by chance where tighter ones fail.
    """
    return np.array(
        [
            max(e for other, e in zip(settings, errors, strict=True) if other.as_tight(one))
            for one in settings
        ]
    )


def _findings(shown: list[Row], rows: list[Row]) -> list[str]:
    found: list[str] = []
    for heading, what in COMPARED.items():
        behind = {str(row["scene"]): float(str(row[heading]).split()[0]) for row in shown}
        late = [f"{name} ({value:.2f})" for name, value in behind.items() if value > ALLOWED]
        said = f"{tables.verdict(False)} in {', '.join(late)}" if late else tables.verdict(True)
        found.append(
            f"{what}: the default takes at most {ALLOWED:g} times as long as the fastest setting "
            f"that is as exact in {len(behind) - len(late)} of {len(behind)} scenes: {said}"
        )
    for word, why in SET_ASIDE.items():
        count = {str(row["scene"]): int(row[word]) for row in rows}
        where = ", ".join(f"{name} {k}" for name, k in count.items() if k)
        found.append(f"starts set aside because {why}: {where or 'none'}")
    by_paper = tables.select(rows, method="paper")
    for scene in tables.distinct(by_paper, "scene"):
        best = min(tables.select(by_paper, scene=scene), key=lambda row: float(row[WAY]))
        found.append(
            f"{scene}: the paper's solver comes within {float(best[WAY]):.2g} rad on the way, in "
            f"{float(best['time [ms]']):.3g} ms ({best['setting']})"
        )
    return found


DIAGRAM = Lines(
    "Whole folds: largest error of a joint at any time against run time",
    "time [ms]",
    WAY,
    "line",
    ("scene",),
    star="default",
    shared=False,
)
