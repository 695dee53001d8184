"""Random impacts: the engine's velocities after them against an independent projection."""

import numpy as np
import numpy.typing as npt

from magfold_bench.laws.random_scenes import random_word
from magfold_env.engine import entries as at
from magfold_env.engine.chain.feed import place_all
from magfold_env.engine.contact import boxes
from magfold_env.engine.stepping import dynamics
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.scene import Scene
from magfold_env.shapes import word_to_angles
from magfold_env.simulation.pack import pack
from tests.engine import reference

Extended = npt.NDArray[np.longdouble]

TINY = np.finfo(np.float64).tiny
ROUNDING = 64 * float(np.finfo(np.longdouble).eps)
DEPENDENT = 1e3 * ROUNDING  # share of a column left outside the span of others


def nearest_admissible(
    mass: npt.ArrayLike, jacobian: npt.ArrayLike, velocity: npt.ArrayLike
) -> tuple[Extended, float]:
    """Project a velocity onto those with J v ≥ 0, in the metric of a mass matrix.

    Parameters
    ----------
    mass
        Positive definite, shape (k, k).
    jacobian
        One row a constraint, shape (m, k).
    velocity
        Before the impact, shape (k,).

    Returns
    -------
    velocity : (k,) array
        After it.
    doubt : float
        How far the optimality conditions are violated, relative to the speed before.
    """
    lower = cholesky(np.asarray(mass, dtype=np.longdouble))
    cone = _forward(lower, np.asarray(jacobian, dtype=np.longdouble).T)
    length = np.sqrt((cone**2).sum(axis=0))
    cone = cone[:, length > 0.0] / length[length > 0.0]
    before = lower.T @ np.asarray(velocity, dtype=np.longdouble)
    multiplier = nonnegative_least_squares(cone, -before)
    after = before + cone @ multiplier
    speed = max(float(np.sqrt((before**2).sum())), 1e-300)
    doubt = max(-float((cone.T @ after).min(initial=0.0)), float(abs(after @ (cone @ multiplier))))
    return _backward(lower, after), doubt / speed


def nonnegative_least_squares(matrix: Extended, target: Extended) -> Extended:
    """Minimise |A x − b| over x ≥ 0.

    Raises
    ------
    ArithmeticError
        If the active sets cycle.
    """
    columns = matrix.shape[1]
    x = np.zeros(columns, dtype=np.longdouble)
    passive: list[int] = []
    # A smaller slope may belong to a column in the span of the passive ones.
    small = DEPENDENT * float(np.sqrt((target**2).sum()))
    for _ in range(20 * columns + 20):
        slope = matrix.T @ (target - matrix @ x)
        slope[passive] = -np.inf
        enter = int(np.argmax(slope)) if columns else -1
        if enter < 0 or slope[enter] <= small:
            return x
        passive.append(enter)
        trial = _least_squares(matrix[:, passive], target)
        while (trial <= 0.0).any():
            # Walk from x towards the trial until a multiplier vanishes, and let that row go.
            now, low = x[passive], trial <= 0.0
            way = np.where(low, now - trial, 1.0)
            share = np.where(low, now / np.maximum(way, TINY), np.inf)
            blocking = int(np.argmin(share))
            now += share[blocking] * (trial - now)
            now[blocking] = 0.0
            x[passive] = np.maximum(now, 0.0)
            passive = [k for k in passive if x[k] > 0.0]
            trial = _least_squares(matrix[:, passive], target)
        x[:] = 0.0
        x[passive] = trial
    raise ArithmeticError("no end of active sets")


def _least_squares(matrix: Extended, target: Extended) -> Extended:
    """Minimise |A x − b| by Gram-Schmidt, twice; columns in the span of earlier ones get 0."""
    rows, columns = matrix.shape
    q = np.zeros((rows, columns), dtype=np.longdouble)
    r = np.zeros((columns, columns), dtype=np.longdouble)
    kept: list[int] = []
    for k in range(columns):
        rest = matrix[:, k].copy()
        for _ in range(2):
            share = q[:, kept].T @ rest
            r[kept, k] += share
            rest -= q[:, kept] @ share
        size = np.sqrt((rest**2).sum())
        if size > DEPENDENT:
            r[k, k] = size
            q[:, k] = rest / size
            kept.append(k)
    right = q.T @ target
    x = np.zeros(columns, dtype=np.longdouble)
    for k in reversed(kept):
        x[k] = (right[k] - r[k, k + 1 :] @ x[k + 1 :]) / r[k, k]
    return x


def cholesky(matrix: Extended) -> Extended:
    """Lower triangular L with L Lᵀ equal to the matrix."""
    lower = np.zeros_like(matrix)
    for k in range(len(matrix)):
        done = lower[:, :k] @ lower[k, :k]
        lower[k, k] = np.sqrt(matrix[k, k] - done[k])
        lower[k + 1 :, k] = (matrix[k + 1 :, k] - done[k + 1 :]) / lower[k, k]
    return lower


def _forward(lower: Extended, right: Extended) -> Extended:
    """Solve L x = b."""
    x = np.zeros_like(right)
    for k in range(len(lower)):
        x[k] = (right[k] - lower[k, :k] @ x[:k]) / lower[k, k]
    return x


def _backward(lower: Extended, right: Extended) -> Extended:
    """Solve Lᵀ x = b."""
    x = np.zeros_like(right)
    for k in reversed(range(len(lower))):
        x[k] = (right[k] - lower[k + 1 :, k] @ x[k + 1 :]) / lower[k, k]
    return x


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
