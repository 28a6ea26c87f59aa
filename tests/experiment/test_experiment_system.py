"""Experiments with equations of a user: what they take, what they refuse, and all faults at once."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vibsim import Experiment, InputError, analyse, simulate, verdicts
from vibsim.experiment.experiment import canonical
from vibsim.models import MODELS
from vibsim.report.text import experiment_file
from vibsim.schemes import SCHEMES
from vibsim.theory import exact_degree

PAIR: dict[str, Any] = {
    "coordinates": ["x", "y"],
    "acceleration": {"x": "-k*x + y", "y": "-y"},
    "parameters": {"k": 2},
}

PUSHED = {"coordinates": ["x", "y"], "force": {"x": "-x", "y": "-y"}}
"""Two coordinates with forces, for masses of all kinds."""


def read(model, **changes):
    content = {
        "title": "t",
        "model": {"kind": "system", **model},
        "time": {"end": 2.0},
        "levels": [5, 6, 7, 8],
        "schemes": ["rk4"],
    }
    return Experiment.from_dict(content | changes)


def refused(model, **changes):
    with pytest.raises(InputError) as caught:
        read(model, **changes)
    return [str(fault).partition(": ")[2] for fault in caught.value.faults]


def judged(experiment):
    levels = [simulate(experiment, level) for level in experiment.levels]
    return [(v.status, v.reason) for v in verdicts(experiment, analyse(experiment, levels))]


def links(count):
    """A chain of pendulums: rods of 1, 1.1, 1.2, ..., and bodies of 1, 2, 3, ..., from the top."""
    names = "abcdfghijklmno"[:count]
    rods = [1 + k / 10 for k in range(count)]
    below = [sum(range(k + 1, count + 1)) for k in range(count)]
    mass = {
        q: {
            p: f"{below[j] * rods[i] * rods[j]}*cos({q} - {p})"
            for j, p in enumerate(names)
            if j >= i
        }
        for i, q in enumerate(names)
    }
    force = {q: f"-{below[i] * rods[i]}*sin({q})" for i, q in enumerate(names)}

    def rates(_, state):
        """Lagrange's equations, solved at every place."""
        q, v = np.split(np.asarray(state), 2)
        apart, weight = np.subtract.outer(q, q), np.minimum.outer(below, below)
        lengths = weight * np.outer(rods, rods)
        right = -lengths * np.sin(apart) @ v**2 - np.multiply(below, rods) * np.sin(q)
        return *v, *np.linalg.solve(lengths * np.cos(apart), right)

    return {"coordinates": list(names), "mass": mass, "force": force}, rates


@pytest.mark.slow
@pytest.mark.parametrize(("count", "scheme"), [(3, "crank_nicolson"), (4, "rk4"), (6, "gauss4")])
def test_masses_in_common_make_a_chain_of_pendulums(count, scheme):
    model, rates = links(count)
    start = [0.5 * (-1) ** k / (k + 1) for k in range(count)]
    experiment = read(
        model,
        initial=dict(zip(model["coordinates"], start, strict=True)),
        schemes=[scheme],
        levels=[9, 10, 11],
    )
    known = solve_ivp(
        rates, (0, 2), [*start, *[0] * count], method="DOP853", rtol=1e-12, atol=1e-12
    )
    level = simulate(experiment, 11)
    ends = [float(level[name][0, 0, -1]) for name in model["coordinates"]]
    close = 1e-4 if scheme == "crank_nicolson" else 1e-9
    assert ends == pytest.approx(known.y[:count, -1], abs=close)


def test_energy_that_a_written_potential_does_not_conserve_is_not_blamed_on_the_forces():
    wrong = {"acceleration": "-u", "potential": "u**2/3"}
    (fault,) = refused(wrong, checks=[{"conserves": "energy"}])
    assert "by the `potential` that is written" in fault


HELD = {"acceleration": "-k*u/m - 0.1*v", "parameters": {"k": 3.0, "m": 2.0}}
JOINED = {"coordinates": ["x", "y"], "force": {"x": "2*y - 3*x + cos(t)", "y": "2*x - 3*y - y*vy"}}
TURNED = {"coordinates": ["x", "y"], "force": {"x": "-x - 0.3*y", "y": "-y + 0.3*x"}}


UNEQUAL = {"coordinates": ["x", "y"], "acceleration": {"x": "(y - 3*x)/2", "y": "x - y - vy"}}


