"""Whole folds by the engine, and by pymunk, a simulator of rigid bodies in the plane.

The chain in pymunk is built as its users would build it: squares on pivot joints, rotary limits at
±90°, contacts that do not bounce, and the forces of point charges, which NumPy sums before every
step. Joints to the ground with limited force and torque, the usual recipe for a floor seen from
above, give the friction. The engine's law limits force and torque together, pymunk's each alone.
"""

import importlib
import math
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np

from magfold_bench import folds, runs, tables, timing
from magfold_bench.laws.exact_magnets import faces_of
from magfold_bench.presentation import median
from magfold_bench.tables import Measurement, Progress, Row, Table
from magfold_env.engine.state import Array
from magfold_env.files import pip_install
from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene
from magfold_env.scene.numbers import FRICTION_ARM
from magfold_env.shapes import angles_to_word, centres, headings

COULOMB = 1e-7  # µ0 / 4π
APART = 4  # components less far apart cannot meet while their stops hold
OVERLAP = 1e-4  # of the side: squares that only touch do not collide, as in the engine
WAIT, STILL = 0.01, 1e-3  # [s], [rad]: a chain whose joints turn less in this time is at rest
REFERENCE, LOOSER = 1e-6, 1e-5  # tolerances [rad]
ENGINE, RATIO, OWN = "engine", "times the engine's", "of it in pymunk [ms]"

# Number of sequences per kind of scene, and pymunk's time steps [s].
QUICK = 2, (1e-4,)
FULL = 24, (1e-3, 2.5e-4, 1e-4, 2e-5)


class World:
    """A scene's free chain in pymunk, in SI units, and its simulation in steps of ``step`` [s]."""

    def __init__(self, scene: Scene, step: float) -> None:
        pm: Any = importlib.import_module("pymunk")
        assert scene.start_angles is not None
        self.own_time = 0.0  # processor time of pymunk's own code [s]
        self._step, self._duration = step, scene.duration
        self._loads = None if scene.magnets is None else point_charges(scene)
        self._space, self.bodies = pm.Space(), list[Any]()
        self._space.collision_slop = OVERLAP * scene.casing.side
        angles, half = headings(scene.start_angles), 0.5 * scene.casing.diagonal
        grips = scene.frictions * scene.gravity.normal * scene.masses
        for i, place in enumerate(centres(angles, scene.casing.side).tolist()):
            body = pm.Body(scene.masses[i], scene.inertias[i])
            body.position, body.angle = place, angles[i]
            square = pm.Poly(body, [(half, 0), (0, half), (-half, 0), (0, -half)])
            meets = sum(1 << j for j in range(scene.n) if abs(i - j) >= APART)
            square.filter = pm.ShapeFilter(categories=1 << i, mask=meets)
            slide = pm.PivotJoint(self._space.static_body, body, (0, 0), (0, 0))
            turn = pm.GearJoint(self._space.static_body, body, 0, 1)
            slide.max_bias = turn.max_bias = 0
            slide.max_force = grips[i]
            turn.max_force = FRICTION_ARM * scene.casing.side * grips[i]
            self._space.add(body, square, slide, turn)
            for previous in self.bodies[-1:]:
                hinge = pm.PivotJoint(previous, body, (half, 0), (-half, 0))
                stop = pm.RotaryLimitJoint(previous, body, -0.5 * math.pi, 0.5 * math.pi)
                self._space.add(hinge, stop)
            self.bodies.append(body)

    @property
    def joint_angles(self) -> Array:
        """Angles of the joints [rad], shape (n-1,)."""
        return np.diff([body.angle for body in self.bodies])

    def advance(self) -> None:
        """Make one step."""
        if self._loads is not None:
            loads = self._loads(np.array([(*each.position, each.angle) for each in self.bodies]))
            for body, (fx, fy, torque) in zip(self.bodies, loads.tolist(), strict=True):
                body.force, body.torque = (fx, fy), torque
        begun = time.thread_time()
        self._space.step(self._step)
        self.own_time += time.thread_time() - begun

    def fold(self) -> None:
        """Make steps until the joints are at rest, or until the scene's time is over."""
        for _ in range(round(self._duration / WAIT)):
            before = self.joint_angles
            for _ in range(round(WAIT / self._step)):
                self.advance()
            if np.abs(self.joint_angles - before).max() < STILL:
                return


