"""Exercise 15, and the operators on polynomials and waves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vibsim.theory import differences as d

VALUES = st.lists(st.integers(-(2**40), 2**40), min_size=3, max_size=30)
STEPS = st.integers(-8, 8).map(lambda power: 2.0**power)


@given(VALUES, STEPS)
def test_the_second_difference_is_forward_of_backward_and_backward_of_forward(values, dt):
    """Whole numbers and a power of two: nothing is rounded, so the three are equal bit for bit."""
    u = np.array(values, dtype=float)
    second = d.second_difference(u, dt)
    np.testing.assert_array_equal(second, d.forward_difference(d.backward_difference(u, dt), dt))
    np.testing.assert_array_equal(second, d.backward_difference(d.forward_difference(u, dt), dt))


@given(VALUES, STEPS)
def test_the_centred_difference_is_the_mean_of_forward_and_backward(values, dt):
    u = np.array(values, dtype=float)
    forward, backward = d.forward_difference(u, dt)[1:], d.backward_difference(u, dt)[:-1]
    np.testing.assert_array_equal(d.centred_difference(u, dt), (forward + backward) / 2)
    np.testing.assert_array_equal(d.centred_difference(u, dt), d.mean(d.forward_difference(u, dt)))


def test_polynomials():
    t = np.arange(8) * 0.5
    np.testing.assert_array_equal(d.second_difference(3 * t**2, 0.5), 6)
    np.testing.assert_array_equal(d.centred_difference(t**2, 0.5), 2 * t[1:-1])
    np.testing.assert_array_equal(d.second_difference(np.stack([t, t**2]), 0.5)[1], 2)


@pytest.mark.parametrize("p", [0.1, 1.0, 2.0, np.pi])
def test_the_error_fraction_is_that_of_a_wave(p):
    """Exercise 7, with u = cos(w t) at w = 1: p = dt."""
    u = np.cos(np.arange(5) * p)
    np.testing.assert_allclose(
        d.second_difference(u, p), -d.error_fraction(p) * u[1:-1], rtol=1e-12, atol=1e-13 / p**2
    )
    assert d.error_fraction(0.0) == 1