@pytest.mark.parametrize(
    ("model", "potential"),
    [
        (HELD, "k*u**2/2"),
        (JOINED, "3*(x**2 + y**2)/2"),
        (UNEQUAL, "x**2 + (y - x)**2/2"),
    ],
)
def test_a_potential_that_is_not_that_of_the_forces_is_noted(model, potential):
    ((_, note),) = read({**model, "potential": potential}, initial={}).notes
    assert "model.potential: does not give the forces" in note


def test_a_potential_is_compared_with_the_forces_where_the_motion_starts():
    """Between -1 and 1 neither exists."""
    model = {"acceleration": "2 - log(u - 5)"}
    right = "-2*u + (u - 5)*log(u - 5) - u"
    for potential, count in (("-2*u + (u - 5)*log(u - 5)/2 - u", 1), (right, 0)):
        assert len(read({**model, "potential": potential}, initial={"u": 15.0}).notes) == count


@pytest.mark.parametrize(
    ("model", "potential"),
    [
        (HELD, "1.5*u**2/2"),
        (JOINED, "3*(x**2 + y**2)/2 - 2*x*y"),
        (TURNED, "(x**2 + y**2)/2"),
        ({"acceleration": "-(1 + 0.1*cos(t))*u + 2"}, "u**2/2"),
        ({"acceleration": "-u - 0.3*sign(v) + (1 - u**2)*v"}, "u**2/2"),
    ],
)
def test_a_potential_of_forces_beside_others_is_not_noted(model, potential):
    assert read({**model, "potential": potential}, initial={}).notes == ()


@pytest.mark.parametrize("value", ["relative_energy_error", "relative_energy_error_d2t"])
def test_the_error_of_an_energy_without_a_potential_is_refused(value):
    hill = {f: f"2*{f}*exp(-x**2 - y**2)" for f in ("x", "y")}
    around = {"coordinates": ["x", "y"], "force": hill}
    check = {"value": value, "below": 1e-3}
    (fault,) = refused(around, initial={"x": 1.0}, checks=[check])
    assert "no potential energy was found" in fault
    assert "write its `potential`" in fault
    written = {**around, "potential": "exp(-x**2 - y**2)"}
    assert read(written, initial={"x": 1.0}, checks=[check]).notes == ()


def test_energies_without_a_potential_are_noted():
    around = {"coordinates": ["x", "y"], "force": {"x": "-y", "y": "x"}}
    ((_, note),) = read(around, initial={"x": 1.0}).notes
    assert "energies are kinetic alone" in note


def test_a_place_of_a_sweep_without_one_says_so():
    asked = {"value": "end", "quantity": "u", "at": {"model.k": 2}, "equals": 1, "atol": 1}
    (fault,) = refused({"acceleration": "-u"}, checks=[asked])
    assert "`at` names values of a sweep, and there is none" in fault


@pytest.mark.slow
def test_masses_in_common_that_would_take_minutes_to_compile_are_refused():
    model, _ = links(14)
    (fault,) = refused(model)
    assert "has more than 20000 operations" in fault


def test_one_equation_needs_no_names():
    model = read({"acceleration": "mu*(1 - u**2)*v - u", "parameters": {"mu": 1}}).model
    assert model.coordinates == ("u",)
    assert model.definition.velocities == ("v",)
    assert model.definition.equation == "u'' = mu*(1 - u**2)*u' - u"
    assert not model.definition.conservative


def test_the_order_of_keys_does_not_matter_and_that_of_coordinates_does():
    swapped = {**PAIR, "acceleration": dict(reversed(PAIR["acceleration"].items()))}
    assert canonical(read(PAIR)) == canonical(read(swapped))
    other = read({**PAIR, "coordinates": ["y", "x"]})
    assert other.model.definition.position == "y"
    assert canonical(other) != canonical(read(PAIR))


def test_every_coordinate_is_checked_where_no_check_is_given():
    assert [check.converges for check in read(PAIR).checks] == ["x", "y"]


def test_units_and_sweeps_are_those_of_any_model():
    experiment = read(
        PAIR,
        initial={"x": "180 degree"},
        sweep={"model.parameters.k": [1, "2e3 g"], "initial.vy": {"linspace": [0, 1, 3]}},
    )
    assert experiment.initial["x"] == pytest.approx(3.141592653589793, abs=0)
    assert experiment.members == 6


def test_periods_are_those_of_the_lowest_frequency():
    experiment = read(
        {"coordinates": ["x", "y"], "acceleration": {"x": "-4*x", "y": "-0.25*y + x**2"}},
        time={"periods": 3, "steps_per_period": 32},
        levels=[0, 1],
    )
    assert experiment.time.end == pytest.approx(3 * 4 * 3.141592653589793)