def point_charges(scene: Scene) -> Callable[[Array], Array]:
    """Return the function from poses (x, y, angle) to forces and torques, (n, 3) both.

    The magnets are of the model `points`; all numbers are in SI units.
    """
    assert scene.magnets is not None
    n, count = scene.n, scene.magnets.nodes or 3
    faces = faces_of(scene, np.zeros((n, 2)), np.zeros(n))
    shifts = np.linspace(-0.5, 0.5, count) * faces.size[:, :1]
    places = faces.centre[:, None] + shifts[..., None] * faces.along[:, None]
    local = (places @ [1.0, 1j]).reshape(n, -1)  # x + iy in the casing's frame
    charges = np.repeat(faces.charge / count, count).reshape(n, -1)
    i, j = np.triu_indices(n, 1)
    strengths = COULOMB * charges[i, :, None] * charges[j, None, :]
    on_i, on_j = (1.0 * np.equal(np.arange(n)[:, None], each) for each in (i, j))
    ones = np.ones(local.shape[1])  # products with them are faster sums

    def loads(poses: Array) -> Array:
        arms = np.exp(1j * poses[:, 2:]) * local
        across, up = poses[:, :1] + arms.real, poses[:, 1:2] + arms.imag
        dx, dy = (each[i][:, :, None] - each[j][:, None, :] for each in (across, up))
        squares = dx * dx + dy * dy
        factors = strengths / (squares * np.sqrt(squares))
        dx *= factors
        dy *= factors
        x, y = (on_i @ (each @ ones) - on_j @ (ones @ each) for each in (dx, dy))
        return np.stack([x, y, arms.real * y - arms.imag * x], axis=2).sum(axis=1)

    return loads


def run(quick: bool, progress: Progress) -> Measurement:
    """Fold random chains with the engine and with pymunk; without pymunk, measure nothing."""
    if find_spec("pymunk") is None:
        return Measurement(findings=[f"pymunk is absent; install it: {pip_install('peers')}"])
    (sequences, steps), found = QUICK if quick else FULL, Measurement()
    kinds = [kind for kind, changes in runs.KINDS.items() if changes["mount"] == "free"]
    cases = [(kind, seed) for kind in kinds for seed in range(sequences)]
    for (kind, seed), _ in tables.each_case(progress, cases, "{0[0]}, sequence {0[1]}".format):
        scene = folds.scene_of(kind, seed).replace(magnets={"model": "points"})
        if word := sure_word(scene):
            rows = _fold(scene, word, steps)
            found.rows.extend({"kind": kind, "sequence": seed, **row} for row in rows)
    found.tables.extend(_table(k, tables.select(found.rows, kind=k)) for k in kinds)
    return found


def sure_word(scene: Scene) -> str:
    """Return the word into which a scene folds; empty if it does not fold, or not surely.

    It surely folds if a looser tolerance and a nudge of the start angles lead to the same word.
    """
    assert scene.start_angles is not None
    nudged = scene.replace(start_angles=[angle + runs.NUDGE for angle in scene.start_angles])
    tight = folds.at_tolerance(scene, REFERENCE), folds.at_tolerance(nudged, LOOSER)
    one, other = (runs.ended(each).fold() for each in tight)
    sure = one.status is other.status is FoldStatus.FOLDED and one.word == other.word
    return one.word if sure else ""


def _fold(scene: Scene, word: str, steps: tuple[float, ...]) -> list[Row]:
    """Fold a scene once with every contender; ``word`` is right."""
    worlds: dict[float, World] = {}

    def task(step: float) -> timing.Task:
        def prepare() -> Callable[[], None]:
            worlds[step] = World(scene, step)
            return worlds[step].fold

        return prepare

    tasks = {0.0: runs.run_task(scene)} | {step: task(step) for step in steps}
    taken = timing.take_turns(tasks, 1)
    ends = {0.0: runs.ended(scene).fold()} | worlds
    return [
        {
            "by": f"pymunk, {1e3 * step:g} ms" if step else ENGINE,
            "right": angles_to_word(np.nan_to_num(ends[step].joint_angles)) == word,
            "time [ms]": 1e3 * each.median,
            OWN: 1e3 * worlds[step].own_time if step else 0.0,
            RATIO: each.median / taken[0.0].median,
        }
        for step, each in taken.items()
    ]


def _table(kind: str, rows: list[Row]) -> Table:
    shown: list[Row] = []
    for name in tables.distinct(rows, "by"):
        mine = tables.select(rows, by=name)
        right = f"{int(tables.numbers(mine, 'right').sum())} of {len(mine)}"
        ratio = timing.spread_of(tables.numbers(mine, RATIO))
        middle: Row = {key: median(mine, key) for key in ("time [ms]", OWN)}
        shown.append({"by": name, "right": right, **middle, RATIO: str(ratio)})
    return Table(f"Folds of {folds.COMPONENTS} components, {kind}: medians and quartiles", shown)
