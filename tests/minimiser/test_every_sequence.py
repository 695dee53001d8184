"""Tests of all sequences of a short chain against the energies of each one."""

import numpy as np
import pytest

from magfold_env.minimiser import every_ground_state, sequence_of
from magfold_env.minimiser.energies import quadratic_forms, signs
from magfold_env.minimiser.lattice import all_words
from magfold_env.scene import Scene
from tests.minimiser.scenes import scene_of


def test_sequences_are_numbered_in_alphabetical_order_if_not_too_long() -> None:
    names = [sequence_of(number, 2) for number in range(256)]
    assert names == sorted(names)
    assert len(set(names)) == 256
    assert names[5] == ("NNNN", "NSNS")
    with pytest.raises(ValueError, match=r"7 components are not allowed; .* at most 6"):
        every_ground_state(Scene(sequence=("NSNS",) * 7))


@pytest.mark.parametrize("n", [2, 3])
def test_every_sequence_is_each_one(n: int) -> None:
    scene = scene_of(("NNNN",) * n, "points")
    s = np.array([signs(sequence_of(number, n)).ravel() for number in range(1 << (4 * n - 1))])
    forms = quadratic_forms(scene, all_words(n))
    expected = np.einsum("ka,wab,kb->kw", s, forms, s, optimize=True)
    found = every_ground_state(scene)
    lowest = np.sort(expected, axis=1)
    scale = 1e-12 * np.abs(expected).max()
    np.testing.assert_allclose(found.energy, lowest[:, 0], atol=scale)
    np.testing.assert_allclose(found.gap, lowest[:, 1] - lowest[:, 0], atol=scale)
    unique = found.gap > found.tie
    np.testing.assert_array_equal(found.word[unique], expected.argmin(axis=1)[unique])
    assert sum(found.counts().values()) == unique.sum()