def test_a_system_without_parameters_runs_and_converges():
    assert judged(read({"acceleration": "-sin(u) - 0.1*v"}, initial={"u": 1.0})) == [
        ("PASS", "asymptotic")
    ]


@pytest.mark.slow
def test_a_manufactured_motion_is_followed_by_every_state():
    exact = {"x": "sin(t)", "y": "exp(-t)*cos(2*t)"}
    checks = [{"converges": name, "order": 4} for name in ("x", "y", "vx", "vy")]
    experiment = read({**PAIR, "exact": exact}, checks=checks)
    assert experiment.initial == pytest.approx({"x": 0.0, "y": 1.0, "vx": 1.0, "vy": -1.0})
    assert judged(experiment) == [("PASS", "asymptotic")] * 4


def test_an_exact_degree_is_that_of_the_same_equation_of_another_model():
    def degree(model):
        return exact_degree(SCHEMES["central"].stepper_for(model, options), model)

    options = SCHEMES["central"].defaults()
    own = read({"acceleration": "-2*u"}).model.definition
    assert degree(own) == degree(MODELS["oscillator"].written({"spring": "2*u"}, ())) > 1


@pytest.mark.parametrize(
    ("model", "told"),
    [
        ({}, ["model.acceleration: required key is missing: write acceleration or force"]),
        ({"potential": "u**2"}, ["write acceleration or force: `potential` alone makes no forces"]),
        (
            {"acceleration": "-u + nonsense", "force": {"x": "-u + 2*"}, "mass": 0},
            [
                "model.acceleration: -u + nonsense: unknown name 'nonsense' at character 6; it may name u, v, t "
                "and parameters: choose from e, pi, t, u, v",
                "model.force: must not be given together with acceleration",
                "model.force.x: unknown coordinate: choose from u",
                "model.mass.u: 0: must be greater than 0, is 0",
            ],
        ),
        (
            {**PAIR, "acceleration": {"x": "-x"}},
            ["model.acceleration: must have a formula for each coordinate, has none for y"],
        ),
        (
            {**PAIR, "acceleration": {"x": "-x", "z": "-y"}},
            ["model.acceleration.z: unknown coordinate: choose from x, y"],
        ),
        (
            {**PAIR, "acceleration": "-x"},
            ["model.acceleration: must have a formula for each of x, y: e.g. {x: ...}"],
        ),
        (
            {**PAIR, "coordinates": ["x", "sin", "1a"]},
            [
                "model.coordinates[1]: 'sin' is a function of formulas: choose another name",
                "model.coordinates[2]: must consist of letters, digits and _, and begin with a letter: "
                "choose another name",
            ],
        ),
        (
            {**PAIR, "parameters": {"k": 2, "vx": 1}},
            ["model.parameters.vx: 'vx' is the velocity: choose another name"],
        ),
        (
            {**PAIR, "outputs": {"x_end": "x", "sum": "x + q"}},
            [
                "model.outputs.sum: x + q: unknown name 'q' at character 5; it may name x, y, vx, vy, t and "
                "parameters: choose from e, k, pi, t, vx, vy, x, y",
                "model.outputs.x_end: 'x_end' is what results may call something of 'x': choose another name",
            ],
        ),
        ({**PAIR, "mass": 2}, ["model.mass: has a meaning beside force only"]),
        (
            {**PAIR, "exact": {"x": "abs(t - 1)", "y": "t"}},
            [
                "model.exact.x: abs(t - 1): its slope jumps near t = 1, and the equation has its second "
                "derivative: write a solution whose value and slope have no jumps"
            ],
        ),
        (
            {"coordinates": [f"q{i}" for i in range(65)], "acceleration": {"q0": "-q0"}},
            ["must not have more than 64 entries, has 65"],
        ),
        (
            {**PUSHED, "mass": {"x": {"y": "vx"}, "z": 1}},
            [
                "model.mass.x.y: vx: unknown name 'vx' at character 1; it may name x, y and parameters: "
                "did you mean 'x'?",
                "model.mass.z: unknown coordinate: choose from x, y",
            ],
        ),
        (
            {**PUSHED, "mass": {"x": {"x": 0, "y": 0.5}, "y": {"x": 0.5}}},
            [
                "model.mass.x.x: 0: must be greater than 0, is 0",
                "model.mass.y.x: is that of x and y, which is given already: leave it out",
            ],
        ),
        (
            {**PUSHED, "mass": {"x": {"y": 2}}},
            [
                "model.mass: must be positive definite, and is not at the start: "
                "every motion must have a positive kinetic energy"
            ],
        ),
        (
            {"coordinates": ["x", "y"], "equation": {"x": "x'' + x = 0", "y": "y'' + y = 0"}},
            [
                "model.equation: must be the equation of one coordinate: "
                "of several give each its `acceleration`, or `force` and `mass`"
            ],
        ),
        (
            {"acceleration": "-u", "events": [{"when": "u - 1", "then": {"u'": "-v"}}]},
            ["model.events[0].then.u': unknown state: write v"],
        ),
        (
            {"force": "-u", "mass": "1 + v"},
            [
                "model.mass: 1 + v: unknown name 'v' at character 5; it may name u and parameters: choose from e, pi, u"
            ],
        ),
    ],
)  # fmt: skip
def test_all_faults_are_told_at_once(model, told):
    found = refused(model)
    assert len(found) == len(told), found
    for fault, expected in zip(found, told, strict=True):
        assert expected in fault


