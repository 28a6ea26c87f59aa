"""Numbers that formulas on paper give, independent of vibsim."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from scipy.special import ellipk

from vibsim import best, simulate

from .door import Content, Outcome, build, outcome

END, W = 25.0, 1.3


@cache
def spring() -> Outcome:
    return outcome(
        {
            "model": {"kind": "spring", "w": W},
            "initial": {"u": 1.0},
            "time": {"end": END},
            "levels": [7, 8, 9],
            "samples": "all",
            "schemes": [
                "central",
                "forward_euler",
                "crank_nicolson",
                "rk4",
                {"kind": "central", "label": "low", "start": "first_order"},
            ],
            "checks": [
                {"value": name, "at": {"level": 7, "scheme": scheme}, "below": 1e300}
                for name in ("frequency", "predicted_frequency", "growth_per_period")
                for scheme in ("central", "forward_euler", "crank_nicolson", "rk4")
            ],
        }
    )


def measured(name: str, scheme: str) -> float:
    found = spring()
    names = ("frequency", "predicted_frequency", "growth_per_period")
    schemes = ("central", "forward_euler", "crank_nicolson", "rk4")
    (value,) = found.values(names.index(name) * len(schemes) + schemes.index(scheme))
    return float(value)


DT = END / 2**7
X = W * DT


@pytest.mark.parametrize("name", ["frequency", "predicted_frequency"])
def test_the_centred_scheme_has_its_discrete_frequency(name: str) -> None:
    """vibration text (18): w~ = 2/dt asin(w dt/2)."""
    assert measured(name, "central") == pytest.approx(2 / DT * math.asin(X / 2), rel=1e-11)


@pytest.mark.parametrize("name", ["frequency", "predicted_frequency"])
def test_crank_nicolson_has_its_discrete_frequency(name: str) -> None:
    """One step turns the phase plane by 2 atan(w dt/2)."""
    assert measured(name, "crank_nicolson") == pytest.approx(2 / DT * math.atan(X / 2), rel=1e-11)


def test_the_centred_solution_is_a_cosine_of_that_frequency() -> None:
    data = spring().levels[7]
    exact = np.cos(2 / DT * math.asin(X / 2) * data["t"].values)
    np.testing.assert_allclose(data["u"].sel(scheme="central")[0], exact, rtol=0, atol=1e-12)


def test_growth_factors_are_those_of_the_amplification_matrix() -> None:
    """In the 2 pi/x steps of a period: |1 + i x| each, of Runge-Kutta the Taylor polynomial of e^(ix) up to x^4."""
    factor = {
        "forward_euler": 1 + 1j * X,
        "rk4": 1 + 1j * X - X**2 / 2 - 1j * X**3 / 6 + X**4 / 24,
        "central": 1.0,
        "crank_nicolson": 1.0,
    }
    for scheme, one in factor.items():
        wanted = abs(one) ** (2 * math.pi / X)
        assert measured("growth_per_period", scheme) == pytest.approx(wanted, rel=1e-9), scheme


def test_forward_euler_gains_energy_by_its_factor() -> None:
    """E grows by 1 + (w dt)^2 in every step."""
    energy = spring().levels[7]["energy"].sel(scheme="forward_euler")[0].values
    steps = np.arange(len(energy))
    np.testing.assert_allclose(energy / energy[0], (1 + X**2) ** steps, rtol=1e-11)


def test_crank_nicolson_conserves_the_energy_of_a_linear_problem() -> None:
    for data in spring().levels.values():
        energy = data["energy"].sel(scheme="crank_nicolson")[0].values
        np.testing.assert_allclose(energy, energy[0], rtol=1e-12)
        assert float(data["energy_deviation_max_abs"].sel(scheme="crank_nicolson")[0]) < 1e-12


def test_the_first_order_start_is_the_cosine_with_a_sine_of_first_order() -> None:
    """u_1 = u_0 in place of u_0 - (w dt)^2/2 u_0: cos(a n) + sin(a n) (1 - cos a)/sin a, 2 sin(a/2) = w dt."""
    data = spring().levels[7]
    a, n = 2 * math.asin(X / 2), np.arange(2**7 + 1)
    exact = np.cos(a * n) + np.sin(a * n) * (1 - math.cos(a)) / math.sin(a)
    np.testing.assert_allclose(data["u"].sel(scheme="low")[0], exact, rtol=0, atol=1e-12)


@pytest.mark.parametrize("theta", [0.01, 1.0, 2.0, 3.0])
def test_the_period_of_a_pendulum_is_the_elliptic_one(theta: float) -> None:
    """4 sqrt(L/g) K(sin(theta_0/2))."""
    content: Content = {
        "model": {"kind": "pendulum", "g": 9.81, "L": 4.9},
        "initial": {"theta": theta},
        "time": {"end": 60.0},
        "levels": [10, 11, 12],
        "schemes": ["central"],
        "checks": [
            {"value": "exact_period", "below": 1e300},
            {"value": "period", "at": {"level": 12}, "below": 1e300},
        ],
    }
    wanted = 4 * math.sqrt(4.9 / 9.81) * ellipk(math.sin(theta / 2) ** 2)
    found = outcome(content)
    assert found.values(0)[0] == pytest.approx(wanted, rel=1e-13)
    # second order: w dt = 60/4096 * sqrt(2) makes (w dt)^2/24 of 2e-5, and more near the top
    assert found.values(1)[0] == pytest.approx(wanted, rel=1e-3 if theta > 2.5 else 5e-5)


def test_the_energy_of_a_pendulum_is_its_formula() -> None:
    """E = m L^2 omega^2/2 + m g L (1 - cos theta)."""
    g, L, m = 9.81, 0.7, 2.5
    content: Content = {
        "model": {"kind": "pendulum", "g": g, "L": L, "m": m},
        "initial": {"theta": 1.0, "omega": 0.5},
        "time": {"end": 3.0},
        "levels": [7, 8],
        "schemes": ["rk4"],
    }
    data = simulate(build(content), 7).isel(scheme=0, case=0)
    kinetic = 0.5 * m * L**2 * data["omega"] ** 2
    potential = m * g * L * (1 - np.cos(data["theta"]))
    np.testing.assert_allclose(data["kinetic_energy"], kinetic, rtol=1e-12)
    np.testing.assert_allclose(data["potential_energy"], potential, rtol=1e-12)


def test_the_extrapolated_solution_is_within_its_bound() -> None:
    content: Content = {
        "model": {"kind": "spring"},
        "initial": {"u": 1.0},
        "time": {"end": 10.0},
        "levels": [6, 7, 8, 9],
        "schemes": [{"kind": "central", "end_velocity": "kick"}],
    }
    data = best(build(content)).isel(scheme=0, case=0)
    t = data["t"].values
    for state, exact in (("u", np.cos(t)), ("v", -np.sin(t))):
        error = np.abs(data[state].values - exact)
        assert np.all(error <= data[f"{state}_error"].values)
        # the finest level alone has (dt)^2 t/24 = 1.6e-4
        assert float(error.max()) < 1e-8


def test_a_tolerance_chooses_levels_that_reach_it() -> None:
    content: Content = {
        "model": {"kind": "spring"},
        "initial": {"u": 1.0},
        "time": {"end": 10.0},
        "tolerance": 1e-7,
        "schemes": [{"kind": "central", "end_velocity": "kick"}],
    }
    data = best(build(content)).isel(scheme=0, case=0)
    assert bool(data["reached"])
    t = data["t"].values
    assert float(np.abs(data["u"].values - np.cos(t)).max()) < 1e-7
    assert float(data["u_error"].max()) <= 1e-7


def test_a_ball_bounces_when_it_should() -> None:
    """From h = 1 with g = 1: at sqrt(2), and after each bounce 2 r^k sqrt(2) later."""
    content: Content = {
        "model": {"kind": "bouncing_ball", "restitution": 0.8},
        "initial": {"h": 1.0},
        "time": {"end": 5.0},
        "levels": [6, 7],
        "schemes": ["rk4"],
        "checks": [
            {"value": name, "below": 1e300}
            for name in ("event_count", "first_event_time", "last_event_time")
        ],
    }
    found = outcome(content)
    first = math.sqrt(2.0)
    second = first * (1 + 2 * 0.8)
    assert found.values(0) == [2.0]
    assert found.values(1)[0] == pytest.approx(first, rel=1e-12)
    assert found.values(2)[0] == pytest.approx(second, rel=1e-12)


def test_the_cases_of_a_grid_have_one_number_together() -> None:
    """A pendulum of small swings has the period 2 pi sqrt(L/g); a grid varies both."""
    lengths, weights = [0.5, 2.0, 1.0], [1.0, 4.0]
    periods = [2 * math.pi * math.sqrt(length / g) for length in lengths for g in weights]
    row = {"value": "period", "over": "cases", "rtol": 1e-3}
    content: Content = {
        "model": {"kind": "linear_pendulum"},
        "initial": {"theta": 0.1},
        "time": {"end": 20.0},
        "levels": [8, 9, 10],
        "schemes": ["rk4"],
        "sweep": {"model.L": lengths, "model.g": weights},
        "checks": [
            {**row, "take": "largest", "equals": max(periods)},
            {**row, "take": "smallest", "equals": min(periods)},
            {**row, "take": "mean", "equals": sum(periods) / 6},
            {**row, "take": "largest", "at": {"model.g": 4.0}, "equals": max(periods[1::2])},
        ],
    }
    found = outcome(content)
    assert found.reasons() == [("PASS", "match")] * 4
    assert "model.L = 2, model.g = 1" in found.verdicts[0].text
    assert [verdict.results[0].case for verdict in found.verdicts[:2]] == [2, 1]
