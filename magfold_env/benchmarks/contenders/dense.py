"""The paper's equation 39 with dense matrices and a plain sum over poles, beside the engine.

Nothing here uses the engine's kernels: SciPy's solution of these equations is the independent
check of the references that `magfold_env.benchmarks.dynamics.smooth` measures errors against.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.laws.exact_magnets import COULOMB, FACES, faces_of
from magfold_env.laws.mechanics import equation_39, levers
from magfold_env.scene import Scene
from magfold_env.shapes import centres


def accelerations(scene: Scene, angles: Array, rates: Array) -> Array:
    """Return angular accelerations (n,) [rad/s²] of the pinned chain."""
    arm = levers(scene)
    coupling = arm.T @ (scene.masses[:, None] * arm)
    force, torque = magnet_forces(scene, angles)
    force = force + scene.masses[:, None] * np.asarray(scene.gravity.in_plane)
    pull = torque + np.cos(angles) * (arm.T @ force[:, 1]) - np.sin(angles) * (arm.T @ force[:, 0])
    return equation_39(coupling, np.diag(scene.inertias), angles, rates, pull)


def magnet_forces(scene: Scene, angles: Array) -> tuple[Array, Array]:
    """Return forces (n, 2) [N] and torques about the centres (n,) [N·m], node by node.

    Needs a fixed number of nodes a pole face (``magnets.nodes``).
    """
    n, magnets = scene.n, scene.magnets
    if magnets is None:
        return np.zeros((n, 2)), np.zeros(n)
    places = centres(angles, scene.casing.side)
    faces = faces_of(scene, places, angles)
    offset, share = np.polynomial.legendre.leggauss(magnets.nodes or 1)
    along = faces.size[:, :1] / 2.0 * offset
    x = (faces.centre[:, None] + along[..., None] * faces.along[:, None]).reshape(-1, 2)
    charge = np.outer(faces.charge, share / 2.0).ravel()
    height = np.repeat(faces.size[:, 1], offset.size)
    owner = np.repeat(np.arange(n), FACES * offset.size)
    arm, away = x - places[owner], x[:, None] - x[None, :]
    square = (away**2).sum(axis=-1)
    other = owner[:, None] != owner[None, :]
    square[~other] = 1.0
    # The force between two upright lines on one plane: with equal heights H, ρ and √(ρ² + H²).
    half_sum, half_difference = 0.5 * (height[:, None] + height), 0.5 * (height[:, None] - height)
    law = 2.0 / (square * (np.sqrt(square + half_difference**2) + np.sqrt(square + half_sum**2)))
    weight = COULOMB * other * law * charge[:, None] * charge[None, :]
    pull = (weight[..., None] * away).sum(axis=1)
    torque = (arm[:, 0] * pull[:, 1] - arm[:, 1] * pull[:, 0]).reshape(n, -1)
    return pull.reshape(n, -1, 2).sum(axis=1), torque.sum(axis=1)


def solve(scene: Scene, until: float, tolerance: float = 1e-13) -> Array:
    """Return the headings (n,) of the chain at the time ``until`` [s], by SciPy's DOP853 from rest.

    Raises
    ------
    ImportError
        If SciPy is not installed.
    RuntimeError
        If SciPy gives up.
    """
    try:
        integrate: Any = importlib.import_module("scipy.integrate")
    except ImportError as error:
        msg = "the independent check needs SciPy: install the extra, magfold_env[dev]"
        raise ImportError(msg) from error
    n = scene.n

    def slope(_: float, y: Array) -> Array:
        return np.concatenate([y[n:], accelerations(scene, y[:n], y[n:])])

    start = np.zeros(2 * n)
    start[1:n] = np.cumsum(np.asarray(scene.start_angles))
    run: Any = integrate.solve_ivp(
        slope, (0.0, until), start, "DOP853", rtol=tolerance, atol=tolerance
    )
    if not run.success:
        raise RuntimeError(f"SciPy: {run.message}")
    return run.y[:n, -1]
