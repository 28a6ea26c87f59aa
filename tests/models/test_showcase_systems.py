"""The systems of `configs/showcase`, against closed forms and against SciPy on equations written out by hand."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import mathieu_a, mathieu_cem
from thinned import thinned

import vibsim
from vibsim import Experiment, simulate
from vibsim.simulation.members import members
from vibsim.simulation.reference.solve import reference

CONFIGS = Path(__file__).parents[2] / "configs" / "showcase"
FRACTION = np.linspace(0.0, 1.0, 201)


@pytest.fixture
def without_references(monkeypatch):
    """Simulate without the exact solutions, which take seconds: others are what is compared here."""
    monkeypatch.setattr("vibsim.experiment.storage.MOST_REFERENCES", 0)


ENDS = {"quarter_car": 2.0, "wave_string": 1.0}
"""Ends of those whose reference takes seconds: each mode swings by then, and the tests below go on to the end."""


def read(name, end=None):
    settings = [] if end is None else [f"time.end={end}"]
    return Experiment.from_yaml(CONFIGS / f"{name}.yaml", settings=settings)


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


def quarter_car(t, y):
    """Body and wheel, 400 and 40 kg, at 5 m/s on a road with waves 5 m long and 2 cm high."""
    z, w, vz, vw = y
    pull = 2e4 * (w - z) + 1500.0 * (vw - vz)
    road = 0.02 * math.sin(2.0 * math.pi * t)
    return vz, vw, pull / 400.0, (2e5 * (road - w) - pull) / 40.0


def wave_string(t, y):
    """Centred differences in space of ``u_tt = u_xx`` on 32 parts."""
    return *y[31:], *(32**2 * np.diff([0.0, *y[:31], 0.0], n=2))


CASES = [
    ("quarter_car", 0, quarter_car),
    ("wave_string", 0, wave_string),
    ("mass_chain", 0, mass_chain),
    ("van_der_pol", 0, van_der_pol),
    *(("mathieu", case, mathieu(delta)) for case, delta in enumerate((0.15, 0.25, 0.35))),
    ("double_pendulum", 0, double_pendulum),
    ("double_pendulum_by_masses", 0, double_pendulum),
    ("coupled_pendulums", 0, coupled_pendulums),
]


@pytest.mark.usefixtures("without_references")
@pytest.mark.parametrize(("name", "case", "right"), thinned(CASES, 3))
def test_the_motion_is_that_of_the_equation_written_out_by_hand(name, case, right):
    experiment = read(name, ENDS.get(name))
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


@pytest.mark.slow
@pytest.mark.usefixtures("without_references")
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


@pytest.mark.usefixtures("without_references")
def test_behind_the_transient_a_quarter_of_a_car_has_its_frequency_response():
    level = simulate(read("quarter_car"), 5)
    m, c, k = np.diag([400.0, 40.0]), np.array([[1500.0, -1500.0], [-1500.0, 1500.0]]), 2e4
    stiff, t = np.array([[k, -k], [-k, k + 2e5]]), 12.0
    for case, speed in enumerate((5.0, 10.0, 20.0)):
        w = 2.0 * math.pi * speed / 5.0
        response = np.linalg.solve(stiff - w * w * m + 1j * w * c, [0.0, 2e5 * 0.02])
        expected = (response * np.exp(1j * w * t)).imag
        found = [level[q].values[1, case, -1] for q in ("z", "w")]
        # what is left of the transient is exp(-1.577 t) of it
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=2e-9)


def string(parts, courant):
    """Return the error of the centred scheme against d'Alembert's solution, with a step that follows the mesh."""
    names = [f"u{i}" for i in range(1, parts)]
    sides = ["0", *names, "0"]
    x = np.arange(1, parts) / parts
    steps = round(1.5 * parts / courant)
    content = {
        "title": "t",
        "model": {
            "kind": "system",
            "coordinates": names,
            "acceleration": {
                name: f"{parts}**2*({sides[i]} - 2*{name} + {sides[i + 2]})"
                for i, name in enumerate(names)
            },
        },
        "initial": {name: float(u) for name, u in zip(names, profile(x), strict=True)},
        "time": {"end": 1.5, "base_steps": steps},
        "levels": [0],
        "schemes": ["central"],
    }
    last = simulate(Experiment.from_dict(content), 0).isel(t=-1)
    found = np.array([float(last[name].squeeze()) for name in names])
    # two waves, each continued beyond the walls as an odd function
    exact = 0.5 * (profile(x - 1.5) + profile(x + 1.5))
    return float(np.sqrt(np.sum((found - exact) ** 2) / parts))


def profile(x):
    return np.sin(np.pi * x) + 0.5 * np.sin(2.0 * np.pi * x)


@pytest.mark.slow
@pytest.mark.usefixtures("without_references")
def test_the_string_has_the_solution_of_dalembert():
    """Exactly with dt = dx; of second order where space and time are refined at once."""
    assert string(24, 1.0) < 1e-12
    parts = (12, 24, 48)
    found = [string(n, 0.5) for n in parts]
    verdict = vibsim.judge([1.0 / n for n in parts], found, order=2, exact=0.0)
    assert verdict.status == "PASS", verdict.sentence
    assert verdict.order == pytest.approx(2.0, abs=0.1)
    assert found[-1] < 1e-2


def test_two_pendulums_beat_as_their_modes_do():
    experiment = read("coupled_pendulums")
    group = members(experiment, 0, 1)
    found, _ = reference(experiment.model.definition, group, FRACTION)
    t, w = FRACTION * group.end[0], math.sqrt(1.2)
    np.testing.assert_allclose(found["x"][0], 0.5 * (np.cos(t) + np.cos(w * t)), atol=1e-12)
    np.testing.assert_allclose(found["y"][0], 0.5 * (np.cos(t) - np.cos(w * t)), atol=1e-12)
