"""Duffing's free motion near turning points and between two kinds of orbit, against 30 digits."""

from itertools import product

import mpmath
import numpy as np
import pytest
from thinned import thinned

from vibsim.models.shared.cubic import motion, period

T = np.linspace(0.0, 4.0, 9)


def solved(alpha, beta, u, v, times=T):
    """Return position and velocity by Taylor series."""
    with mpmath.workdps(30):
        alpha, beta = mpmath.mpf(alpha), mpmath.mpf(beta)
        flow = mpmath.odefun(
            lambda t, y: [y[1], -alpha * y[0] - beta * y[0] ** 3], 0, [mpmath.mpf(u), mpmath.mpf(v)]
        )
        return np.array([[float(x) for x in flow(time)] for time in times]).T


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "speed"), thinned(product([1.44, -1.6, 0.5, -0.9], [1e-12, -1e-8, 3e-6]), 2)
)
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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("alpha", "beta", "u", "v", "accuracy"),
    [
        # from the bottom of the hill between two wells, on either side of its energy
        (-1.0, 1.0, 0.0, 1e-8, 1e-13),
        (-1.0, 1.0, 1e-8, 0.0, 1e-13),
        (-1.0, 1.0, -1e-5, 2e-5, 1e-13),
        # just within a well from which a motion may escape: 1 - u is known to eps/(1 - u)
        (1.0, -1.0, 1.0 - 1e-9, 0.0, 1e-8),
        (1.0, -1.0, -0.999, 0.0, 1e-12),
    ],
)
def test_near_the_border_of_two_kinds_of_orbit_the_motion_is_right(alpha, beta, u, v, accuracy):
    times = np.linspace(0.0, 21.0, 7)
    expected = solved(alpha, beta, u, v, times)
    for ours, theirs in zip(motion(times, alpha, beta, u, v), expected, strict=True):
        size = np.max(np.abs(theirs))
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=accuracy * size)


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-12])
def test_the_period_of_a_wide_swing_in_a_softening_well(gap):
    """``4 K(m)/sqrt(1 - u^2/2)`` with ``m = u^2/(2 - u^2)``; the start is the double next to 1 - gap."""
    with mpmath.workdps(50):
        u = mpmath.mpf(1.0 - gap)
        expected = 4 * mpmath.ellipk(u**2 / (2 - u**2)) / mpmath.sqrt(1 - u**2 / 2)
    assert float(period(1.0, -1.0, 1.0 - gap, 0.0)) == pytest.approx(
        float(expected), rel=1e-13 + 1e-16 / gap
    )


def test_a_start_whose_energy_overflows_has_no_motion_and_no_warning():
    for place in (1e100, -1e200):
        assert np.isnan(motion(T, 1.0, 1.0, place, 0.0)).all()


def test_a_start_outside_a_well_escapes_though_its_energy_is_below_the_barrier():
    """The force ``u^3 - u`` points outward beyond 1; the energy at the barrier is 1/4."""
    for place in (1.2, -1.3):
        assert 0.0 < place**2 / 2 - place**4 / 4 < 0.25
        assert np.isnan(motion(T, 1.0, -1.0, place, 0.0)).all()
        assert np.isnan(period(1.0, -1.0, place, 0.0))
