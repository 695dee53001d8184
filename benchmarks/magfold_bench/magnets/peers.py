"""The engine's speed relative to the magnetics library magpylib, at equal or smaller error.

Both compute the force and torque on every casing of a chain: magpylib with magnets divided into a
given mesh of cells, and the engine with sums over nodes and a given error bound. The result for
each mesh is the ratio of its time to that of the engine's fastest setting with no larger error.
"""

import importlib
import math
from collections.abc import Callable, Generator
from contextlib import contextmanager
from importlib.util import find_spec
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from magfold_bench import tables, timing
from magfold_bench.laws import exact_magnets
from magfold_bench.magnets import samples
from magfold_bench.magnets.samples import Loads, Sample
from magfold_bench.presentation import Lines
from magfold_bench.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.engine.state import Array
from magfold_env.files import pip_install
from magfold_env.scene import Magnets, Scene
from magfold_env.shapes import centres

MAGPYLIB = "magpylib"
STEP = 1e-7  # [m] of magpylib's finite differences; their error, 1e-8, is below any mesh's
DEGREES = 180.0 / np.pi

Mesh = tuple[int, int, int]
"""Number of a magnet's cells along its thickness, width and height."""

ENGINE = "engine, sums"
OVER = f"time / {ENGINE}"
BOUNDS = (5e-2, 1e-2, 1e-3, 1e-4, 1e-5)
WANTED = 1000.0
SEED = 3
OFF_STOP = 1e-6  # [rad]
SHAPES: dict[str, Callable[[int], Array]] = {
    "unfolded": samples.unfolded,
    "folded": lambda n: samples.folded(n) + OFF_STOP * (np.arange(n) % 2),
}
NO_RATIO = timing.Spread(math.nan, math.nan, math.nan)

# Cells of a magnet, nearly cubes, by number of components; then the number of samples per timing.
FINE: tuple[Mesh, ...] = ((1, 2, 2), (2, 4, 4), (3, 7, 7), (4, 10, 10))
QUICK: tuple[dict[int, tuple[Mesh, ...]], int] = ({6: FINE[:1]}, 2)
FULL: tuple[dict[int, tuple[Mesh, ...]], int] = ({6: FINE, 60: FINE[:2]}, 3)


def installed() -> bool:
    """Return whether magpylib is installed; the extra ``peers`` contains it."""
    return find_spec("magpylib") is not None


