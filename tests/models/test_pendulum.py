"""Exact solutions against 40 digits, and the energies against each other."""

import math
from pathlib import Path

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vibsim import Experiment, simulate
from vibsim.models import MODELS
from vibsim.models.shared.elliptic import agm_quarter_period, carlson_rf, jacobi

UNIT = {"g": 1.0, "L": 1.0, "m": 1.0}


def pendulum_at(t, theta, omega, g, length):
    """Motion of the pendulum from mpmath's elliptic functions, 40 digits and more."""
    with mpmath.workdps(50):
        theta, omega, g, length, t = map(mpmath.mpf, (theta, omega, g, length, t))
        w = mpmath.sqrt(g / length)
        turns = mpmath.nint(theta / (2 * mpmath.pi))
        half, speed = theta / 2 - mpmath.pi * turns, omega / (2 * w)
        k = mpmath.sqrt(mpmath.sin(half) ** 2 + speed**2)
        if k < 1:
            u = w * t + mpmath.ellipf(mpmath.atan2(mpmath.sin(half), speed), k**2)
            sn, cn, dn = (mpmath.ellipfun(name, u, m=k**2) for name in ("sn", "cn", "dn"))
            return 2 * mpmath.atan2(k * sn, dn) + 2 * mpmath.pi * turns, 2 * w * k * cn
        sign, m = mpmath.sign(speed), 1 / k**2
        u = w * k * t + mpmath.ellipf(sign * half, m)
        quarter = mpmath.ellipk(m)
        n = mpmath.nint(u / (2 * quarter))
        sn, cn, dn = (
            mpmath.ellipfun(name, u - 2 * quarter * n, m=m) for name in ("sn", "cn", "dn")
        )
        angle = 2 * sign * (mpmath.atan2(sn, cn) + mpmath.pi * n) + 2 * mpmath.pi * turns
        return angle, 2 * sign * w * k * dn


CASES = [
    (1, 0, 1, 1),
    (3.1, 0, 1, 1),
    (3, 0.1, 1, 1),
    (3.14159, 0, 1, 1),
    (0, 2.0000001, 1, 1),
    (0, 1.9999999, 1, 1),
    (0.1, 3, 9.8, 4.9),
    (7, -3, 1, 1),
    (-2, 1, 9.81, 0.3),
    (1e-6, 0, 1, 1),
    (0, -5, 1, 1),
    (-9.5, 0.3, 2, 1),
    (3.140625, 1, 1, 1),
    (-3.14159, -2.5, 3, 1),
    *(
        tuple(row)
        for row in np.random.default_rng(3).uniform((-8, -8, 0.1, 0.1), (8, 8, 10, 10), (30, 4))
    ),
]


@pytest.mark.parametrize(("theta", "omega", "g", "length"), CASES)
def test_motion_against_fifty_digits(theta, omega, g, length):
    t = np.array([0.0, 0.7, 20.0, 100.0])
    parameters = {"g": g, "L": length, "m": 1.0}
    computed = MODELS["pendulum"].exact(t, {"theta": theta, "omega": omega}, parameters)
    w = math.sqrt(g / length)
    for i, time in enumerate(t):
        true = pendulum_at(time, theta, omega, g, length)
        for name, value in zip(("theta", "omega"), true, strict=True):
            scale = (1 + w * time) * max(1.0, abs(float(true[0])), abs(float(true[1])))
            assert computed[name][i] == pytest.approx(float(value), abs=4 * 2.0**-52 * scale)


def test_published_value():
    """Lecture's experiment: theta_0 = 1 at rest, t = 20."""
    exact = MODELS["pendulum"].exact(np.array([20.0]), {"theta": 1.0, "omega": 0.0}, UNIT)
    assert exact["theta"][0] == pytest.approx(0.9958006771243681, abs=5e-16)


@settings(max_examples=200, deadline=None)
@given(st.floats(-20, 20), st.floats(-6, 6), st.floats(0.1, 10), st.floats(0.1, 10))
def test_exact_motion_keeps_its_energy(theta, omega, g, length):
    t = np.linspace(0.0, 10.0, 50)
    for name, potential in (
        ("pendulum", lambda angle: 2 * np.sin(angle / 2) ** 2),
        ("linear_pendulum", lambda angle: angle**2 / 2),
    ):
        motion = MODELS[name].exact(
            t, {"theta": theta, "omega": omega}, {"g": g, "L": length, "m": 1.0}
        )
        energy = 0.5 * length * motion["omega"] ** 2 + g * potential(motion["theta"])
        initial = 0.5 * length * omega**2 + g * potential(theta)
        scale = initial + g * 1e-3
        assert np.max(np.abs(energy - initial)) <= 1e-12 * scale
        assert motion["theta"][0] == pytest.approx(theta, abs=1e-13)
        assert motion["omega"][0] == pytest.approx(
            omega, abs=1e-13 * max(1.0, math.sqrt(g / length))
        )


def test_members_are_computed_together_and_alone_alike():
    t = np.linspace(0, 20, 7)
    initial = {
        "theta": np.array([[1.0], [2.0], [0.0], [math.pi]]),
        "omega": np.array([[0.0], [3.0], [0.0], [0.0]]),
    }
    parameters = {"g": np.array([[1.0], [2.0], [1.0], [1.0]]), "L": 1.0, "m": 1.0}
    together = MODELS["pendulum"].exact(t, initial, parameters)
    assert together["theta"].shape == (4, 7)
    for i in range(4):
        alone = MODELS["pendulum"].exact(
            t,
            {name: values[i] for name, values in initial.items()},
            {"g": parameters["g"][i], "L": 1.0, "m": 1.0},
        )
        for name in ("theta", "omega"):
            np.testing.assert_array_equal(alone[name], together[name][i])


