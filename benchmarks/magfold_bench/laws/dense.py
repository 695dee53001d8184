"""A fold's states within its steps, from the integrator's dense output.

Consecutive states are at most 0.1 ms apart, and between them no casing near a solid moves by more
than a small share of the thinnest solid's thickness. States that hardly differ count as one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from magfold_bench.laws import mechanics
from magfold_bench.laws.overlap import beyond_bore, depths, order_in_feed
from magfold_env.engine.state import Model, State
from magfold_env.fold import Fold
from magfold_env.scene import Rectangle, Scene
from magfold_env.shapes import centres
from magfold_env.simulation.frames import FASTEST, Frames
from magfold_env.simulation.session import Session
from magfold_env.simulation.view import Orientation

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

RATE = 1e4  # inspected states per second [1/s]
SHARE = 0.1  # largest motion near a solid between two states, as a share of the least thickness
# States that differ by less count as one. The limits are shares of the side and of the least
# thickness, at most once or twice the depth that the laws allow for overlaps.
STILL, FINE = 1e-3, 0.02


class States(NamedTuple):
    """The states of a chain at m times, with component 1 first."""

    angles: Floats
    """Headings [rad], shape (m, n)."""
    rates: Floats
    """Rates of the headings [rad/s], shape (m, n)."""
    base: Floats
    """Outer hinge of component 1 [m], shape (m, 2)."""
    base_velocity: Floats
    """Velocity of that hinge [m/s], shape (m, 2)."""
    released: npt.NDArray[np.int64]
    """Number of components outside the tube, shape (m,)."""

    def of(self, kept: npt.NDArray[np.intp] | Bools) -> States:
        """Return the states in the given rows."""
        moving = self.base[kept], self.base_velocity[kept]
        return States(self.angles[kept], self.rates[kept], *moving, self.released[kept])


@dataclass
class Inside:
    """The worst values among the inspected states of one fold."""

    casings: float = 0.0
    """Deepest overlap of two casings, as a share of the side."""
    solids: float = 0.0
    """Deepest overlap of a casing and a solid, as a share of the side."""
    thin: float = 0.0
    """Deepest overlap of a casing and a solid, as a share of the solid's thickness."""
    crossings: int = 0
    """Number of times that a casing's centre passed through a solid between two states."""
    past_stop: float = 0.0
    """Largest angle of a joint beyond a right angle [rad]."""
    beyond_bore: float = 0.0
    """Largest distance by which a held casing extends beyond the tube's inner wall, as a share of
    the side."""
    speed: float = 0.0
    """Speed of the fastest point of a casing near a solid [m/s]."""


class Judge:
    """Finds the worst values among consecutive states."""

    def __init__(self, scene: Scene) -> None:
        self.worst = Inside()
        self._scene = scene
        self._thickness = np.array([min(each.size) for each in scene.solids])
        thinnest = float(self._thickness.min(initial=math.inf))
        # Half the allowed difference, because states are left out in two passes.
        self.still = 0.5 * min(STILL * scene.casing.side, FINE * thinnest)
        self._before: tuple[Floats, Bools] | None = None

    def look(self, states: States) -> None:
        """Inspect more states, which follow the earlier ones."""
        finite = np.logical_and.reduce([np.isfinite(each).all(axis=-1) for each in states[:4]])
        states = states.of(finite)
        if len(states.angles) == 0:
            return
        scene, side, worst = self._scene, self._scene.casing.side, self.worst
        places = centres(states.angles, side, states.base)
        kept = self._moved(states.angles, places)
        states, places = states.of(kept), places[kept]
        seen = (states.angles, states.base, states.released)
        if scene.mount == "tube":
            worst.beyond_bore = max(
                worst.beyond_bore, float(beyond_bore(scene, *seen).max()) / side
            )
        if not scene.contact:
            return
        deep = depths(scene, *seen)
        deepest = deep.solids.max(axis=0, initial=0.0)
        worst.casings = max(worst.casings, float(deep.casings.max()) / side)
        worst.solids = max(worst.solids, float(deepest.max(initial=0.0)) / side)
        worst.thin = max(worst.thin, float((deepest / self._thickness).max(initial=0.0)))
        joints = np.abs(np.diff(states.angles, axis=1))
        worst.past_stop = max(worst.past_stop, float((joints - np.pi / 2).max(initial=0.0)))
        if scene.solids:
            free = order_in_feed(scene) < states.released[:, None]
            self._cross(places, free)
            self._hurry(states, places, free)

    def _moved(self, angles: Floats, places: Floats) -> npt.NDArray[np.intp]:
        """Return the states that differ from the last one kept, and always the final state."""
        moved = np.linalg.norm(np.diff(places, axis=0), axis=2)
        moved += 0.5 * self._scene.casing.diagonal * np.abs(np.diff(angles, axis=0))
        return _apart(moved.max(axis=1), self.still)

    def _cross(self, places: Floats, free: Bools) -> None:
        """Count the lines between a centre's consecutive positions that pass through a solid."""
        if self._before is not None:
            places = np.concatenate([self._before[0], places])
            free = np.concatenate([self._before[1], free])
        self._before = places[-1:], free[-1:]
        for solid in self._scene.solids:
            seen, half = _seen_from(solid, places), 0.5 * np.array(solid.size)
            start, way = seen[:-1], np.diff(seen, axis=0)
            with np.errstate(divide="ignore", invalid="ignore"):
                ends = np.sort([(-half - start) / way, (half - start) / way], axis=0)
            beside = np.where(np.abs(start) < half, np.inf, -np.inf)
            enters = np.where(way == 0.0, -beside, ends[0]).max(axis=2).clip(min=0.0)
            leaves = np.where(way == 0.0, beside, ends[1]).min(axis=2).clip(max=1.0)
            self.worst.crossings += int(((enters < leaves) & free[1:] & free[:-1]).sum())

    def _hurry(self, states: States, places: Floats, free: Bools) -> None:
        """Record the speeds of casings near solids."""
        scene, diagonal = self._scene, self._scene.casing.diagonal
        near = np.zeros(places.shape[:2], dtype=bool)
        for solid in scene.solids:
            reach = 0.5 * np.array(solid.size) + diagonal
            near |= (np.abs(_seen_from(solid, places)) < reach).all(axis=2)
        moving = mechanics.centre_velocities(
            scene, states.angles, states.rates, states.base_velocity
        )
        speed = np.linalg.norm(moving, axis=2) + 0.5 * diagonal * np.abs(states.rates)
        self.worst.speed = max(self.worst.speed, float(speed[near & free].max(initial=0.0)))