def test_masses_are_checked_where_every_member_begins_and_are_written_back(tmp_path):
    model = {**PUSHED, "mass": {"x": {"x": "1 + x", "y": "y/2"}, "y": 2}}
    (told,) = refused(model, sweep={"initial.x": [0.0, 1.0, -2.0]})
    assert "not at the start (where initial.x = -2)" in told
    made = read(model)
    path = tmp_path / "again.yaml"
    path.write_text(experiment_file.text(made), encoding="utf-8")
    assert Experiment.from_yaml(path).model == made.model


@pytest.mark.parametrize(
    ("model", "scheme", "told"),
    [
        ({"acceleration": "-u - v**3"}, "velocity_verlet", "whose acceleration depends on v"),
        (
            {**PUSHED, "mass": {"x": "1 + y**2"}},
            "velocity_verlet",
            "whose acceleration depends on vx",
        ),
        (
            {**PAIR, "acceleration": {"x": "-x", "y": "-y - 0.1*vy"}},
            "central",
            "cannot treat system, whose acceleration depends on vy",
        ),
        (
            {
                "coordinates": [f"q{i}" for i in range(9)],
                "acceleration": {f"q{i}": f"-q{i}" for i in range(9)},
            },
            "gauss4",
            "cannot treat 9 coordinates: it solves for 18 unknowns in each step, and can for 16 at most",
        ),
    ],
)
def test_a_scheme_that_does_not_apply_is_refused_with_the_reason(model, scheme, told):
    (fault,) = refused(model, schemes=[scheme])
    assert told in fault


def test_linear_and_quadratic_damping_of_one_coordinate_are_recognised():
    for text in ("-u - 2*c*v", "cos(t) - (u + c*abs(v)*v)/2"):
        model = {"acceleration": text, "parameters": {"c": 0.1}}
        assert judged(read(model, schemes=["central"], initial={"u": 1.0}))[0][0] == "PASS"


def test_a_formula_that_a_comma_ends_is_told_how_to_be_written(tmp_path):
    file = tmp_path / "cut.yaml"
    file.write_text(
        "title: t\nmodel: {kind: system, coordinates: [x, y], force: {x: -hypot(x, y), y: -y}, mass: {x: 1, y: 1}}\n"
        "time: {end: 1}\nlevels: [3, 4, 5]\nschemes: [rk4]\n"
    )
    with pytest.raises(InputError) as caught:
        Experiment.from_yaml(file)
    hints = {fault.hint for fault in caught.value.faults if fault.key == "model.force.y)"}
    assert hints == {
        "between braces a comma ends a value: write a formula with commas in quotation marks"
    }


def test_a_swept_parameter_is_found_by_its_own_name():
    (fault,) = refused(PAIR, sweep={"model.k": [1.0, 2.0]})
    assert fault.endswith("cannot be swept: did you mean 'model.parameters.k'?")


@pytest.mark.parametrize(
    ("changed", "rule"),
    [
        ({"force": [1, 2]}, "must be a formula, or a mapping of coordinates to formulas"),
        ({"potential": {"x": "x**2/2"}}, "must be a formula, or a list of terms"),
        ({"outputs": "y - x"}, "e.g. {stretch: y - x}"),
    ],
)
def test_a_value_of_another_form_is_told_which_forms_there_are(changed, rule):
    [fault] = refused(PUSHED | changed)
    assert rule in fault


def test_an_initial_value_that_names_a_parameter_is_told_what_to_write():
    [fault] = refused({"acceleration": "-a*u", "parameters": {"a": 2}}, initial={"u": "2*a"})
    assert "cannot name a: write the number" in fault
