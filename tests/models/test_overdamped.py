"""Strongly damped motions, whose slow part has a velocity far below that of the start: every digit of it counts."""

import mpmath
import numpy as np
import pytest

from vibsim.models.shared.linear_motion import damped_motion, forced_motion


def true_motion(t, stiffness, half, u_0, v_0):
    """Return position and velocity from the characteristic roots, with 60 digits."""
    with mpmath.workdps(60):
        stiffness, half = mpmath.mpf(stiffness), mpmath.mpf(half)
        q = mpmath.sqrt(half**2 - stiffness)
        slow, fast = q - half, -q - half
        a, b = (v_0 - fast * u_0) / (2 * q), (slow * u_0 - v_0) / (2 * q)
        parts = [(a * mpmath.exp(slow * x), b * mpmath.exp(fast * x)) for x in map(mpmath.mpf, t)]
        return np.array([(float(p + q), float(slow * p + fast * q)) for p, q in parts]).T


@pytest.mark.parametrize(
    ("stiffness", "half", "u_0", "v_0", "end"),
    [
        (1.0, 1e5, 1.0, -1e5, 3.0),
        (1.0, 1e5, 1.0, -1.0, 1e5),
        (1e-20, 1.0, 1.0, 1.0, 10.0),
        (0.0, 1.0, 1.0, 1.0, 10.0),
        (1.0, 1.1, 1.0, 2.0, 20.0),
        (1.0, 1e3, 1.0, 0.0, 1e-3),
        (1.0, -1e4, 1.0, 0.0, 1e-2),
    ],
)
def test_both_parts_of_a_strongly_damped_motion_have_their_digits(stiffness, half, u_0, v_0, end):
    t = np.linspace(0.0, end, 17)
    expected = true_motion(t, stiffness, half, u_0, v_0)
    phase = 1.0 + abs(half) * end * (half < 0.0)
    np.testing.assert_allclose(
        damped_motion(t, stiffness, half, u_0, v_0), expected, rtol=3e-15 * phase, atol=0.0
    )


@pytest.mark.parametrize("half", [30.0, 1e3, 1e5])
@pytest.mark.parametrize("rate", [1j, -0.3 + 1j, 0j])
def test_a_forced_velocity_does_not_lose_digits_to_damping(half, rate):
    t = np.linspace(0.0, 20.0, 17)
    with mpmath.workdps(60):
        h, s = mpmath.mpf(half), mpmath.mpmathify(rate)
        q = mpmath.sqrt(h**2 - 1)
        a, b = q - h, -q - h
        weights = [1 / ((x - y) * (x - z)) for x, y, z in ((s, a, b), (a, b, s), (b, s, a))]
        parts = [
            [
                w * x * mpmath.exp(x * mpmath.mpf(time))
                for w, x in zip(weights, (s, a, b), strict=True)
            ]
            for time in t
        ]
        expected = np.array([float(mpmath.re(sum(row))) for row in parts])
    _, v = forced_motion(t, 1.0, half, 0.0, 0.0, [(1.0 + 0j, rate)])
    np.testing.assert_allclose(v, expected, rtol=0.0, atol=2e-15 * np.max(np.abs(expected)))
