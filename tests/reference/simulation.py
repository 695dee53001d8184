"""A second, slow simulator of the same physics, with other coordinates and without engine code.

It has a dense mass matrix. Each pole face is a fixed row of Gauss nodes. Joint stops, squares,
obstacles and the tube's walls are stiff springs, damped so much that nothing bounces. Friction is
smoothed at low speeds. Linearly implicit Euler steps are of first order and stable with stiff
springs. Without events, complementarity and sticking, it shares no weakness with the engine, but
has overlaps (about 1e-3 of the side) and creep (below ``SLOW``). The feed may turn back and hold
components again, by the rules of docs/tube.md. Its drive never slips.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from magfold_env.scene import Scene
from magfold_env.shapes import angles_to_word, centres
from tests.reference.simulation_kernels import run
from tests.reference.simulation_kernels import step as advance

NODES, FINE = 8, 16  # a pole face, the latter where forces count and not where they lead
NORMALS = np.radians([45.0, 135.0, -135.0, -45.0])
# Where loads rise slowly: friction is smooth below so many m/s, its law met in so many rounds a
# step [s]; squares are smaller by this share, springs so many times as hard. A level of the load
# lasts so long [s], and what turned by so many radians gave way.
CREEP, ROUNDS, TIGHT, HARD = 1e-9, 10, 2e-6, 1000.0
STEP, DWELL, MOVED = 1e-4, 0.06, 3e-5


@dataclass(frozen=True)
class Run:
    """The results of a reference simulation, beginning with component 1."""

    time: np.ndarray
    angles: np.ndarray
    word: str
    inside: int
    """Components that the tube holds at the end."""
    speed: float
    """Largest speed of a component at the end [m/s]."""


def casing_nodes(scene: Scene, nodes: int = NODES) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes of a casing (m, 2) [m] and their charges if each face is N [A·m], (4, m)."""
    magnets = scene.magnets
    assert magnets is not None
    assert magnets.even
    strength, width, thickness, inset = (
        float(np.max(value))
        for value in (magnets.charge, magnets.width, magnets.thickness, magnets.inset)
    )
    offsets, shares = np.polynomial.legendre.leggauss(nodes)
    outer = scene.casing.side / 2 - inset
    places, charges = [], []
    for face, angle in enumerate(NORMALS):
        normal = np.array([np.cos(angle), np.sin(angle)])
        along = np.array([-normal[1], normal[0]])
        for distance, sign in ((outer, 1.0), (outer - thickness, -1.0)):
            places.append(distance * normal + np.outer(offsets * width / 2, along))
            charge = np.zeros((4, nodes))
            charge[face] = sign * shares / 2 * strength
            charges.append(charge)
    return np.concatenate(places), np.concatenate(charges, axis=1)


def magnets_of(scene: Scene, nodes: int = NODES) -> tuple[np.ndarray, np.ndarray, float]:
    """Return nodes of a casing (m, 2) [m], all components' charges (n, m) [A·m], a height [m]."""
    if scene.magnets is None:
        return np.zeros((1, 2)), np.zeros((scene.n, 1)), 1.0
    letters = np.array([[1.0 if c == "N" else -1.0 for c in faces] for faces in scene.sequence])
    places, shares = casing_nodes(scene, nodes)
    return places, letters @ shares, float(np.max(scene.magnets.height))


def solids_of(scene: Scene, *, walls: bool = True) -> np.ndarray:
    """Return centres, directions and half sizes of obstacles and the tube's walls, (k, 6)."""
    solids = [
        (*each.position, np.cos(each.heading), np.sin(each.heading), *np.divide(each.size, 2.0))
        for each in scene.obstacles
    ]
    if scene.mount == "tube" and walls:  # a metre long
        middle = (scene.bore + scene.feed.wall) / 2
        solids += [(-0.5, y, 1.0, 0.0, 0.5, scene.feed.wall / 2) for y in (-middle, middle)]
    return np.array(solids).reshape(-1, 6)


