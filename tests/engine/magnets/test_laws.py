"""Tests of the laws between two nodes of pole faces, and of the step that blends two sums."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import constants

from magfold_bench.laws import exact_magnets
from magfold_env.engine.magnets import laws, pairs
from tests.engine import reference


def test_the_constant_is_codatas():
    for found in (laws.COULOMB, exact_magnets.COULOMB):
        assert found == pytest.approx(constants.mu_0 / (4 * np.pi), rel=1e-9)


@given(
    height=st.floats(1e-3, 1e-2),
    share=st.sampled_from([0.05, 0.5, 0.9, 1.0]),
    exponent=st.floats(-3.5, -1.0),
    strips=st.booleans(),
)
def test_node_force_is_the_node_energys_derivative(height, share, exponent, strips):
    r, even = 10**exponent, share == 1.0
    sum2, difference2 = ((1 + share) / 2 * height) ** 2, ((1 - share) / 2 * height) ** 2
    slope = reference.derivative(
        lambda t: laws.node_law(strips, even, sum2, difference2, (r + t) ** 2)[1], 1e-2 * r
    )
    force = laws.node_force(strips, sum2, difference2, r * r)
    found = laws.node_law(strips, even, sum2, difference2, r * r)[0]
    assert -slope == pytest.approx(force * r, rel=1e-8)
    assert found == pytest.approx(force, rel=1e-14)


@given(height=st.floats(1e-3, 1e-2), share=st.floats(0.1, 0.999), exponent=st.floats(-3.5, -1.0))
def test_nodes_of_unequal_heights_are_lines_of_charge(height, share, exponent):
    # Both lines as many charges, midpoints of equal parts.
    r, other, count = 10**exponent, share * height, 4000
    z = height * ((np.arange(count) + 0.5) / count - 0.5)
    # The field of the other line, in the plane's direction, is closed.
    top, bottom = other / 2 - z, -other / 2 - z
    field = (top / np.hypot(top, r) - bottom / np.hypot(bottom, r)) / (r * other)
    sum2, difference2 = ((height + other) / 2) ** 2, ((height - other) / 2) ** 2
    force = laws.node_force(True, sum2, difference2, r * r) * r
    assert force == pytest.approx(field.mean(), rel=1e-5)
    even = laws.node_law(True, True, sum2, 0.0, r * r)
    uneven = laws.node_law(True, False, sum2, 0.0, r * r)
    np.testing.assert_allclose(uneven, even, rtol=1e-13)


@pytest.mark.parametrize("ratio", np.linspace(0.98, 1.12, 29))
def test_blend_has_the_derivative_it_states(ratio):
    weight, slope = laws.step_down(ratio, pairs.BLEND)
    assert 0.0 <= weight <= 1.0
    measured = reference.derivative(lambda t: laws.step_down(ratio + t, pairs.BLEND)[0], 1e-6)
    assert slope == pytest.approx(measured, abs=1e-6)
