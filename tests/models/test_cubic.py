"""Duffing's free motion in a well that starts close to a turning point, against 30 digits."""

import mpmath
import numpy as np
import pytest

from vibsim.models.cubic import motion

T = np.linspace(0.0, 4.0, 9)


def solved(alpha, beta, u, v):
    """Return position and velocity at `T` by Taylor series."""
    with mpmath.workdps(30):
        alpha, beta = mpmath.mpf(alpha), mpmath.mpf(beta)
        flow = mpmath.odefun(
            lambda t, y: [y[1], -alpha * y[0] - beta * y[0] ** 3], 0, [mpmath.mpf(u), mpmath.mpf(v)]
        )
        return np.array([[float(x) for x in flow(time)] for time in T]).T


@pytest.mark.parametrize("speed", [1e-12, -1e-8, 3e-6])
@pytest.mark.parametrize("place", [1.44, -1.6, 0.5, -0.9])
def test_a_tiny_speed_near_a_turning_point_keeps_its_digits(place, speed):
    found = motion(T, -1.3, 0.9, place, speed)
    expected = solved(-1.3, 0.9, place, speed)
    size = np.max(np.abs(expected), axis=1)
    for ours, theirs, most in zip(found, expected, size, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-13 * most)


def test_a_small_swing_at_the_bottom_of_a_well_is_harmonic():
    for speed in (1e-9, -1e-9):
        u, v = motion(T, -1.0, 1.0, 1.0, speed)
        w = np.sqrt(2.0)
        np.testing.assert_allclose(v, speed * np.cos(w * T), rtol=0.0, atol=1e-6 * abs(speed))
        np.testing.assert_allclose(u, 1.0 + speed * np.sin(w * T) / w, rtol=0.0, atol=1e-15)
