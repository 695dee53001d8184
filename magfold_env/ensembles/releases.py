"""Ensembles: many perturbed releases of a scene, and the probabilities of their outcomes.

Each run has its own draws. The runs use all cores.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, get_args

import numpy as np
import numpy.typing as npt

from magfold_env.checkpoint import Checkpoint
from magfold_env.files import physics_digest, reading_json, write_json
from magfold_env.fold import Fold, FoldStatus
from magfold_env.minimiser import Mode, minimise
from magfold_env.parallel import Backend, Workers, finished
from magfold_env.reporting.intervals import Share, share
from magfold_env.reporting.notebook import NotebookDisplay, chain_svg, short_table
from magfold_env.reporting.page import Block
from magfold_env.reporting.tables import Columns, Row
from magfold_env.scene import Scene, errors, unless_a_scene
from magfold_env.scene.base import by_key
from magfold_env.shapes import FloatArray, headings, parse_word, word_to_angles
from magfold_env.simulation.simulate import simulate

Texts = npt.NDArray[np.str_]

K = TypeVar("K")

FORMAT = "magfold_env ensemble 1"

MOST_RUNS = 10_000_000
"""Largest number of runs, which are all kept in memory."""

_SIDE_BY_SIDE = 8  # most scenes in a batch: half the number of geometries with cached tables
MOST_SHOWN = 3  # outcomes shown in one line


class Shares(dict[K, Share]):
    """A dictionary of shares; as in a `Counter`, a key that did not occur has a share of 0.

    Parameters
    ----------
    shares
        The shares of the keys that occurred.
    missing
        A function that returns the share of any other key, or raises an error.
    """

    def __init__(self, shares: Mapping[K, Share], missing: Callable[[K], Share]) -> None:
        super().__init__(shares)
        self._missing = missing

    def __missing__(self, key: K) -> Share:
        """Return the share of a key that did not occur."""
        return self._missing(key)


class Run(NamedTuple):
    """The stored values of a fold."""

    number: int
    """Index of the run in its ensemble, or among the runs of several ensembles; see `released`."""
    word: str
    """Nearest fold word."""
    status: str
    """Status of the fold; see `FoldStatus`."""
    energy: float
    """Magnetic energy at the end [J]."""
    time: float
    """Simulated time [s]."""
    angles: tuple[float, ...]
    """Absolute headings at the end [rad], component 1 first."""

    def to_record(self) -> list[Any]:
        """Return the run as JSON values; numbers that are not finite become None."""
        finite = [x if math.isfinite(x) else None for x in (self.energy, self.time, *self.angles)]
        return [self.number, self.word, self.status, *finite]

    @classmethod
    def from_record(cls, record: list[Any], n: int) -> Run:
        """Return the run of n components that `to_record` wrote, or raise a ValueError."""
        number, word, status, *values = record
        energy, time, *angles = (math.nan if x is None else float(x) for x in values)
        if not isinstance(number, int) or number < 0 or len(angles) != n:
            raise ValueError(f"a run of {n} components is not {record!r}")
        return cls(number, parse_word(word), FoldStatus(status).value, energy, time, tuple(angles))


def generator(seed: int, index: int) -> np.random.Generator:
    """Return the random generator of run `index` of an ensemble.

    Its seed is ``SeedSequence(seed).spawn(runs)[index]``, which does not depend on the number or
    the order of the runs.
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(index,)))


