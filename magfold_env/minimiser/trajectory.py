"""Energies of a recorded fold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magfold_env.engine.chain import articulated
from magfold_env.engine.magnets import outer_field, pairs
from magfold_env.engine.state import Array
from magfold_env.engine.workspace import new_work
from magfold_env.fold import Trajectory
from magfold_env.scene import Scene
from magfold_env.shapes import centres
from magfold_env.simulation.pack import pack

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Energies:
    """Energies of m frames."""

    magnetic: Array
    """Of the magnets that act, an outer field's included, as `Fold.energy` is [J], shape (m,)."""
    kinetic: Array
    """Of all components, those in the tube too [J], shape (m,)."""


def trajectory_energies(scene: Scene, motion: Trajectory) -> Energies:
    """Return the energies of a recorded motion.

    A trajectory holds the rates of the headings, and no velocity of the chain as a whole. That
    follows from the feed while a component is in the tube; later from central differences of the
    centre of mass, which impacts within the chain do not make jump.

    Parameters
    ----------
    scene
        That was simulated; nothing in it may be left to chance.
    motion
        Its trajectory, all of it finite.
    """
    return Energies(_magnetic(scene, motion), _kinetic(scene, motion))


def loaded(scene: Scene, released: ArrayLike) -> Flags:
    """Return which components have their magnets, component 1 first.

    All, unless the scene loads them at the mouth: then those released, and the one on its way out.

    Parameters
    ----------
    scene
        Gives the tube.
    released
        Numbers of components out of the tube, shape (m,).

    Returns
    -------
    (m, n) array of bool
    """
    count = np.asarray(released)[:, None]
    if scene.mount != "tube" or scene.feed.loading == "preloaded":
        return np.ones((len(count), scene.n), dtype=np.bool_)
    return turns(scene) < count + 1


def turns(scene: Scene) -> NDArray[np.int64]:
    """Return how many components leave the tube before each, shape (n,)."""
    numbers = np.arange(scene.n)
    backward = scene.mount == "tube" and scene.feed.direction == "backward"
    return numbers[::-1] if backward else numbers


def _acting(scene: Scene, released: NDArray[np.int64]) -> Flags:
    """Return whose magnets act, shape (m, n).

    Those of the released components and, in the tube, of the loaded ones behind them, up to the
    first component without any magnet.
    """
    turn = turns(scene)
    has_magnets = loaded(scene, released) & scene.charges.any(axis=1)
    out = turn < released[:, None]
    # Turns are their own inverse: they also put components in the order in which they leave.
    unbroken = np.logical_and.accumulate((out | has_magnets)[:, turn], axis=1)
    return unbroken[:, turn] & has_magnets


def _magnetic(scene: Scene, motion: Trajectory) -> Array:
    # A pinned chain is indexed from component 1, as a trajectory is.
    model = pack(scene.replace(mount="pinned"))
    found = np.zeros(len(motion))
    if not model.magnetic:
        return found
    work = new_work(model._replace(contact=False, frictional=False))
    acting = _acting(scene, motion.released)
    coordinates = np.concatenate([motion.angles, motion.base], axis=1)
    for k, q in enumerate(coordinates):
        charge = model.charge * acting[k, :, None]
        articulated.place(0, model.bodies, q, work.pose)
        found[k] = pairs.energy(0, model.magnets, charge, work.pose, work.nodes)
        if model.field.present:
            frame = model._replace(charge=charge)
            found[k] += outer_field.field_energy(0, frame, work.pose, work.nodes)
    return found


def _kinetic(scene: Scene, motion: Trajectory) -> Array:
    lever = scene.casing.diagonal * motion.rates
    turning = np.stack([-lever * np.sin(motion.angles), lever * np.cos(motion.angles)], axis=-1)
    # A component's centre is moved by those before it over their lengths, by itself over half.
    velocity = np.cumsum(turning, axis=1) - turning / 2.0
    velocity += _base_velocity(scene, motion, velocity, turning.sum(axis=1))[:, None]
    moving = np.einsum("i,mia,mia->m", scene.masses, velocity, velocity)
    return 0.5 * (moving + motion.rates**2 @ scene.inertias)


def _base_velocity(scene: Scene, motion: Trajectory, inner: Array, end: Array) -> Array:
    """Return the velocity of component 1's outer hinge [m/s], shape (m, 2).

    Parameters
    ----------
    scene, motion
        As in `trajectory_energies`.
    inner
        Velocities of the centres relative to it [m/s], shape (m, n, 2).
    end
        And of component n's outer hinge, shape (m, 2).
    """
    velocity = np.zeros_like(motion.base)
    if scene.mount == "pinned":
        return velocity
    held = motion.released < scene.n
    leaving = turns(scene)[motion.released[held]]  # turns are their own inverse
    velocity[held, 0] = scene.speeds[leaving]
    if scene.feed.direction == "forward":
        velocity[held] -= end[held]
    free = ~held
    if free.sum() > 1:
        share = scene.masses / scene.masses.sum()
        place = centres(motion.angles[free], scene.casing.side, motion.base[free])
        drift = np.gradient(np.einsum("i,mia->ma", share, place), motion.time[free], axis=0)
        velocity[free] = drift - np.einsum("i,mia->ma", share, inner[free])
    return velocity
