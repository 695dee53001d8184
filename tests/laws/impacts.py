"""Random impacts: the engine's velocities after them against an independent projection."""

import numpy as np
from scipy.optimize import nnls

from magfold_bench.laws.random_scenes import random_word
from magfold_env.engine import entries as at
from magfold_env.engine.chain.feed import place_all
from magfold_env.engine.contact import boxes
from magfold_env.engine.stepping import dynamics
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.scene import Scene
from magfold_env.shapes import FloatArray, word_to_angles
from magfold_env.simulation.pack import pack
from tests.engine import reference


def nearest_admissible(
    mass: FloatArray, jacobian: FloatArray, velocity: FloatArray
) -> tuple[FloatArray, float]:
    """Return the velocity with J v ≥ 0 that is nearest in the metric of a mass matrix, and a doubt.

    The doubt is how far the optimality conditions are violated, relative to the speed before.
    """
    # With M = L Lᵀ the distance is Euclidean in Lᵀ v, and the dual a non-negative least squares.
    lower = np.linalg.cholesky(mass)
    cone = np.linalg.solve(lower, jacobian.T)
    length = np.linalg.norm(cone, axis=0)
    cone = cone[:, length > 0.0] / length[length > 0.0]
    if cone.size == 0:  # which SciPy does not take
        return velocity, 0.0
    before = lower.T @ velocity
    taken = np.flatnonzero(nnls(cone, -before)[0])
    change = cone[:, taken] @ np.linalg.lstsq(cone[:, taken], -before, rcond=None)[0]
    after = before + change
    doubt = max(-float((cone.T @ after).min(initial=0.0)), abs(float(after @ change)))
    return np.linalg.solve(lower.T, after), doubt / max(float(np.linalg.norm(before)), 1e-300)


SMALLEST, LARGEST = 5, 12  # components; four apart, squares can meet
PINNED = 0.3  # share of the chains
MOST_CONTACTS = 4
NEVER_SLOW = -1.0  # keeps the rule that ends rocking, which is no part of the law, out of this
CERTAIN = 1e-13  # doubt up to which the independent projection counts


def impact_error(seed: int) -> float | None:
    """Return by how much the velocity after a random impact violates the law.

    The distance from the independent projection in the metric of the mass matrix, relative to
    the speed before. Odd seeds are folded shapes with most joints at their stops, even ones any
    shape. None if the independent projection is in doubt.

    Raises
    ------
    ArithmeticError
        If the engine finds no velocity.
    """
    rng = np.random.default_rng([seed, 3])
    n = int(rng.integers(SMALLEST, LARGEST + 1))
    mount = "pinned" if rng.random() < PINNED else "free"
    scene = Scene(sequence=("NNNN",) * n, magnets=None, mount=mount)
    model = pack(scene)
    state, work = new_state(model, np.zeros(n)), new_work(model)
    joints = rng.uniform(-np.pi / 2, np.pi / 2, n - 1)
    share = 0.5
    if seed % 2 == 1:
        joints, share = word_to_angles(random_word(rng, n)), 0.9
    state.q[1:n] = np.cumsum(joints)
    place_all(0, model, state.q, work.pose)
    boxes.place_boxes(0, model, work.pose, work)
    at_stop = np.flatnonzero(rng.random(n - 1) < share)
    row = 0
    for joint in at_stop:
        work.rows.id[row, :2] = joint + 1, 1 if joints[joint] > 0.0 else -1
        row += 1
    work.rows.counts[at.JOINT_STOPS] = row
    for _ in range(int(rng.integers(0, MOST_CONTACTS + 1))):
        # Rows are linear: for the projection it does not matter how wide the gaps are.
        i = int(rng.integers(0, n - boxes.APART)) if n > boxes.APART else 0
        work.rows.id[row, :3] = i, rng.integers(i + boxes.APART, n), rng.integers(4)
        row += 1
    work.rows.counts[1:] = row
    free = n + 2 if mount == "free" else n
    before = np.append(rng.normal(0.0, 10.0, n), rng.normal(0.0, 0.3, 2))
    before[free:] = 0.0
    after = before.copy()
    if not dynamics.project(model, state, after, work, NEVER_SLOW):
        raise ArithmeticError(f"no velocity after the impact of seed {seed}")
    mass = reference.mass_matrix(state.q, scene.casing.side, scene.masses, scene.inertias)[
        :free, :free
    ]
    expected, doubt = nearest_admissible(mass, work.rows.jacobian[:row, :free], before[:free])
    if doubt > CERTAIN:
        return None
    off = after[:free] - expected
    return float(np.sqrt(off @ mass @ off / (before[:free] @ mass @ before[:free])))
