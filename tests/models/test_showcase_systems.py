"""The systems of `configs/showcase`, against closed forms and against SciPy on equations written out by hand."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import mathieu_a, mathieu_cem

from vibsim import Experiment, simulate
from vibsim.simulation.members import members
from vibsim.simulation.reference.solve import reference

CONFIGS = Path(__file__).parents[2] / "configs" / "showcase"
FRACTION = np.linspace(0.0, 1.0, 201)


def read(name):
    return Experiment.from_yaml(CONFIGS / f"{name}.yaml")


def van_der_pol(t, y):
    return y[1], (1.0 - y[0] ** 2) * y[1] - y[0]


def mathieu(delta):
    return lambda t, y: (y[1], -(delta + 0.1 * math.cos(t)) * y[0])


def double_pendulum(t, y):
    """Lagrange's equations, ``M(q) q'' = f(q, q')``, solved at every place."""
    a, b, va, vb = y
    c, s = math.cos(a - b), math.sin(a - b)
    right = -s * vb**2 - 2.0 * math.sin(a), s * va**2 - math.sin(b)
    return va, vb, *np.linalg.solve([[2.0, c], [c, 1.0]], right)


def coupled_pendulums(t, y):
    x, z, vx, vz = y
    return vx, vz, -1.1 * x + 0.1 * z, -1.1 * z + 0.1 * x


def mass_chain(t, y):
    """Twelve masses between walls, with springs whose force has a quadratic part."""
    stretch = np.diff([0.0, *y[:12], 0.0])
    return *y[12:], *np.diff(stretch + 0.25 * stretch**2)


CASES = [
    ("mass_chain", 0, mass_chain),
    ("van_der_pol", 0, van_der_pol),
    *(("mathieu", case, mathieu(delta)) for case, delta in enumerate((0.15, 0.25, 0.35))),
    ("double_pendulum", 0, double_pendulum),
    ("double_pendulum_by_masses", 0, double_pendulum),
    ("coupled_pendulums", 0, coupled_pendulums),
]


@pytest.mark.parametrize(("name", "case", "right"), CASES)
def test_the_motion_is_that_of_the_equation_written_out_by_hand(name, case, right):
    experiment = read(name)
    model = experiment.model.definition
    group = members(experiment, case, case + 1)
    found, bounds = reference(model, group, FRACTION)
    start = [group.initial[state.name][0] for state in model.states]
    true = solve_ivp(
        right,
        (0.0, group.end[0]),
        start,
        method="DOP853",
        t_eval=FRACTION * group.end[0],
        rtol=3e-14,
        atol=1e-15,
    ).y
    level = simulate(experiment, experiment.levels[-1])
    for state, series in zip(model.states, true, strict=True):
        size = np.max(np.abs(series))
        np.testing.assert_allclose(found[state.name][0], series, rtol=0.0, atol=1e-11 * size)
        assert bounds[state.name][0] <= 1e-11 * size
        last = level[state.name].isel(case=case, t=-1, scheme=-1 if name == "mathieu" else 0)
        assert abs(float(last) - series[-1]) < 1e-5 * size


def test_the_double_pendulum_by_masses_is_that_by_accelerations():
    one, other = (read(name) for name in ("double_pendulum", "double_pendulum_by_masses"))
    first, second = (simulate(experiment, 2) for experiment in (one, other))
    for name in ("a", "b", "va", "vb", "kinetic_energy", "energy_deviation"):
        np.testing.assert_allclose(second[name].values, first[name].values, rtol=0.0, atol=1e-11)
    # potential energies differ by a constant
    apart = second["potential_energy"].values - first["potential_energy"].values
    assert np.ptp(apart) < 1e-11
    assert apart.flat[0] == pytest.approx(3.0, abs=1e-11)


def test_the_limit_cycle_has_its_known_period_and_amplitude():
    """Period and amplitude at mu = 1, by Taylor series of order 26 in 30 digits."""
    period, amplitude = 6.663286859323130, 2.008619860874843
    experiment = read("van_der_pol")
    group = members(experiment, 0, 1)
    at = np.array([0.0, 0.5, 1.0, 2.0, 3.0]) * period / group.end[0]
    found, _ = reference(experiment.model.definition, group, at)
    np.testing.assert_allclose(found["u"][0], amplitude * np.array([1, -1, 1, 1, 1]), rtol=1e-12)
    np.testing.assert_allclose(found["v"][0], 0.0, atol=1e-11)


@pytest.mark.parametrize("order", [1, 2])
def test_on_the_edge_of_a_tongue_the_motion_is_a_function_of_mathieu(order):
    """``y'' + (a - 2 q cos 2x) y = 0`` with t = 2 x + pi has delta = a/4 and epsilon = q/2."""
    q = 0.2
    content = {
        "title": "t",
        "model": {
            "kind": "system",
            "acceleration": "-(delta + epsilon*cos(t + pi))*u",
            "parameters": {"delta": mathieu_a(order, q) / 4.0, "epsilon": q / 2.0},
        },
        "initial": {"u": float(mathieu_cem(order, q, 0.0)[0])},
        "time": {"end": 20.0},
        "levels": [11],
        "schemes": ["gauss4"],
        "checks": [{"value": "end", "quantity": "u", "below": 9}],
    }
    data = simulate(Experiment.from_dict(content), 11)
    t = data["t"].values
    exact = mathieu_cem(order, q, np.degrees(0.5 * t))[0]
    for name in ("u", "u_exact"):
        np.testing.assert_allclose(np.ravel(data[name]), exact, rtol=0.0, atol=2e-9)


def test_two_pendulums_beat_as_their_modes_do():
    experiment = read("coupled_pendulums")
    group = members(experiment, 0, 1)
    found, _ = reference(experiment.model.definition, group, FRACTION)
    t, w = FRACTION * group.end[0], math.sqrt(1.2)
    np.testing.assert_allclose(found["x"][0], 0.5 * (np.cos(t) + np.cos(w * t)), atol=1e-12)
    np.testing.assert_allclose(found["y"][0], 0.5 * (np.cos(t) - np.cos(w * t)), atol=1e-12)
