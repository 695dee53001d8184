"""Casings in many states, what they should feel there, and what the engine's sums say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from magfold_env.benchmarks.magnets.kernels import Loads, sum_forces
from magfold_env.engine.state import Array, Pose
from magfold_env.engine.workspace import new_nodes
from magfold_env.laws import exact_magnets
from magfold_env.reporting.timing import enough_repeats
from magfold_env.scene import Magnets, Scene
from magfold_env.simulation.pack import charges, quadrature_of
from magfold_env.simulation.quadrature import Rule, choose_rule


@dataclass(frozen=True, eq=False)
class Sample:
    """Equally many casings in some states, with the forces that they feel there."""

    scenes: Sequence[Scene]
    """Their poles; they have equal casings and magnets."""
    places: Array
    """Centres (states, n, 2) [m]."""
    headings: Array
    """(states, n) [rad]"""
    force: Array
    """Exact, (states, n, 2) [N]."""
    torque: Array
    """Exact, about the centres, (states, n) [N·m]."""

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.scenes)

    @property
    def first(self) -> Sample:
        """The first state alone."""
        arrays = self.places, self.headings, self.force, self.torque
        return Sample(self.scenes[:1], *(each[:1] for each in arrays))

    def errors(self, loads: Loads) -> Array:
        """Largest error in every state (states,), in forces between two flush opposite faces.

        Of a force, or of a torque over the side.
        """
        force = np.hypot(loads.fx - self.force[..., 0], loads.fy - self.force[..., 1])
        torque = np.abs(loads.torque - self.torque) / self.scenes[0].casing.side
        return np.maximum(force, torque).max(axis=1) / exact_magnets.flush_force(self.scenes[0])


def sample_of(scenes: Sequence[Scene], poses: Sequence[tuple[Array, Array]]) -> Sample:
    """Find the exact forces of scenes in poses: centres (n, 2) and headings (n,) each."""
    exact = [exact_magnets.forces(s, *pose) for s, pose in zip(scenes, poses, strict=True)]
    return Sample(
        scenes,
        np.array([places for places, _ in poses]),
        np.array([headings for _, headings in poses]),
        np.array([force for force, _ in exact]),
        np.array([torque for _, torque in exact]),
    )


class Sums:
    """The engine's sums over the nodes of one kind of magnets, in all states of a sample.

    Parameters
    ----------
    sample
        The states.
    magnets
        Put in place of the scenes' own.
    rule
        How they are summed; None takes what the engine chooses for these magnets.
    """

    def __init__(self, sample: Sample, magnets: Magnets, rule: Rule | None = None) -> None:
        states, n = sample.headings.shape
        casing = sample.scenes[0].casing
        self._magnets = quadrature_of(casing, magnets, rule or choose_rule(magnets))
        self._charge = np.array([charges(scene) for scene in sample.scenes])
        self._poses = pose_of(sample.places, sample.headings)
        self._nodes = new_nodes(self._magnets, n)
        self._out = new_loads(states, n)

    @cached_property
    def _times(self) -> int:
        return enough_repeats(self._evaluate)

    @property
    def evaluations(self) -> int:
        """How many states `work` evaluates."""
        return self._times * len(self._charge)

    def work(self) -> None:
        """Evaluate all states, as often as makes the call cost nothing."""
        self._evaluate(self._times)

    def loads(self) -> Loads:
        """Return the forces and torques."""
        self._evaluate(1)
        return self._out

    def _evaluate(self, times: int) -> None:
        sum_forces(times, self._magnets, self._charge, self._poses, self._nodes, self._out)


def pose_of(places: Array, headings: Array) -> Pose:
    """Return poses of casings, each array of the shape of ``headings``."""
    x, y = (np.ascontiguousarray(places[..., axis]) for axis in range(2))
    return Pose(np.cos(headings), np.sin(headings), x, y)


def new_loads(states: int, n: int) -> Loads:
    """Room for the forces and torques in some states."""
    return Loads(np.zeros((states, n)), np.zeros((states, n)), np.zeros((states, n)))