def run_one(seed: int, count: int, task: tuple[int, Scene]) -> Run:
    """Simulate one run; ``task`` is its number among the runs of ``count`` scenes and its scene."""
    number, scene = task
    fold = simulate(scene, generator(seed, number // count))
    angles = tuple(fold.angles.tolist())
    return Run(number, fold.word, fold.status.value, fold.energy, fold.time, angles)


@dataclass(frozen=True, eq=False, repr=False)
class Ensemble(Columns, NotebookDisplay):
    """Results of many releases of one scene, in columns with one entry per run, and probabilities.

    Each probability has its own Wilson interval at 95 %.
    """

    scene: Scene
    """The scene before its draws."""
    seed: int
    """Seed of the draws; run i uses ``generator(i)``."""
    word: Texts
    """Nearest fold word, shape (runs,)."""
    status: Texts
    """Status at the end, as the text of a `FoldStatus`, shape (runs,)."""
    energy: FloatArray
    """Magnetic energy at the end [J], shape (runs,)."""
    time: FloatArray
    """Simulated time [s], shape (runs,)."""
    angles: FloatArray
    """Absolute headings at the end [rad], component 1 first, shape (runs, n)."""

    @classmethod
    def of(cls, scene: Scene, seed: int, runs: Sequence[Run]) -> Ensemble:
        """Return the ensemble of runs that are given in order."""
        return cls(
            scene,
            seed,
            word=np.array([run.word for run in runs], dtype=np.str_),
            status=np.array([run.status for run in runs], dtype=np.str_),
            energy=np.array([run.energy for run in runs], dtype=np.float64),
            time=np.array([run.time for run in runs], dtype=np.float64),
            angles=np.array([run.angles for run in runs], dtype=np.float64).reshape(-1, scene.n),
        )

    def __len__(self) -> int:
        """Return the number of runs."""
        return len(self.word)

    def __repr__(self) -> str:
        """Return the most frequent outcomes, each with its share."""
        first = [f"{word} {status} {found}" for (word, status), found in self.outcomes.items()]
        more = f", … ({len(first) - MOST_SHOWN} more)" if len(first) > MOST_SHOWN else ""
        return f"<Ensemble, runs={len(self)}: {', '.join(first[:MOST_SHOWN])}{more}>"

    def _shown(self) -> list[Block]:
        rows: Iterator[Row] = (
            {"shape": chain_svg(headings(word_to_angles(str(row["word"])))), **row}
            for row in self.rows()
        )
        title = f"{len(self)} runs; drawn for each: {varied(self.scene)}"
        return [short_table(title, rows, len(self.outcomes))]

    # --- probabilities -----------------------------------------------------------------------

    @cached_property
    def words(self) -> Shares[str]:
        """The probability of every word that occurred, most frequent first; others have 0.

        A misfolded run also counts towards its nearest word; `outcomes` separates such runs.
        A key that is not a word of the chain raises a ValueError.
        """
        return Shares(_shares(self.word.tolist()), self.probability)

    @cached_property
    def statuses(self) -> Shares[FoldStatus]:
        """The probability of every status that occurred, most frequent first; others have 0."""
        found = _shares([FoldStatus(status) for status in self.status.tolist()])
        return Shares(found, partial(self.probability, None))

    @cached_property
    def outcomes(self) -> Shares[tuple[str, FoldStatus]]:
        """The probability of every pair of word and status that occurred, most frequent first.

        Other pairs have probability 0.
        """
        statuses = [FoldStatus(status) for status in self.status.tolist()]
        found = _shares(list(zip(self.word.tolist(), statuses, strict=True)))
        return Shares(found, lambda pair: self.probability(*pair))

    def probability(self, word: str | None = None, status: str | None = None) -> Share:
        """Return the probability of a word, of a status, or of both together.

        The probability of a word or status that did not occur is 0, with an interval.

        Raises
        ------
        ValueError
            If there is no such status, or the word is not one of the chain's.
        """
        hits = np.ones(len(self), dtype=np.bool_)
        if word is not None:
            if errors.unless_one_of("word", word, ("",)):  # the word of failed simulations
                parse_word(word, self.scene.n)
            hits &= self.word == word
        if status is not None:
            errors.refuse(errors.unless_one_of("status", status, FoldStatus))
            hits &= self.status == FoldStatus(status).value
        return share(int(hits.sum()), len(self))

    # --- single runs -------------------------------------------------------------------------

    def generator(self, index: int) -> np.random.Generator:
        """Return the generator of run `index`, with which `simulate` repeats the run.

        Raises
        ------
        ValueError
            If there is no such run.
        """
        errors.refuse(errors.unless_whole("index", index, -len(self), len(self) - 1))
        return generator(self.seed, range(len(self))[index])

    def replay(self, index: int, *, frame_rate: float | None = None) -> Fold:
        """Simulate run `index` again, with a trajectory if `frame_rate` [1/s] is given."""
        return simulate(self.scene, self.generator(index), frame_rate=frame_rate)

    # --- files -------------------------------------------------------------------------------

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Return the runs as columns of equal length, with the values that each run drew.

        Columns of drawn values are named by key, followed by the position in a list from 1:
        ``friction``, ``magnets.remanence_3_1``, ``start_angles_2``. Each call repeats the draws.
        """
        angles = {f"angle_{k + 1}": column for k, column in enumerate(self.angles.T)}
        return {
            "run": np.arange(len(self)),
            "word": self.word,
            "status": self.status,
            "energy": self.energy,
            "time": self.time,
            **angles,
            **self._drawn(),
        }

    def _drawn(self) -> dict[str, FloatArray]:
        """Return the numbers of the scene that draws change, by key, each with shape (runs,)."""
        stated = by_key(self.scene.model_dump())
        drawn = (self.scene.draw(self.generator(k)) for k in range(len(self)))
        runs = [by_key(scene.model_dump(exclude={"spreads"})) for scene in drawn]
        found = {key: [run[key] for run in runs] for key in runs[0]}
        return {
            key: np.array(values, dtype=np.float64)
            for key, values in found.items()
            if any(value != stated.get(key) for value in values)
        }

    def rows(self) -> list[Row]:
        """Return the outcomes as rows of a table, most frequent first."""
        return [outcome_row(*outcome, found) for outcome, found in self.outcomes.items()]

    def to_dict(self) -> dict[str, Any]:
        """Return the ensemble as JSON values; numbers that are not finite become None."""
        outcomes = [
            {"word": word, "status": status.value, **_plain(found)}
            for (word, status), found in self.outcomes.items()
        ]
        return {
            "format": FORMAT,
            "scene": self.scene.model_dump(mode="json"),
            "seed": self.seed,
            "words": {word: _plain(found) for word, found in self.words.items()},
            "statuses": {status.value: _plain(found) for status, found in self.statuses.items()},
            "outcomes": outcomes,
            "runs": [run.to_record() for run in self._runs()],
        }

    def to_json(self, path: str | Path) -> None:
        """Write the ensemble as JSON through a temporary file; `from_json` reads the file."""
        write_json(path, self.to_dict(), listed="runs")

    @classmethod
    def from_json(cls, path: str | Path) -> Ensemble:
        """Read an ensemble that `to_json` wrote; the result equals it bit for bit.

        Raises
        ------
        ValueError
            If the file is not such an ensemble.
        """
        with reading_json(path, "an ensemble", FORMAT) as data:
            scene = Scene(**data["scene"])
            runs = [Run.from_record(each, scene.n) for each in data["runs"]]
            return cls.of(scene, data["seed"], runs)

    def _runs(self) -> list[Run]:
        columns = (self.word, self.status, self.energy, self.time)
        rows = zip(*(column.tolist() for column in columns), self.angles.tolist(), strict=True)
        return [Run(k, w, s, e, t, tuple(a)) for k, (w, s, e, t, a) in enumerate(rows)]


def release(scene: Scene, mode: Mode, speed: float | None = None) -> Scene:
    """Return a scene whose chain is released in one of the paper's deployment modes.

    Parameters
    ----------
    scene
        The scene to release.
    mode
        `free`: all components at once, without a tube. `forward`, `backward`: out of the tube,
        component 1 or component n first.
    speed
        Feed speed [m/s]; None keeps the scene's speed.

    Raises
    ------
    SceneError
        If an argument is not allowed.
    """
    errors.refuse(unless_a_scene(scene) + errors.unless_one_of("mode", mode, get_args(Mode)))
    feed = {} if speed is None else {"speed": speed}
    if mode == "free":
        return scene.replace(mount="free", feed=feed)
    return scene.replace(mount="tube", feed={"direction": mode, **feed})


def ensemble(
    scene: Scene,
    runs: int = 1000,
    seed: int = 0,
    *,
    workers: int | None = None,
    backend: Backend | None = None,
    state: str | Path | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Ensemble:
    """Simulate many releases, each with its own draws, and count the outcomes.

    Each run draws its values with `Scene.draw`. Run i uses only ``generator(seed, i)``, so that the
    result does not depend on the number or kind of workers. `simulate` with that generator repeats
    the run.

    Parameters
    ----------
    scene
        The scene to release.
    runs
        Number of releases.
    seed
        Seed of all draws.
    workers
        Number of parallel runs; None uses all cores, or all CPUs of a cluster.
    backend
        `threads` or `processes` on this machine, or `ray`: the Ray cluster at ``RAY_ADDRESS``, else
        a local one. None selects processes for many runs on more than four workers, else threads.
    state
        Folder that stores completed runs every two seconds. A later call with the same folder makes
        only the missing runs, after an interruption or for a larger number of runs.
    progress
        Called with the number of completed runs and the number of all runs.

    Raises
    ------
    SceneError
        If an argument is not allowed.
    CheckpointError
        If the contents of `state` are damaged or belong to another scene, seed or physics, or if
        another process uses the folder.
    ImportError
        If Ray is selected but not installed.
    """
    asked = Workers(workers, backend)
    errors.refuse(unless_a_scene(scene))
    key = {"kind": "ensemble", "scene": scene.model_dump(mode="json")}
    return released([scene], runs, seed, asked, key, state, progress)[0]


def released(
    scenes: Sequence[Scene],
    runs: int,
    seed: int,
    workers: Workers,
    key: Mapping[str, Any],
    state: str | Path | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> list[Ensemble]:
    """Return an ensemble for each of several scenes with equal numbers of components.

    Run i of every scene uses ``generator(seed, i)``. Its number among all runs is i times the
    number of scenes, plus the index of its scene. ``key`` describes the scenes, so that ``state``
    is used only for these. The other arguments and the errors are those of `ensemble`.
    """
    problems = [
        *errors.unless_whole("runs", runs, 1, MOST_RUNS),
        *errors.unless_whole("seed", seed, 0),
        *errors.unless_function("progress", progress),
    ]
    errors.refuse(problems)
    count = len(scenes)
    total = count * runs
    with Checkpoint(state, {"physics": physics_digest(), "seed": seed, **key}) as kept:
        found: list[Run] = kept.load(partial(Run.from_record, n=scenes[0].n))
        made = {run.number: run for run in found if run.number < total}
        missing = [number for number in range(total) if number not in made]
        # Runs are ordered by scene, because the first run of a geometry makes its tables. Threads
        # share the tables, so several scenes run together; each process has its own tables.
        together = 1
        if workers.kind(len(missing)) == "threads":
            together = min(workers.count or os.cpu_count() or 1, _SIDE_BY_SIDE)
        missing.sort(key=lambda number: (number % count // together, number))
        tasks = [(number, scenes[number % count]) for number in missing]
        for _, run in finished(partial(run_one, seed, count), tasks, workers):
            made[run.number] = run
            kept.add(run.to_record(), run.number)
            if progress is not None:
                progress(len(made), total)
    return [
        Ensemble.of(scene, seed, [made[number] for number in range(place, total, count)])
        for place, scene in enumerate(scenes)
    ]


PREDICTORS: dict[Mode, str] = {
    "free": "full search",
    "forward": "forward search",
    "backward": "backward search",
}
"""Names of the minimiser's searches by mode."""


def varied(scene: Scene) -> str:
    """Return a description of the values that each run of a scene draws, and of their spreads."""
    found: list[str] = []
    if scene.start_angles is None and scene.start_angle_spread > 0.0:
        found.append(f"start angles ±{scene.start_angle_spread:g} rad")
    for name in type(scene.spreads).model_fields:
        width = getattr(scene.spreads, name)
        if width > 0.0:
            unit = {"friction_decades": "", "obstacle_offset": " m", "tilt": "°"}.get(name)
            told = f"{100 * width:g} %" if unit is None else f"{width:g}{unit}"
            found.append(f"{name.replace('_', ' ')} ±{told}")
    return ", ".join(found) or "nothing"


def predictions(scene: Scene) -> dict[str, str]:
    """Return the word that each of the minimiser's searches predicts, by the name of the search.

    Searches that refuse the scene, or reach a joint where every letter overlaps, are omitted.
    """
    found: dict[str, str] = {}
    for mode, name in PREDICTORS.items():
        with suppress(ValueError):
            found[name] = minimise(scene, mode, top=1).best.word
    return found


class Bar(NamedTuple):
    """The frequency of one outcome."""

    word: str
    """Fold word; empty for several outcomes together."""
    status: str
    """The text of a `FoldStatus`, or `others`."""
    rate: float
    """Share of the runs."""
    low: float
    """Lower end of the share's interval."""
    high: float
    """Upper end of the share's interval."""
    joints: tuple[float, ...]
    """Joint angles of a run with this outcome [rad]; empty for several outcomes together."""


def bars(ensemble: Ensemble) -> list[Bar]:
    """Return a bar for each pair of word and status, most frequent first."""
    found: list[Bar] = []
    for (word, status), often in ensemble.outcomes.items():
        first = int(np.argmax((ensemble.word == word) & (ensemble.status == status.value)))
        joints = tuple(np.diff(ensemble.angles[first]).tolist())
        found.append(Bar(word, status.value, often.rate, often.low, often.high, joints))
    return found


def _shares(entries: list[K]) -> dict[K, Share]:
    """Return the share of each entry, most frequent first; equally frequent entries are sorted."""
    counts = most_first(Counter(entries))
    return {entry: share(count, len(entries)) for entry, count in counts.items()}


def most_first(counts: Counter[K]) -> Counter[K]:
    """Return the counts, largest first; equal counts are sorted by name."""
    return Counter(dict(sorted(counts.items(), key=lambda item: (-item[1], str(item[0])))))


def outcome_row(word: str, status: FoldStatus, found: Share) -> Row:
    """Return the probability of a word and a status as a row of a table."""
    return {
        "word": word,
        "status": status.value,
        "runs": found.successes,
        "probability": found.rate,
        "low": found.low,
        "high": found.high,
    }


def _plain(found: Share) -> dict[str, Any]:
    return {"probability": found.rate, **asdict(found)}