def _apart(ways: Floats, still: float) -> npt.NDArray[np.intp]:
    """Return the indices of states about ``still`` [m] apart; ``ways`` [m] separate all states."""
    passed = np.cumsum(np.concatenate([[0.0], ways])) // still
    return np.union1d(np.flatnonzero(np.diff(passed, prepend=-1.0)), [len(ways)])


def _seen_from(solid: Rectangle, places: Floats) -> Floats:
    """Return points (..., 2) [m] in a solid's frame of reference."""
    axes = np.array([solid.axis, [-solid.axis[1], solid.axis[0]]])
    return (places - np.array(solid.position)) @ axes.T


class _Watch(Frames):
    """Frames that are inspected instead of stored."""

    def __init__(self, judge: Judge, view: Orientation, model: Model, state: State, rate: float):
        super().__init__(model, state, rate)
        self._judge, self._view = judge, view

    def empty(self) -> None:
        super().empty()
        _, q, v, lo, _ = self._parts.pop()
        self._look(q, v, lo)

    def trajectory(self, view: Orientation, *, ended: bool = False) -> None:
        self.empty()
        state = self._state
        self._look(state.q[None], state.v[None], state.counter[:1].copy())

    def _look(self, q: Floats, v: Floats, lo: npt.NDArray[np.int64]) -> None:
        if len(q) == 0:
            return
        n, view, diagonal = self._model.n, self._view, self._model.bodies.length[0]
        # An upper bound on a corner's motion excludes most states at little cost.
        moved = np.abs(np.diff(q, axis=0))
        ways = diagonal * moved[:, :n].sum(axis=1) + moved[:, n:].sum(axis=1)
        kept = _apart(ways, self._judge.still)
        q, v, lo = q[kept], v[kept], lo[kept]
        headings, rates = view.headings(q[:, :n]), view.rates(v[:, :n])
        hinge = view.outer_hinge(q, lo), view.outer_velocity(q, v)
        self._judge.look(States(headings, rates, *hinge, n - lo))


class _WatchedSession(Session):
    """A session that inspects every frame."""

    def __init__(self, scene: Scene, judge: Judge, rate: float) -> None:
        super().__init__(scene)
        self._chains.frames = _Watch(judge, self._view, self._model, self._state, rate)


def look_inside(scene: Scene) -> tuple[Inside, Fold]:
    """Simulate a concrete scene and inspect its states within steps."""
    worst, fold = _look_at(scene, RATE)
    thinnest = min((min(each.size) for each in scene.solids), default=math.inf)
    needed = worst.speed / (SHARE * thinnest)
    if needed > RATE:
        worst, fold = _look_at(scene, min(needed, FASTEST))
    return worst, fold


def _look_at(scene: Scene, rate: float) -> tuple[Inside, Fold]:
    judge = Judge(scene)
    session = _WatchedSession(scene, judge, rate)
    session.settle()
    return judge.worst, session.fold()
