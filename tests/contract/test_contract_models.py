"""Every model and every scheme is accepted and computes what its equation says."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray

from vibsim import InputError, simulate

from .door import Content, Outcome, build, outcome, vibsim

# kind: (section `model`, initial values, states)
MODELS: dict[str, tuple[Content, dict[str, float], tuple[str, ...]]] = {
    "spring": ({"w": 1.5}, {"u": 1.0, "v": 0.2}, ("u", "v")),
    "pendulum": ({"g": 9.81, "L": 4.9, "m": 0.5}, {"theta": 1.0}, ("theta", "omega")),
    "linear_pendulum": ({"g": 2.0, "L": 0.5}, {"theta": 0.3}, ("theta", "omega")),
    "physical_pendulum": (
        {"inertia": 0.8, "m": 1.2, "g": 3.0, "L": 0.5},
        {"theta": 0.7},
        ("theta", "omega"),
    ),
    "oscillator": (
        {
            "m": 1.5,
            "spring": "k*u + u**3",
            "damping": {"quadratic": 0.3},
            "force": "F0*cos(2*t)",
            "parameters": {"k": 2.0, "F0": 0.5},
        },
        {"u": 1.0},
        ("u", "v"),
    ),
    "sliding_box": ({"mu": 0.05}, {"u": 1.0}, ("u", "v")),
    "washing_machine": ({"k": 4.5, "b": 0.6, "unbalance": 0.2}, {}, ("u", "v")),
    "elastic_pendulum": ({"beta": 0.9, "Theta": 30}, {}, ("x", "y", "vx", "vy")),
    "vehicle": (
        {"m": 2.0, "b": 0.4, "speed": 1.3, "spring": "3*u", "road": "0.1*sin(2*x)"},
        {},
        ("u", "v"),
    ),
    "bouncing_ball": ({"restitution": 0.9}, {"h": 1.0}, ("h", "v")),
    "circuit": (
        {"L": 0.5, "R": 0.2, "C": 0.1, "voltage": "12*cos(4*t)"},
        {"di_dt": 24.0},
        ("i", "di_dt"),
    ),
    "duffing": (
        {"delta": 0.1, "alpha": 1.0, "beta": 1.0, "gamma": 0.3, "omega": 1.2},
        {"u": 1.0},
        ("u", "v"),
    ),
    "system": (
        {
            "coordinates": ["x", "y"],
            "acceleration": {"x": "-k*x + 0.2*(y - x)", "y": "-y - 0.2*(y - x) - 0.1*vy"},
            "outputs": {"stretch": "y - x"},
            "parameters": {"k": 1.3},
        },
        {"x": 1.0},
        ("x", "y", "vx", "vy"),
    ),
}
EVERYWHERE = {
    "energy": ("scheme", "case", "t"),
    "kinetic_energy": ("scheme", "case", "t"),
    "potential_energy": ("scheme", "case", "t"),
    "energy_deviation": ("scheme", "case", "t"),
    "energy_deviation_max_abs": ("scheme", "case"),
    "period": ("scheme", "case"),
    "amplitude": ("scheme", "case"),
    "status": ("scheme", "case"),
}
OUTPUTS = {
    "pendulum": ["wire_force"],
    "physical_pendulum": ["pivot_force"],
    "washing_machine": ["floor_force"],
    "vehicle": ["road_height", "absolute_position"],
    "circuit": ["capacitor_voltage", "source_voltage"],
    "elastic_pendulum": ["angle", "wire_length", "wire_force"],
    "oscillator": ["dissipated_energy", "work_done", "energy_budget"],
    "system": ["stretch", "dissipated_energy", "work_done", "energy_budget"],
}


def content_of(kind: str) -> Content:
    model, initial, _ = MODELS[kind]
    return {
        "model": {"kind": kind, **model},
        "initial": initial,
        "time": {"end": 2.0},
        "levels": [6, 7],
        "schemes": ["rk4"],
    }


def first(dataset: xarray.Dataset, name: str, scheme: str | None = None) -> np.ndarray[Any, Any]:
    """A series of the first member, of one scheme where it has one for each."""
    data = dataset[name].isel(case=0)
    if "scheme" in data.dims:
        data = data.sel(scheme=scheme) if scheme else data.isel(scheme=0)
    return np.asarray(data)


@pytest.mark.parametrize("kind", MODELS)
def test_a_model_runs_and_stores_what_it_promises(kind: str) -> None:
    """Energies add up, deviations are those from the start, and two levels agree."""
    experiment = build(content_of(kind))
    coarse, fine = (simulate(experiment, level) for level in (6, 7))
    states = MODELS[kind][2]
    for name in (*states, *OUTPUTS.get(kind, [])):
        assert coarse[name].dims == ("scheme", "case", "t")
        values = first(coarse, name)
        assert np.all(np.isfinite(values)), name
        assert coarse[name].attrs["units"]
        assert coarse[name].attrs["long_name"]
    for name in states[: len(states) // 2]:
        values = first(fine, name)[::2]
        # w dt is 0.15 at most: the fourth-order error of two seconds is below a thousandth
        allowed = 1e-3 * float(np.abs(values).max())
        np.testing.assert_allclose(first(coarse, name), values, rtol=0, atol=allowed)
    for name, dims in EVERYWHERE.items():
        assert coarse[name].dims == dims, name
    energy = first(coarse, "energy")
    parts = first(coarse, "kinetic_energy") + first(coarse, "potential_energy")
    np.testing.assert_allclose(energy, parts, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(
        first(coarse, "energy_deviation"), energy - energy[0], rtol=1e-9, atol=1e-12
    )
    assert int(coarse["status"][0, 0]) == 0
    for state, value in MODELS[kind][1].items():
        assert first(coarse, state)[0] == value


# kind: order of the position on the spring, None where the scheme chooses its own steps
SCHEMES: dict[str, int | None] = {
    "central": 2,
    "central_backward_damping": 2,
    "central_quadratic_root": 2,
    "forward_euler": 1,
    "backward_euler": 1,
    "crank_nicolson": 2,
    "rk2": 2,
    "heun": 2,
    "rk3": 3,
    "rk4": 4,
    "ab2": 2,
    "ab3": 3,
    "bdf2": 2,
    "euler_cromer": 1,
    "euler_cromer_u_first": 1,
    "velocity_verlet": 2,
    "position_verlet": 2,
    "yoshida4": 4,
    "pefrl": 4,
    "rkn4": 4,
    "newmark": 2,
    "hht": 2,
    "generalized_alpha": 2,
    "gauss4": 4,
    "dop853": None,
    "lsoda": None,
    "radau": None,
}


@cache
def every_scheme() -> Outcome:
    return outcome(
        {
            "model": {"kind": "spring"},
            "initial": {"u": 1.0, "v": 0.5},
            "time": {"end": 5.0},
            "levels": [8, 9, 10],
            "schemes": list(SCHEMES),
            "checks": [{"converges": "u", "order": "scheme"}],
        }
    )


def test_the_command_lists_these_models_and_schemes() -> None:
    # structures are stepped by schemes of their own: tests/models/test_structure.py
    for what, known in (("models", [*MODELS, "structure"]), ("schemes", SCHEMES)):
        lines = vibsim("list", what).stdout.splitlines()
        listed = {line.split()[0] for line in lines if line and not line.startswith(" ")}
        assert listed - {"kind"} == set(known)


@pytest.mark.parametrize("kind", SCHEMES)
def test_a_scheme_has_its_order(kind: str) -> None:
    """From the true errors at t = 5, u = cos t + sin(t)/2, of two levels: log2 of their ratio is p + O(dt)."""
    found = every_scheme()
    error = [
        first(found.levels[level], "u", kind) - first(found.levels[level], "u_exact")
        for level in (8, 9)
    ]
    t = found.levels[8]["t"].values
    np.testing.assert_allclose(
        first(found.levels[8], "u_exact"), np.cos(t) + 0.5 * np.sin(t), rtol=0, atol=1e-14
    )
    largest = [float(np.max(np.abs(one))) for one in error]
    order = SCHEMES[kind]
    if order is None:
        assert max(largest) < 1e-8
    else:
        # dt = 5/256: one more power of dt changes the ratio by a few hundredths at most
        assert math.log2(largest[0] / largest[1]) == pytest.approx(order, abs=0.05)


def test_every_scheme_passes_with_the_order_it_promises() -> None:
    (verdict,) = every_scheme().verdicts
    told = {result.scheme: result.status for result in verdict.results}
    assert set(told) <= {kind for kind, order in SCHEMES.items() if order is not None}
    assert "FAIL" not in told.values()
    assert told["central"] == "PASS"


def test_the_scheme_coordinate_has_the_names_in_the_order_of_the_file() -> None:
    for dataset in (every_scheme().levels[8], every_scheme().convergence):
        assert [str(name) for name in dataset["scheme"].values] == list(SCHEMES)


OPTIONS: dict[str, Content] = {
    "centred": {"kind": "central", "start": "centred"},
    "taylor": {"kind": "central", "start": "taylor"},
    "first_order": {"kind": "central", "start": "first_order"},
    "extrapolate": {"kind": "central", "end_velocity": "extrapolate"},
    "backward": {"kind": "central", "end_velocity": "backward"},
    "kick": {"kind": "central", "end_velocity": "kick"},
    "compensated": {"kind": "central", "arithmetic": "compensated"},
    "increment": {"kind": "central", "arithmetic": "increment"},
    "three_term": {"kind": "central", "arithmetic": "three_term"},
    "corrected": {"kind": "central", "frequency_correction": True},
    "cromer": {"kind": "euler_cromer", "start": "centred"},
    "newmark_12": {"kind": "newmark", "beta": "1/12", "gamma": 0.5},
    "hht_0": {"kind": "hht", "alpha": 0},
    "rho_1": {"kind": "generalized_alpha", "rho_inf": 1},
    "loose": {"kind": "dop853", "tolerance": 1e-4},
}


@cache
def options() -> Outcome:
    return outcome(
        {
            "model": {"kind": "spring"},
            "initial": {"u": 1.0, "v": 0.5},
            "time": {"end": 5.0},
            "levels": [6, 7],
            "schemes": [{"label": name, **section} for name, section in OPTIONS.items()],
        }
    )


def slope(name: str, state: str = "u", at: slice = slice(None)) -> float:
    """Order from the true errors of two levels."""
    errors = []
    for dataset in options().levels.values():
        difference = first(dataset, state, name) - first(dataset, f"{state}_exact")
        errors.append(float(np.max(np.abs(difference[at]))))
    return math.log2(errors[0] / errors[1])


def test_options_do_what_they_say() -> None:
    last = slice(-1, None)
    assert slope("centred") == pytest.approx(2, abs=0.05)
    assert slope("taylor") == pytest.approx(2, abs=0.05)
    assert slope("first_order") == pytest.approx(1, abs=0.1)
    assert slope("corrected") == pytest.approx(4, abs=0.1)
    assert slope("cromer") == pytest.approx(2, abs=0.05)
    assert slope("backward", "v", last) == pytest.approx(1, abs=0.2)
    assert slope("kick", "v", last) == pytest.approx(2, abs=0.1)
    assert slope("extrapolate", "v", last) > 1.5


def test_three_ways_of_writing_a_scheme_differ_by_round_off_only() -> None:
    data = options().levels[7]
    for name in ("increment", "three_term", "taylor"):
        apart = np.abs(first(data, "u", name) - first(data, "u", "compensated"))
        assert float(apart.max()) < 1e-11
    assert np.any(first(data, "u", "three_term") != first(data, "u", "compensated"))


def test_newmark_hht_and_generalized_alpha_meet_in_the_trapezoidal_rule() -> None:
    data = every_scheme().levels[8]
    np.testing.assert_allclose(
        first(data, "u", "newmark"), first(data, "u", "crank_nicolson"), rtol=0, atol=1e-12
    )
    coarse = options().levels[6]
    assert float(np.abs(first(coarse, "u", "hht_0") - first(coarse, "u", "rho_1")).max()) < 1e-12


def test_newmark_satisfies_its_recurrence() -> None:
    """On u'' = -u with gamma = 1/2: (1 + beta x)(u_(n+1) + u_(n-1)) = 2 (1 - (1/2 - beta) x) u_n, x = dt^2."""
    data = options().levels[6]
    u, x, beta = first(data, "u", "newmark_12"), (5.0 / 64) ** 2, 1.0 / 12.0
    left = (1 + beta * x) * (u[2:] + u[:-2])
    np.testing.assert_allclose(left, 2 * (1 - (0.5 - beta) * x) * u[1:-1], rtol=0, atol=1e-13)


def test_a_list_of_tolerances_stands_for_as_many_schemes() -> None:
    content = {**content_of("spring"), "levels": [3, 4]}
    content["schemes"] = ["central", {"kind": "dop853", "tolerance": [1e-4, 1e-8]}]
    data = simulate(build(content), 3)
    assert [str(name) for name in data["scheme"].values] == [
        "central",
        "dop853_1e-04",
        "dop853_1e-08",
    ]


@pytest.mark.parametrize("damping", ["none", {"linear": 0.2}, {"quadratic": 0.2}, "0.2*v**3"])
def test_every_form_of_damping_is_accepted_and_takes_energy(damping: Any) -> None:
    model = {"damping": damping}
    content = {**content_of("oscillator"), "model": {"kind": "oscillator", **model}}
    energy = first(simulate(build(content), 7), "energy")
    if damping == "none":
        assert np.ptp(energy) < 1e-8
    else:
        assert np.all(np.diff(energy) < 0)


def test_friction_of_coulomb_holds_the_body_to_the_last_bit() -> None:
    """From 1 with friction 0.3 and k = m = 1 it swings about 0.3 to -0.4, about -0.3 to -0.2, and sticks there."""
    content = {
        "model": {"kind": "oscillator", "damping": {"coulomb": 0.3}},
        "initial": {"u": 1.0},
        "time": {"end": 10.0},
        "levels": [6, 7],
        "schemes": ["rk4"],
    }
    data = simulate(build(content), 7)
    late = data["t"].values > 2 * math.pi
    u, v = first(data, "u")[late], first(data, "v")[late]
    assert np.all(v == 0.0)
    assert np.all(u == u[0])
    # the fourth-order error of a step of 0.08 over six seconds
    assert u[0] == pytest.approx(-0.2, abs=1e-5)


def test_a_manufactured_solution_is_met() -> None:
    model = {
        "kind": "oscillator",
        "spring": "sin(u)",
        "damping": {"linear": 0.1},
        "exact": "a*cos(w*t)",
        "parameters": {"a": 1.0, "w": 2.0},
    }
    content = {**content_of("oscillator"), "model": model, "initial": {}}
    data = simulate(build(content), 7)
    np.testing.assert_allclose(first(data, "u"), np.cos(2 * data["t"].values), rtol=0, atol=1e-6)


def test_units_are_converted() -> None:
    content = content_of("pendulum")
    content["model"] = {"kind": "pendulum", "g": "9.81 m/s^2", "L": "490 cm", "m": "500 g"}
    content["initial"] = {"theta": "180/pi deg"}
    content["time"] = {"end": "2 s"}
    np.testing.assert_allclose(
        first(simulate(build(content), 6), "theta"),
        first(simulate(build(content_of("pendulum")), 6), "theta"),
        rtol=0,
        atol=1e-12,
    )
    with pytest.raises(InputError):
        build({**content, "time": {"end": "2 kg"}})


def test_a_scaled_run_is_that_of_the_scaled_equation() -> None:
    """With t_c = sqrt(L/g) = 1/2 s the pendulum is that of g = L = m = 1 to twice the time."""
    plain: Content = {"levels": [6, 7], "schemes": ["central"], "initial": {"theta": 1.0}}
    model = {"kind": "pendulum", "g": 8.0, "L": 2.0, "m": 3.0}
    scaled = {**plain, "model": model, "time": {"end": 5.0}, "scaled": True}
    unit = {**plain, "model": {"kind": "pendulum"}, "time": {"end": 10.0}}
    one, other = simulate(build(scaled), 6), simulate(build(unit), 6)
    np.testing.assert_array_equal(first(one, "theta"), first(other, "theta"))
    np.testing.assert_array_equal(one["t"].values, other["t"].values)
    assert float(one.attrs["scale_t"]) == pytest.approx(0.5, rel=1e-15)


def test_a_system_with_formulas_at_each_coordinate_and_events_beside_the_model() -> None:
    """The bounce of x at 0.9 and the motion before it, against SciPy."""
    from scipy.integrate import solve_ivp

    content = {
        "model": {
            "kind": "system",
            "coordinates": {
                "x": {"acceleration": "-k*x + c*(y - x)"},
                "y": {"mass": 2.0, "force": "-k*y - c*(y - x) - d*vy"},
            },
            "parameters": {"k": 1.0, "c": 0.2, "d": 0.05},
            "potential": "k*x**2/2 + k*y**2/2 + c*(y - x)**2/2",
        },
        "initial": {"x": 1.0},
        "stop": "x < -0.5",
        "events": [{"when": "x - 0.9", "falling": True, "then": {"vx": "-0.8*vx"}}],
        "time": {"end": 2.0},
        "levels": [8, 9],
        "schemes": ["rk4"],
    }

    def slope(_: float, s: np.ndarray[Any, Any]) -> list[float]:
        x, y, vx, vy = s
        return [vx, vy, -x + 0.2 * (y - x), (-y - 0.2 * (y - x) - 0.05 * vy) / 2.0]

    def falls(_: float, s: np.ndarray[Any, Any]) -> float:
        return float(s[0] - 0.9)

    falls.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(slope, (0, 2), [1, 0, 0, 0], events=falls, rtol=1e-11, atol=1e-13)
    (when,) = found.t_events[0]
    dataset = simulate(build(content), 9)
    assert float(np.ravel(dataset["event_time"])[0]) == pytest.approx(when, abs=1e-9)
    x, t = first(dataset, "x"), np.ravel(dataset["t"])
    after = x[(t > when) & (t < when + 0.1)]
    assert np.all(np.diff(after) > 0.0), "x goes up again behind the event"


def test_one_equation_is_a_system() -> None:
    content = content_of("system")
    content["model"] = {"kind": "system", "equation": "u'' + (u**2 - 1)*u' + u = 0"}
    content["initial"] = {"u": 1.0}
    usual = {**content, "model": {"kind": "system", "acceleration": "(1 - u**2)*v - u"}}
    one, other = (first(simulate(build(each), 7), "u") for each in (content, usual))
    assert np.max(np.abs(one - other)) < 1e-13


def test_a_chain_of_a_few_words_swings_in_its_lowest_mode() -> None:
    content = content_of("system")
    chain = {"x_i": {"acceleration": "x_(i+1) - 2*x_i + x_(i-1)"}}
    content["model"] = {"kind": "system", "repeat": {"n": 16, "i": chain}}
    content["initial"] = {"x_i": "sin(pi*i/17)"}
    content["levels"] = [8, 9, 10]
    end = content["time"]["end"]
    w = 2.0 * np.sin(np.pi / 34)
    found = simulate(build(content), 10)
    for i in (1, 8, 16):
        expected = np.sin(np.pi * i / 17) * np.cos(w * end)
        assert first(found, f"x_{i}")[-1] == pytest.approx(expected, abs=1e-6)
