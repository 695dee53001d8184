"""Banded equations against a full solver's solutions."""

import numpy as np
import pytest

from magfold_env.simulation.banded import solve_banded


@pytest.mark.parametrize(("rows", "half"), [(1, 1), (5, 2), (60, 5)])
def test_solutions_are_those_of_the_full_matrix(rows, half):
    rng = np.random.default_rng(rows)
    band = rng.uniform(-1.0, 1.0, (rows, 2 * half + 1))
    band[:, half] += 2.0 * half + 1.0
    full = np.zeros((rows, rows))
    for row, column in np.ndindex(rows, rows):
        if abs(column - row) <= half:
            full[row, column] = band[row, half + column - row]
    right = rng.normal(size=(rows, 3))
    expected = np.linalg.solve(full, right)
    solve_banded(band, right)
    np.testing.assert_allclose(right, expected, rtol=1e-12, atol=1e-14)
