"""Moreau's impact law by other means: the nearest admissible velocity, in extended precision.

With M = L Lᵀ and u = Lᵀ v, "nearest in the mass metric" is plain distance. The change of u is
C λ with C = L⁻¹ Jᵀ, and λ ≥ 0 solves the least squares problem min |C λ + u|, here by Lawson and
Hanson's active sets with orthogonal factors, which never squares the condition of C.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

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
