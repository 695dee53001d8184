"""The paper's equation 39 with dense matrices and a plain sum over poles, beside the engine.

Nothing here uses the engine's kernels: SciPy's solution of these equations is the independent
check of the references that `magfold_env.benchmarks.dynamics.smooth` measures errors against.
"""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.scene import Magnets, Scene
from magfold_env.scene.parts import MU0
from magfold_env.shapes import centres

FACE_ANGLES = np.radians([45.0, 135.0, -135.0, -45.0])


def accelerations(scene: Scene, angles: Array, rates: Array) -> Array:
    """Return angular accelerations (n,) [rad/s²] of the pinned chain."""
    n, pitch = scene.n, scene.casing.diagonal
    # Component i's centre is moved by link k < i over its whole length, by its own over half.
    levers = pitch * (np.tril(np.ones((n, n)), -1) + 0.5 * np.eye(n))
    coupling = levers.T @ (scene.masses[:, None] * levers)
    apart = angles[:, None] - angles[None, :]
    mass = coupling * np.cos(apart) + np.diag(scene.inertias)
    force, torque = magnet_forces(scene, angles)
    force = force + scene.masses[:, None] * np.asarray(scene.gravity.in_plane)
    pull = torque + np.cos(angles) * (levers.T @ force[:, 1])
    pull -= np.sin(angles) * (levers.T @ force[:, 0])
    pull -= (coupling * np.sin(apart)) @ rates**2
    return np.asarray(np.linalg.solve(mass, pull), dtype=np.float64)


def magnet_forces(scene: Scene, angles: Array) -> tuple[Array, Array]:
    """Return forces (n, 2) [N] and torques about the centres (n,) [N·m], node by node.

    Needs a fixed number of nodes a pole face (``magnets.nodes``).
    """
    n, magnets = scene.n, scene.magnets
    if magnets is None:
        return np.zeros((n, 2)), np.zeros(n)
    places = centres(angles, scene.casing.side)
    arm, charge, height = _nodes(scene, magnets, angles)
    x = (places[:, None] + arm).reshape(-1, 2)
    away = x[:, None] - x[None, :]
    square = (away**2).sum(axis=-1)
    owner = np.repeat(np.arange(n), arm.shape[1])
    other = owner[:, None] != owner[None, :]
    square[~other] = 1.0
    # The force between two upright lines on one plane: with equal heights H, ρ and √(ρ² + H²).
    half_sum, half_difference = 0.5 * (height[:, None] + height), 0.5 * (height[:, None] - height)
    law = 2.0 / (square * (np.sqrt(square + half_difference**2) + np.sqrt(square + half_sum**2)))
    weight = MU0 / (4.0 * math.pi) * other * law * charge[:, None] * charge[None, :]
    pull = (weight[..., None] * away).sum(axis=1).reshape(n, -1, 2)
    torque = (arm[..., 0] * pull[..., 1] - arm[..., 1] * pull[..., 0]).sum(axis=1)
    return pull.sum(axis=1), torque


def _nodes(scene: Scene, magnets: Magnets, angles: Array) -> tuple[Array, Array, Array]:
    """Return nodes (n, k, 2) [m], relative to the centres, their charges and heights (n·k,)."""
    offset, share = np.polynomial.legendre.leggauss(magnets.nodes or 1)
    turn = angles[:, None] + FACE_ANGLES
    normal = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    along = np.stack([-normal[..., 1], normal[..., 0]], axis=-1)
    outer = scene.casing.side / 2.0 - magnets.by_face("inset")
    across = np.outer(magnets.by_face("width"), offset / 2.0)[..., None]
    arms: list[Array] = []
    charges: list[Array] = []
    for depth, pole in ((outer, 1.0), (outer - magnets.by_face("thickness"), -1.0)):
        arms.append((depth[:, None] * normal)[:, :, None] + across * along[:, :, None])
        charges.append(pole * scene.charges[..., None] * share / 2.0)
    n = scene.n
    arm = np.concatenate([a.reshape(n, -1, 2) for a in arms], axis=1)
    charge = np.concatenate([c.reshape(n, -1) for c in charges], axis=1)
    height = np.tile(np.repeat(magnets.by_face("height"), offset.size), 2 * n)
    return arm, charge.ravel(), height


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