class Peer:
    """Casings as magpylib's collections of cuboids, each uniformly magnetised along its thickness.

    The casings have centres (n, 2) [m] and headings (n,) [rad].
    """

    def __init__(self, scene: Scene, places: Array, headings: Array) -> None:
        self._magpylib: Any = importlib.import_module("magpylib")
        rotation: Any = importlib.import_module("scipy.spatial.transform").Rotation
        magnets = exact_magnets.magnets_of(scene)
        width, height, thickness, inset = (
            magnets.by_face(name) for name in ("width", "height", "thickness", "inset")
        )
        depth = scene.casing.side / 2.0 - inset - thickness / 2.0
        remanence = exact_magnets.MU0 * scene.charges / (width * height)
        self._places = np.column_stack([places, np.zeros(len(places))])
        self._casings: list[Any] = []
        for place, heading, strength in zip(places, headings, remanence, strict=True):
            angle = heading + exact_magnets.FACE_NORMALS
            middle = place + depth[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
            cuboids = [
                self._magpylib.magnet.Cuboid(
                    dimension=(thickness[f], width[f], height[f]),
                    polarization=(strength[f], 0.0, 0.0),
                    position=(*middle[f], 0.0),
                    orientation=rotation.from_euler("z", angle[f] * DEGREES, degrees=True),
                )
                for f in np.flatnonzero(strength)  # an empty face has no magnet
            ]
            self._casings.append(self._magpylib.Collection(*cuboids))

    def loads(self, mesh: Mesh) -> Loads:
        """Return forces [N] and torques about the centres [N·m], (1, n) each.

        As in the engine, every pair of casings is computed once and yields the reactions too.
        """
        n = len(self._casings)
        force, torque = np.zeros((n, 3)), np.zeros((n, 3))
        present = [i for i, casing in enumerate(self._casings) if casing.children]
        for k, i in enumerate(present[1:], start=1):
            sources = present[:k]
            found = self._magpylib.getFT(
                [self._casings[j] for j in sources],
                self._casings[i],
                pivot=self._places[i],
                eps=STEP,
                squeeze=False,
                meshing=mesh,
            )
            pull, moment = (each[:, 0, 0] for each in found)  # of all sources, (k, 3) each
            force[i] += pull.sum(axis=0)
            torque[i] += moment.sum(axis=0)
            force[sources] -= pull
            torque[sources] -= moment + np.cross(self._places[i] - self._places[sources], pull)
        return Loads(force[None, :, 0], force[None, :, 1], torque[None, :, 2])

    @contextmanager
    def one_thread(self) -> Generator[None]:
        """Limit magpylib to one thread, because the engine also uses only one for a chain."""
        defaults = self._magpylib.defaults
        threads = defaults.threads
        defaults.threads = 1
        try:
            yield
        finally:
            defaults.threads = threads


class Contender(NamedTuple):
    """A way to compute magnet forces, with one setting."""

    by: str
    setting: str
    error: float  # largest error of forces and torques on casings, in flush forces
    work: Callable[[], object]  # what is timed
    evaluations: int  # number of evaluations per call

    @property
    def key(self) -> str:
        """The unique name of the contender."""
        return f"{self.by} {self.setting}"


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every mesh and bound on every chain; without magpylib, measure nothing."""
    if not installed():
        text = f"magpylib is absent; install it with the extra: {pip_install('peers')}"
        return Measurement(findings=[text])
    meshes, rounds = QUICK if quick else FULL
    rows: list[Row] = []
    cases = list(product(meshes, SHAPES))
    for (n, shape), tick in tables.each_case(progress, cases, "n = {0[0]}, {0[1]}".format):
        rows.extend(measure(n, shape, meshes[n], rounds, tick))
    return Measurement(rows, [_table(rows)], _findings(rows))


def measure(n: int, shape: str, meshes: tuple[Mesh, ...], rounds: int, tick: Tick) -> list[Row]:
    """Return one row per contender for a chain in one shape with random poles."""
    scene = samples.random_scene(np.random.default_rng(SEED), n)
    headings = SHAPES[shape](n)
    sample = samples.sample_of([scene], [(centres(headings, scene.casing.side), headings)])
    peer = Peer(sample.scenes[0], sample.places[0], sample.headings[0])
    with peer.one_thread():
        contenders = [_peer(sample, peer, mesh) for mesh in meshes]
        contenders += [_sums(sample, bound) for bound in BOUNDS]
        tasks = {each.key: timing.unprepared(each.work) for each in contenders}
        taken = timing.take_turns(tasks, rounds, tick=tick)
    times = {c.key: taken[c.key].each_of(c.evaluations) for c in contenders}
    rows: list[Row] = []
    for each in contenders:
        row: Row = {
            "n": n,
            "shape": shape,
            "by": each.by,
            "mesh or bound": each.setting,
            "worst error": each.error,
            **times[each.key].spread.time_cells("µs", 1e6),
        }
        fast = fastest(contenders, times, each.error) if each.by == MAGPYLIB else ""
        quotient = timing.ratio(times[each.key], times[fast]) if fast else NO_RATIO
        row |= quotient.cells(OVER)
        rows.append(row)
    return rows


def _peer(sample: Sample, peer: Peer, mesh: Mesh) -> Contender:
    error = float(sample.errors(peer.loads(mesh))[0])
    name = " × ".join(str(cells) for cells in mesh)
    return Contender(MAGPYLIB, name, error, lambda: peer.loads(mesh), 1)


def _sums(sample: Sample, bound: float) -> Contender:
    sums = samples.Sums(sample, Magnets(accuracy=bound))
    error = float(sample.errors(sums.loads())[0])
    return Contender(ENGINE, f"{bound:g}", error, sums.work, sums.evaluations)


def fastest(contenders: list[Contender], times: dict[str, timing.Timing], error: float) -> str:
    """Return the key of the engine's fastest contender with no larger error, or an empty string."""
    enough = [each.key for each in contenders if each.by == ENGINE and each.error <= error]
    return min(enough, key=lambda key: times[key].median, default="")


def _table(rows: list[Row]) -> Table:
    shown: list[Row] = [
        {
            key: "" if isinstance(cell, float) and math.isnan(cell) else cell
            for key, cell in row.items()
        }
        for row in tables.without_quartiles(rows)
    ]
    return Table("All magnets of a chain, compared with magpylib: errors in flush forces", shown)


def _findings(rows: list[Row]) -> list[str]:
    found: list[str] = []
    for n in tables.distinct(rows, "n"):
        factors = tables.numbers(tables.select(rows, n=n, by=MAGPYLIB), OVER)
        held = int((factors >= WANTED).sum())
        found.append(
            f"n = {n}: magpylib's getFT takes {min(factors):.3g} to {max(factors):.3g} times as "
            f"long as the engine's sums at no larger error; at least {WANTED:g} is required: "
            f"holds for {held} of {len(factors)} meshes and shapes"
        )
    return found


DIAGRAM = Lines(
    "Compared with magpylib: worst error, in flush forces, against time",
    "time [µs]",
    "worst error",
    "by",
    ("n", "shape"),
)
