"""Casings and chains in many states, with exact forces and the engine's forces.

One compiled loop evaluates all states, so that the cost of calls is negligible.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from magfold_bench import timing
from magfold_bench.laws import exact_magnets
from magfold_bench.laws.overlap import squares_apart
from magfold_bench.laws.random_scenes import random_sequence
from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.magnets.pairs import add_forces
from magfold_env.engine.state import Array, Loads, Nodes, Pose
from magfold_env.engine.state import Magnets as Packed
from magfold_env.engine.workspace import new_nodes
from magfold_env.scene import Magnets, Scene
from magfold_env.shapes import centres, folded_words, word_to_angles
from magfold_env.shapes import headings as joint_headings
from magfold_env.simulation.pack import charges, quadrature_of
from magfold_env.simulation.quadrature import choose_rule

FOLDED_SHARES = (0.05, 0.4, 0.8, 0.98, 1.0)  # factors of the joints' right angles
ROUNDING = 1e-9  # of the side: casings that overlap by less only touch
FARTHEST = 0.1  # [m] largest gap of a random pair
EDGES = np.radians([45.0, 135.0])  # normals of a casing's edges, from its heading


def random_scene(rng: np.random.Generator, n: int) -> Scene:
    """Return a chain with random poles and the default magnets."""
    return Scene(sequence=random_sequence(rng, n), magnets=Magnets())


def random_pair(rng: np.random.Generator, side: float) -> tuple[Array, Array]:
    """Return centres (2, 2) [m] and headings (2,) [rad] of two casings that touch or are close.

    A third of the pairs lie flush, some of them displaced along each other; a third touch at any
    angle; the others have a log-uniform gap.
    """
    kind = rng.integers(3)
    if kind == 0:
        aside = side * rng.uniform(-1.2, 1.2) * rng.integers(2)
        gap = rng.choice([0.0, 1e-3]) * rng.random()
        places = np.array([[0.0, 0.0], [aside, side + gap]])
        headings = math.pi / 4.0 + np.array([0.0, rng.integers(4) * math.pi / 2.0])
    else:
        bearing, heading = rng.uniform(-math.pi, math.pi, 2)
        gap = 0.0 if kind == 1 else math.exp(rng.uniform(math.log(1e-5), math.log(FARTHEST)))
        headings = np.array([0.0, heading])
        direction = np.array([math.cos(bearing), math.sin(bearing)])
        angles = np.add.outer(headings, EDGES).ravel()
        normals = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        # Half the sum of both squares' projections on a normal of either one's edges.
        reach = 0.5 * side * (1.0 + abs(np.cos(heading)) + abs(np.sin(heading)))
        along = np.abs(normals @ direction).max()
        places = (reach + gap) / along * np.stack([np.zeros(2), direction])
    return places, headings


def random_shape(rng: np.random.Generator, n: int, side: float) -> Array:
    """Draw headings (n,) [rad] of a chain without overlap, from folded to nearly straight."""
    while True:
        share = rng.choice(FOLDED_SHARES)
        headings = joint_headings(word_to_angles(rng.choice(folded_words(n))) * share)
        if squares_apart(centres(headings, side), headings, side) > -ROUNDING * side:
            return headings


def unfolded(n: int) -> Array:
    """Return headings (n,) [rad] of a chain with a small zigzag, like a chain before it folds."""
    return 0.03 * np.tile([1.0, -1.0], n)[:n]


def folded(n: int) -> Array:
    """Return headings (n,) [rad] of a chain of any length that is folded into a compact block.

    The chain forms staircases of about √n casings each, up and down by turns, side by side. Every
    joint is at its left or right stop, and no casings overlap.
    """
    most = max(2 * round(math.sqrt(n) / 2.0), 2)
    east, north = 0, 1
    quarters: list[int] = []
    while len(quarters) < n:
        quarters += [east, north] * (most // 2)
        # Go west from the last step north, then down along the staircase's left side.
        quarters += [2, 3] * (most // 2)
        # Go west again; the next staircase begins with a step north.
        quarters += [2, north]
    # Unwrapped, the headings differ by the joint angles.
    return np.unwrap(np.array(quarters[:n]) * (math.pi / 2.0))


@dataclass(frozen=True, eq=False)
class Sample:
    """A fixed number of casings in several states, with their exact forces."""

    scenes: Sequence[Scene]
    """One scene per state, with its poles; all have equal casings and magnets."""
    places: Array
    """Centres (states, n, 2) [m]."""
    headings: Array
    """Headings (states, n) [rad]."""
    exact: Loads
    """Forces and torques on the casings: arrays of shape (states, n)."""

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.scenes)

    def errors(self, loads: Loads) -> Array:
        """Return the largest error in each state (states,), in units of the force of flush faces.

        Both the errors of forces and those of torques, divided by the side, count.
        """
        force = np.hypot(loads.fx - self.exact.fx, loads.fy - self.exact.fy)
        torque = np.abs(loads.torque - self.exact.torque) / self.scenes[0].casing.side
        return np.maximum(force, torque).max(axis=1) / exact_magnets.flush_force(self.scenes[0])


def sample_of(scenes: Sequence[Scene], poses: Sequence[tuple[Array, Array]]) -> Sample:
    """Return a sample of scenes in poses, each with centres (n, 2) [m] and headings (n,) [rad]."""
    places, headings = (np.array(arrays) for arrays in zip(*poses, strict=True))
    exact = [exact_magnets.forces(s, *pose) for s, pose in zip(scenes, poses, strict=True)]
    force, torque = (np.array(arrays) for arrays in zip(*exact, strict=True))
    return Sample(scenes, places, headings, Loads(force[..., 0], force[..., 1], torque))


@allocating_kernel
def sum_forces(
    times: int, magnets: Packed, charge: Array, poses: Pose, nodes: Nodes, out: Loads
) -> None:
    """Compute forces repeatedly by sums over the nodes of casings in any pose.

    The outer pole faces have the charges ``charge`` (states, n, 4) [A·m]; each array of the poses
    and of the result has the shape (states, n).
    """
    for _ in range(times):
        for k in range(charge.shape[0]):
            pose = Pose(poses.cos[k], poses.sin[k], poses.x[k], poses.y[k])
            loads = Loads(out.fx[k], out.fy[k], out.torque[k])
            for i in range(loads.fx.size):
                loads.fx[i] = 0.0
                loads.fy[i] = 0.0
                loads.torque[i] = 0.0
            add_forces(0, magnets, charge[k], pose, nodes, loads)


class Sums:
    """The engine's sums over nodes in all states of a sample, with given magnets."""

    def __init__(self, sample: Sample, magnets: Magnets) -> None:
        casing, shape = sample.scenes[0].casing, sample.headings.shape
        packed = quadrature_of(casing, magnets, choose_rule(magnets))
        charge = np.array([charges(scene) for scene in sample.scenes])
        x, y = (np.ascontiguousarray(sample.places[..., axis]) for axis in range(2))
        poses = Pose(np.cos(sample.headings), np.sin(sample.headings), x, y)
        self._given = packed, charge, poses, new_nodes(packed, shape[1])
        self._out = Loads(*(np.zeros(shape) for _ in range(3)))
        self._size = sample.size

    @cached_property
    def _times(self) -> int:
        return timing.enough_repeats(self._evaluate)

    @property
    def evaluations(self) -> int:
        """Number of states that `work` evaluates, enough to make the cost of a call negligible."""
        return self._times * self._size

    def work(self) -> None:
        """Evaluate all states repeatedly, `evaluations` in total."""
        self._evaluate(self._times)

    def loads(self) -> Loads:
        """Return the forces and torques in all states."""
        self._evaluate(1)
        return self._out

    def _evaluate(self, times: int) -> None:
        sum_forces(times, *self._given, self._out)
