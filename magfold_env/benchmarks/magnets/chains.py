"""Chains in many states, under the kernels of the dynamics."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from magfold_env.benchmarks.magnets.casings import new_loads, pose_of
from magfold_env.benchmarks.magnets.kernels import Loads, States, chain_forces
from magfold_env.engine.state import Array, IntArray
from magfold_env.engine.workspace import new_nodes, new_rigid
from magfold_env.reporting.timing import Task, enough_repeats
from magfold_env.scene import Scene
from magfold_env.shapes import centres
from magfold_env.simulation.pack import pack


class Chain:
    """The magnets of one chain in some states, with everything the dynamics do to save work.

    Parameters
    ----------
    scene
        Contact, where it is on, lets nearby components be looked up.
    states
        Where the chain is.
    once
        Whether `work` evaluates every state once, and not as often as makes its call cost nothing.
    """

    def __init__(self, scene: Scene, states: States, *, once: bool = False) -> None:
        self._model = pack(scene)
        self._states = states
        self._nodes = new_nodes(self._model.magnets, scene.n)
        self._rigid = new_rigid(self._model.magnets, scene.n)
        self._out = new_loads(states.first.size, scene.n)
        self._times = 1 if once else enough_repeats(self._evaluate)
        self.evaluations = self._times * states.first.size

    def work(self) -> None:
        """Evaluate all states, `evaluations` times in all."""
        self._evaluate(self._times)

    def task(self) -> Task:
        """Return the work as something to time."""
        return lambda: self.work

    def loads(self) -> Loads:
        """Return forces and torques; look-ups give torques alone, which turn joints alike."""
        self._evaluate(1)
        return self._out

    def _evaluate(self, times: int) -> None:
        chain_forces(times, self._model, self._states, self._nodes, self._rigid, self._out)


def pinned_states(headings: Sequence[Array], side: float) -> States:
    """Return states of a pinned chain with given headings (n,) [rad]."""
    angles = np.array(headings)
    places = np.array([centres(one, side) for one in angles])
    none: IntArray = np.zeros(len(angles), dtype=np.int64)
    q = np.concatenate([angles, np.zeros((len(angles), 2))], axis=1)
    return States(none, none, q, pose_of(places, angles))


def joint_torques(loads: Loads, states: States, side: float) -> Array:
    """Torques (states, n − 1) with which forces and torques on components turn the joints [N·m].

    That is the moment about a hinge of everything beyond it.
    """
    poses = states.poses
    half = side / np.sqrt(2.0)
    # Inner hinges of the components.
    x, y = poses.x - half * poses.cos, poses.y - half * poses.sin
    beyond = [np.cumsum(each[:, ::-1], axis=1)[:, ::-1] for each in _moments(loads, states)]
    moment, fx, fy = beyond
    return (moment - (x * fy - y * fx))[:, 1:]


def _moments(loads: Loads, states: States) -> tuple[Array, Array, Array]:
    """Moments about the origin, and forces, of the components, (states, n) each."""
    poses = states.poses
    moment = loads.torque + poses.x * loads.fy - poses.y * loads.fx
    return moment, loads.fx, loads.fy