def test_periods():
    period = MODELS["pendulum"].exact_period
    theta = np.array([0.0, 1e-8, 1.0, 3.1, 0.0, 0.0])
    omega = np.array([0.0, 0.0, 0.0, 0.0, 2.0, 3.0])
    values = period({"theta": theta, "omega": omega}, UNIT)
    assert math.isnan(values[0])
    assert values[1] == pytest.approx(2 * math.pi, rel=1e-15)
    for i in (2, 3):
        with mpmath.workdps(30):
            true = 4 * mpmath.ellipk(mpmath.sin(mpmath.mpf(theta[i]) / 2) ** 2)
        assert values[i] == pytest.approx(float(true), rel=1e-14)
    assert math.isinf(values[4])
    with mpmath.workdps(30):
        true = 2 * mpmath.ellipk(mpmath.mpf(4) / 9) / mpmath.mpf(1.5)
    assert values[5] == pytest.approx(float(true), rel=1e-14)


def test_linear_period_does_not_depend_on_the_amplitude():
    period = MODELS["linear_pendulum"].exact_period
    values = period(
        {"theta": np.array([0.1, 3.0, 0.0]), "omega": np.zeros(3)}, {"g": 4.0, "L": 1.0, "m": 1.0}
    )
    np.testing.assert_allclose(values[:2], math.pi)
    assert math.isnan(values[2])


def test_separatrix():
    """k = 1 exactly: ``sin(theta/2) = tanh(w t)`` from the bottom."""
    t = np.linspace(0, 30, 31)
    motion = MODELS["pendulum"].exact(t, {"theta": 0.0, "omega": 2.0}, UNIT)
    np.testing.assert_allclose(np.sin(motion["theta"] / 2), np.tanh(t), atol=1e-15)
    np.testing.assert_allclose(motion["omega"], 2 / np.cosh(t), atol=1e-15)


@settings(max_examples=100, deadline=None)
@given(st.floats(1e-30, 1.0), st.floats(-50, 50))
def test_jacobi_functions(complement, u):
    sn, cn, dn, am = (float(x[0]) for x in jacobi(np.array([u]), np.array([complement])))
    assert sn**2 + cn**2 == pytest.approx(1.0, abs=1e-14)
    assert dn**2 + (1 - complement) * sn**2 == pytest.approx(1.0, abs=1e-14)
    assert math.sin(am) == pytest.approx(sn, abs=1e-13)


@settings(max_examples=50, deadline=None)
@given(st.floats(1e-20, 1.0))
def test_integrals(complement):
    with mpmath.workdps(60):
        true = float(mpmath.ellipk(1 - mpmath.mpf(complement)))
    assert agm_quarter_period(np.array([complement]))[0] == pytest.approx(true, rel=1e-14)
    value = carlson_rf(np.zeros(1), np.array([complement]), np.ones(1))[0]
    assert value == pytest.approx(true, rel=1e-13)


@pytest.mark.parametrize("claim", ["small_swing", "swing_of_two", "swing_of_three"])
def test_the_periods_of_the_centred_scheme_are_those_of_its_modified_energy(claim):
    """The numbers of the experiment, from a quadrature over a swing of the energy that the scheme nearly conserves."""
    file = Path(__file__).parents[2] / "configs/vibration_text/frequency_error_of_swings.yaml"
    experiment = Experiment.from_yaml(file)
    (check,) = (check for check in experiment.checks if check.id == claim)
    theta = check.that.at.swept["initial.theta"]
    steps = 2**check.that.at.level

    def period(dt2):
        def slowness(s):
            q = theta * mpmath.sin(s)
            energy = mpmath.cos(q) - mpmath.cos(theta)
            energy += dt2 * (mpmath.sin(q) ** 2 - mpmath.sin(theta) ** 2) / 24
            mass = 1 + dt2 * mpmath.cos(q) / 6
            return theta * mpmath.cos(s) / mpmath.sqrt(2 * energy * mass)

        return 4 * mpmath.quad(slowness, [0, mpmath.pi / 4, mpmath.pi / 2], method="gauss-legendre")

    with mpmath.workdps(30):
        wanted = period((mpmath.mpf(50) / steps) ** 2) / period(mpmath.mpf(0)) - 1
    assert check.that.equals == pytest.approx(float(wanted), rel=2e-3)


@pytest.mark.parametrize("omega", [2.4, -2.4])
def test_the_period_over_the_top_is_that_between_passes_of_the_top(omega):
    """The acceleration vanishes there, so the interpolated times are as accurate as dt^3."""
    start = {"theta": math.copysign(0.3, omega), "omega": omega}
    made = {"title": "t", "model": {"kind": "pendulum"}, "initial": start, "schemes": ["rk4"]}
    experiment = Experiment.from_dict({**made, "time": {"end": 23.0}, "levels": [10]})
    data = simulate(experiment, 10)
    assert float(data.period.squeeze()) == pytest.approx(float(data.exact_period[0]), abs=2e-7)
