"""The narrowest strip around a chain's hinges."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_env.scene import strip

JOINTS = st.lists(st.floats(-1.5, 1.5), max_size=11)


def turned(joints, extra=0.0):
    headings = extra + np.cumsum((0.0, *joints))
    return np.cos(headings), np.sin(headings)


@given(JOINTS, st.floats(-3.0, 3.0))
def test_no_direction_of_many_gives_a_narrower_strip(joints, extra):
    cos, sin = turned(joints, extra)
    along, across = strip.narrowest(cos, sin)
    np.testing.assert_allclose(across.min(), -across.max(), atol=1e-12)
    np.testing.assert_allclose(np.diff(across) ** 2 + along**2, 1.0, atol=1e-9)
    # The same chain, turned: neighbouring links are at the same angle.
    link, given_link = along + 1j * np.diff(across), cos + 1j * sin
    np.testing.assert_allclose(
        link[1:] * link[:-1].conj(), given_link[1:] * given_link[:-1].conj(), atol=1e-9
    )
    assert along.sum() >= -1e-9
    hinges = np.concatenate([[0.0], np.cumsum(cos + 1j * sin)])
    turns = np.exp(1j * np.linspace(0.0, np.pi, 361))
    widths = np.ptp(np.imag(hinges[:, None] * turns), axis=0)
    assert np.ptp(across) <= widths.min() + 1e-9


@pytest.mark.parametrize("n", [1, 2, 7])
def test_a_straight_chain_lies_on_the_axis(n):
    along, across = strip.narrowest(np.ones(n), np.zeros(n))
    np.testing.assert_array_equal(along, np.ones(n))
    np.testing.assert_array_equal(across, np.zeros(n + 1))


def test_a_bent_pair_lies_on_the_line_between_its_ends():
    along, across = strip.narrowest(*turned([0.2]))
    np.testing.assert_allclose(along, np.cos(0.1), rtol=1e-12)
    np.testing.assert_allclose(np.abs(across), 0.5 * np.sin(0.1), rtol=1e-12)