def simulate(
    scene: Scene, *, step: float = 1e-5, after: float = 0.6, walls: bool = True, hard: float = 1.0
) -> Run:  # fmt: skip
    """Simulate a concrete scene with `strips` magnets.

    It goes on to ``after`` seconds beyond the last release, or the end of the feed's schedule. A
    schedule must have legs of time, and its drive never slips. Springs are so many
    times as ``hard``.
    """
    forward = scene.mount == "tube" and scene.feed.direction == "forward"
    n = scene.n
    nodes, charges, height = magnets_of(scene)
    masses, inertias = scene.masses, scene.inertias
    if forward:  # counted from the held end
        nodes, charges = -nodes, charges[::-1]
        masses, inertias = masses[::-1].copy(), inertias[::-1].copy()
    tube, tip = scene.mount == "tube", 0.0
    if tube:
        assert scene.start_offsets is not None
        offsets = scene.start_offsets[::-1] if forward else scene.start_offsets
        headings, tip = np.arcsin(np.diff(offsets) / scene.casing.diagonal), offsets[-1]
    else:
        assert scene.start_angles is not None
        headings = np.concatenate([[0.0], np.cumsum(scene.start_angles)])
    legs = np.array([[np.inf, scene.speeds[0]]])
    if scene.feed.schedule is not None:
        assert scene.feed.schedule.time is not None
        legs = np.array(scene.feed.schedule.time)
    times, angles, inside, left = run(
        np.concatenate([headings, [0.0, tip]]), n if tube else 0, legs, masses, inertias,
        scene.casing.side, nodes, np.ascontiguousarray(charges), height,
        scene.frictions[0] * scene.gravity.normal, 0.3826 * scene.casing.side,
        solids_of(scene, walls=walls), hard, step, after,
    )  # fmt: skip
    if forward:
        angles = angles[:, ::-1] + np.pi
    return Run(times, angles, angles_to_word(np.diff(angles[-1])), inside, left)


class Loading:
    """A chain at rest under slowly rising loads, with `strips` magnets or none.

    The friction law is almost exact here, and joints and casings are almost rigid.

    Parameters
    ----------
    scene, angles, base
        The chain, outside any tube, and its pose. It first settles until its springs balance and
        it does not creep; ``angles`` and ``base`` are then the settled pose.
    """

    def __init__(self, scene: Scene, angles: np.ndarray, base: np.ndarray) -> None:
        self._scene, self._n = scene, scene.n
        self._magnets = magnets_of(scene, FINE)
        self._q, self._v = np.concatenate([angles, base]), np.zeros(scene.n + 2)
        for grip in (*np.geomspace(100.0, 1.0, 30), 1.0, 1.0):
            self._stand(0.0, 0.0, np.zeros((scene.n, 3)), grip=grip, seconds=0.1 * DWELL)
        self.angles, self.base = self._q[: scene.n].copy(), self._q[scene.n :].copy()

    def yields_between(
        self, load: np.ndarray, levels: Sequence[float], held: int = 0
    ) -> tuple[float, float]:
        """Raise a load; return the last level that the chain bore, and the first that moved it.

        Level 1 of a load is forces [N] and torques [N m] on the components, shape (n, 3). The
        component of number ``held`` is held as it lies, 0 is none.
        """
        self._q[:], self._v[:] = np.concatenate([self.angles, self.base]), 0.0
        scale, before = np.array([1.0] * self._n + [self._scene.casing.diagonal] * 2), 0.0
        for level in levels:
            self._stand(before, level, load, held)
            if (np.abs(self._q - [*self.angles, *self.base]) / scale).max() > MOVED:
                return before, level
            before = level
        return before, np.inf

    def _stand(
        self, before: float, level: float, load: np.ndarray, held: int = 0,
        grip: float = 1.0, seconds: float = DWELL,
    ) -> None:  # fmt: skip
        """Ramp the load from one level to another, and keep it there for as long."""
        scene, steps = self._scene, round(seconds / STEP)
        if held:
            middle = centres(self.angles, side=scene.casing.side, base=self.base)[held - 1]
            place = np.append(middle, self.angles[held - 1])
        else:
            place = np.zeros(3)
        # In the engine squares are smaller by 1e-4, and so are the centres of their corners nearer.
        radius = scene.casing.corner_radius + 0.5 * (1e-4 - TIGHT) * scene.casing.side
        for k in range(steps):
            now = before + (level - before) * min(1.0, 2.0 * (k + 1) / steps)
            advance(
                self._q, self._v, 0, self._n + (0 if scene.mount == "pinned" else 2), STEP,
                scene.masses, scene.inertias, scene.casing.side, *self._magnets,
                grip * scene.frictions[0] * scene.gravity.normal, 0.3826 * scene.casing.side,
                solids_of(scene), CREEP, ROUNDS, TIGHT, radius, HARD, now * load, held - 1, place,
            )  # fmt: skip
