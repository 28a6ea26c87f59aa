"""Numbers with units: converted to those of the model, or refused with the unit that is wanted."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from experiment_files import build, content, faults_of, file_faults, only_fault, write
from hypothesis import given
from hypothesis import strategies as st
from test_fuzz import QUIET, attempt

from vibsim.experiment import Experiment, sweep_columns
from vibsim.experiment.known_units import DEFINITIONS, finite, meaning, registry, unit_named
from vibsim.experiment.schema.unit_text import MAX_EXPONENT, MAX_UNIT, UnitError, factors, split
from vibsim.experiment.units import MAX_OWN
from vibsim.models import MODELS, Model

OSCILLATOR = {"kind": "oscillator", "spring": "k*u", "damping": {"linear": 0.1}}


def pendulum(**parameters: object) -> dict[str, object]:
    return {"model": {"kind": "pendulum", **parameters}}


# --- conversion -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("4.9 m", 4.9),
        ("4.9m", 4.9),
        ("490 cm", 4.9),
        ("0.0049 km", 4.9),
        ("4.9 metre", 4.9),
        ("2*pi m", 2 * math.pi),
        ("sqrt(2) m", math.sqrt(2)),
        ("min(1, 2) m", 1.0),
        ("(3 - 1)/2 m", 1.0),
        ("1e-3 km", 1.0),
        ("3 m^2/m", 3.0),
        ("3 m**2 m-1", 3.0),
        ("6 m2*m-1", 6.0),
        ("3 m/s*s", 3.0),
    ],
)
def test_lengths(text: str, wanted: float) -> None:
    assert build(**pendulum(L=text)).model.parameters["L"] == wanted


@pytest.mark.parametrize(
    "text", ["9.81 m/s^2", "9.81 m/s**2", "9.81 m s-2", "9.81 m*s^-2", "981 cm/s/s", "9.81 N/kg"]
)
def test_accelerations(text: str) -> None:
    assert build(**pendulum(g=text)).model.parameters["g"] == 9.81


def test_every_section() -> None:
    experiment = build(
        **pendulum(m="250 g"),
        initial={"theta": "30 deg", "omega": "60 rpm"},
        time={"end": "2 min", "base_dt": "500 ms"},
    )
    assert experiment.model.parameters["m"] == 0.25
    assert experiment.initial["theta"] == pytest.approx(math.pi / 6, rel=1e-15)
    assert experiment.initial["omega"] == pytest.approx(2 * math.pi, rel=1e-15)
    assert experiment.time.end == 120.0
    assert experiment.time.base_steps == 240


def test_formula_before_a_unit() -> None:
    theta = build(initial={"theta": "2*pi/30 rad"}).initial["theta"]
    assert theta == build(initial={"theta": "2*pi/30"}).initial["theta"]


@pytest.mark.slow
@given(st.decimals(-1000, 1000, places=4))
def test_a_decimal_is_rounded_once(value: object) -> None:
    """So that a number in millimetres is the double of the same decimal in metres."""
    experiment = build(initial={"omega": f"{value}e3 rad/s", "theta": f"{value} rad"})
    assert experiment.initial["theta"] == float(str(value))
    assert experiment.initial["omega"] == float(f"{value}e3")
    sweep = {"initial.omega": [f"{value} rad/ms"]}
    assert sweep_columns.columns(build(sweep=sweep), 0, 1)["initial.omega"][0] == float(
        f"{value}e3"
    )


def test_plain_numbers_stay_what_they_are() -> None:
    plain = build(**pendulum(L=4.9, g="9.81"), time={"end": "20"})
    assert plain == build(**pendulum(L="4.9 m", g="9.81 m/s^2"), time={"end": "20 s"})


def test_sweeps() -> None:
    experiment = build(
        sweep={
            "model.L": ["1 m", 2, "300 cm", "2*2"],
            "model.g": {"linspace": ["1 m/s^2", "200 cm/s^2", 3]},
            "initial.omega": {"range": ["0 rad/s", "2 rad/s", "1000 rad/ks"]},
            "zip": {"model.m": {"logspace": ["1 g", "1 t", 3]}, "time.end": ["1 s", "1 min", 5]},
            "sample": {"method": "random", "n": 2, "seed": 1, "over": {"initial.theta": ["1 deg", "2 deg"]}},
        }
    )  # fmt: skip
    columns = sweep_columns.columns(experiment, 0, experiment.members)
    assert sorted(set(columns["model.L"])) == [1, 2, 3, 4]
    assert sorted(set(columns["model.g"])) == [1, 1.5, 2]
    assert sorted(set(columns["initial.omega"])) == [0, 1, 2]
    assert sorted(set(columns["model.m"])) == pytest.approx([1e-3, 1, 1e3])
    assert sorted(set(columns["time.end"])) == [1, 5, 60]
    assert (np.degrees(columns["initial.theta"]) >= 1).all()
    assert (np.degrees(columns["initial.theta"]) <= 2).all()


def test_the_count_of_a_rule_has_no_unit() -> None:
    fault = only_fault(sweep={"model.L": {"linspace": ["1 m", "2 m", "3 m"]}})
    assert (fault.key, fault.rule) == ("sweep.model.L.linspace[2]", "must be a whole number")


def test_oscillator() -> None:
    """Coefficients of damping have a unit of their own; declared parameters are converted to SI base units."""
    model = {**OSCILLATOR, "damping": {"linear": "300 g/s"}, "m": "1 t"}
    declared = {"k": "2 kN/m", "x": "1 mm", "plain": 3, "angle": "180 deg"}
    parameters = build(
        model={**model, "parameters": declared}, initial={"u": "1 cm"}
    ).model.parameters
    assert parameters["m"] == 1000.0
    assert parameters["damping.linear"] == 0.3
    assert parameters["parameters.k"] == 2000.0
    assert parameters["parameters.x"] == 1e-3
    assert parameters["parameters.plain"] == 3.0
    assert parameters["parameters.angle"] == pytest.approx(math.pi)


def test_swept_oscillator() -> None:
    model = {**OSCILLATOR, "parameters": {"k": 1}}
    sweep = {"model.damping.linear": ["1 g/s", 2], "model.parameters.k": ["1 kN/m", 3]}
    columns = sweep_columns.columns(build(model=model, initial={"u": 1}, sweep=sweep), 0, 4)
    assert sorted(set(columns["model.damping.linear"])) == [1e-3, 2]
    assert sorted(set(columns["model.parameters.k"])) == [3, 1000]


def test_equations_of_the_file_take_any_unit() -> None:
    """Numbers and initial values of a structure were 1 with a unit; coordinates took none."""
    system = {
        "kind": "system",
        "force": "-k*u",
        "mass": "m",
        "parameters": {"k": "2 kN/m", "m": "1 t"},
    }
    sweep = {"initial.v": ["60 rpm", "3 m/s"]}
    experiment = build(model=system, initial={"u": "4 cm"}, sweep=sweep)
    assert experiment.initial["u"] == 0.04
    columns = sweep_columns.columns(experiment, 0, 2)
    assert list(columns["initial.v"]) == [pytest.approx(2 * math.pi), 3.0]
    structure = {
        "kind": "structure",
        "mass": ["2 t", 1000],
        "stiffness": [["3 kN/m", "-1 kN/m"], ["-1 kN/m", 1000]],
        "damping_ratios": "5 %",
        "load": {"2": "F", "1": "3 kN"},
        "start": {"displacement": {"mode": 1, "size": "2 mm"}, "velocity": [0, "5 mm/s"]},
        "parameters": {"F": "2 kN"},
    }
    sweep = {"model.parameters.F": ["2 kN", 1000]}
    experiment = build(model=structure, sweep=sweep, initial=None)
    assert list(sweep_columns.columns(experiment, 0, 2)["model.parameters.F"]) == [2000, 1000]
    plain = {**structure, "mass": [2000, 1000], "stiffness": [[3000, -1000], [-1000, 1000]]}
    plain |= {"damping_ratios": 0.05, "load": {"2": "F", "1": 3000.0}, "parameters": {"F": 2000.0}}
    plain["start"] = {"displacement": {"mode": 1, "size": 0.002}, "velocity": [0, 0.005]}
    assert experiment.model == build(model=plain, sweep=sweep, initial=None).model
    moving = {name: plain[name] for name in ("kind", "mass", "stiffness")}
    sweep = {"initial.u2": ["1 mm", "2 cm"]}
    experiment = build(model=moving, initial={"vu2": "10 cm/s"}, sweep=sweep)
    assert experiment.initial["vu2"] == 0.1
    assert list(sweep_columns.columns(experiment, 0, 2)["initial.u2"]) == [0.001, 0.02]


SI = {
    "N": "kg m s-2", "Pa": "kg m-1 s-2", "J": "kg m2 s-2", "W": "kg m2 s-3", "C": "s A", "V": "kg m2 s-3 A-1",
    "ohm": "kg m2 s-3 A-2", "F": "kg-1 m-2 s4 A2", "H": "kg m2 s-2 A-2", "Hz": "s-1", "bar": "1e5 kg m-1 s-2",
    "t": "1e3 kg", "min": "60 s", "h": "3600 s", "day": "86400 s", "%": "0.01", "g": "1e-3 kg",
    "deg": f"{math.pi / 180} rad", "turn": f"{2 * math.pi} rad", "rpm": f"{math.pi / 30} rad s-1",
}  # fmt: skip
"""Units in base units, from the SI brochure (9th edition), tables 4 and 8."""


@pytest.mark.parametrize("name", SI)
def test_units_are_those_of_the_si(name: str) -> None:
    number, _, text = SI[name].partition(" ") if SI[name][0].isdigit() else ("1", "", SI[name])
    unit = meaning(name)
    assert float(unit.factor) == pytest.approx(float(number), rel=1e-15)
    assert unit.text == (text or "1")


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_every_unit_of_a_model_is_known(model: Model) -> None:
    units = [*(row.unit for row in model.states), *(row.unit for row in model.parameters)]
    units += [unit for row in model.formulas for unit in row.term_units.values()]
    for unit in [*units, model.energy_unit]:
        assert meaning(unit).factor > 0


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_every_coefficient_has_a_unit(model: Model) -> None:
    for row in model.formulas:
        assert set(row.term_units) == set(row.terms)


# --- refusals ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "key", "rule", "hint"),
    [
        (pendulum(L="3 kg"), "model.L", "must be a length [m], but kg is a mass", ""),
        (pendulum(g="3 m"), "model.g", "must be an acceleration [m s-2], but m is a length", ""),
        (pendulum(L="3 rad"), "model.L", "must be a length [m], but rad is an angle", ""),
        (pendulum(L="50 %"), "model.L", "must be a length [m], but % is a plain number", ""),
        (pendulum(L="1 kg s"), "model.L", "but kg s is a quantity in kg s", ""),
        (pendulum(L="4 metres2 foo"), "model.L", "unknown unit 'foo'", "choose from m, km"),
        (pendulum(L="4 metr"), "model.L", "unknown unit 'metr'", "did you mean 'metre'?"),
        (pendulum(m="4 Kg"), "model.m", "unknown unit 'Kg'", "did you mean 'kg'?"),
        (pendulum(L="20 degC"), "model.L", "unknown unit 'degC'", ""),
        (pendulum(L="1 m + 2 m"), "model.L", "not of '+'", ""),
        (pendulum(L="4 m m3 os.system"), "model.L", "not of '.'", ""),
        (pendulum(L="4 m __import__('os')"), "model.L", "not of '_'", ""),
        (pendulum(L="4 m^0"), "model.L", "an exponent of a unit must be -9 to 9", ""),
        (pendulum(L="4 m^10"), "model.L", "an exponent of a unit must be -9 to 9", ""),
        (pendulum(L="4 m^1.5"), "model.L", "not of '.'", ""),
        (pendulum(L="4 m/"), "model.L", "a name must follow at its end", ""),
        (pendulum(L="4 J/kg m"), "model.L", "must not have a blank after a '/'", "kg-1"),
        (pendulum(L="4 m" + "*m" * 100), "model.L", f"at most {MAX_UNIT} characters", ""),
        (pendulum(L="1/0 m"), "model.L", "must be a number, or a constant formula", ""),
        (pendulum(L="1e308 km"), "model.L", "must be a finite number", ""),
        (pendulum(L="-1 m"), "model.L", "must be greater than 0", ""),
        (pendulum(L="0 mm"), "model.L", "must be greater than 0", ""),
        ({"initial": {"theta": "3 m"}}, "initial.theta", "must be an angle [rad]", ""),
        ({"initial": {"omega": "2 Hz"}}, "initial.omega", "must be an angular velocity", "2*pi"),
        ({"time": {"end": "3 m"}}, "time.end", "must be a time [s], but m is a length", ""),
        (
            {"time": {"periods": "3 s", "steps_per_period": 4}},
            "time.periods",
            "must be a plain number, but s is a time",
            "",
        ),
        ({"sweep": {"model.L": ["1 m", "1 s"]}}, "sweep.model.L[1]", "must be a length [m]", ""),
        (
            {"sweep": {"model.L": {"linspace": ["1 m", "1 s", 3]}}},
            "sweep.model.L.linspace[1]",
            "must be a length [m]",
            "",
        ),
    ],
)  # fmt: skip
def test_refused(changes: dict[str, object], key: str, rule: str, hint: str) -> None:
    fault = only_fault(**changes)
    assert fault.key == key
    assert rule in fault.rule
    assert hint in fault.hint


def test_all_faults_at_once_with_their_lines(tmp_path: Path) -> None:
    faults = file_faults(
        tmp_path,
        "title: x\nmodel:\n  kind: pendulum\n  L: 3 kg\n  g: 4 foo\ninitial: {theta: 1 m, x: 2 m}\n"
        "time: {end: 3 kg}\nlevels: [2, 1]\nschemes: [centrall]\n",
    )
    places = [(fault.line, fault.key) for fault in faults]
    assert places == [
        (4, "model.L"),
        (5, "model.g"),
        (6, "initial.theta"),
        (6, "initial.x"),
        (7, "time.end"),
        (8, "levels[1]"),
        (9, "schemes[0]"),
    ]
    assert faults[0].value == "3 kg"


def test_exit_status_is_2(tmp_path: Path) -> None:
    path = write(tmp_path, json.dumps(content(**pendulum(L="3 kg"))))
    done = subprocess.run(
        [sys.executable, "-m", "vibsim", "check", str(path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "must be a length [m], but kg is a mass" in done.stdout + done.stderr
    assert "Traceback" not in done.stderr


def test_a_unit_of_an_unknown_key_is_not_looked_at() -> None:
    assert [fault.rule for fault in faults_of(**pendulum(l="3 foo"))] == ["unknown key"]
    assert [fault.rule for fault in faults_of(initial={"x": "3 foo"})] == ["unknown state"]
    assert [fault.rule for fault in faults_of(sweep={"model.l": ["3 foo"]})] == ["cannot be swept"]


def test_texts_are_no_quantities() -> None:
    """A formula of a model, a word of an option and a title may look like one."""
    spring = {"kind": "oscillator", "spring": "3 m"}
    fault = only_fault(model=spring, initial={"u": 1})
    assert (fault.key, fault.hint) == (
        "model.spring",
        "a formula has no units: declare the number under `parameters:`",
    )
    assert build(title="4.9 m").title == "4.9 m"
    structure = {"kind": "structure", "stiffness": "frame 2 m.csv"}
    assert only_fault(model=structure, initial=None).rule.startswith("there is no such file")
    fault = only_fault(sweep={"schemes.central.start": ["3 m"]})
    assert fault.rule == "unknown choice"


@pytest.mark.parametrize("text", ["2 pi", "2pi", "2 sin(1)", "1 for 2 in 3", "2 e"])
def test_a_forgotten_operator_is_no_unit(text: str) -> None:
    assert split(text) is None
    assert "constant formula" in only_fault(**pendulum(L=text)).rule


# --- units of a file --------------------------------------------------------------------------------


def test_units_of_a_file() -> None:
    experiment = build(
        units={"rod": "4.9 m", "tick": "1/sqrt(2) s", "score": 20, "swing": "3 tick"},
        **pendulum(L="1 rod", g="1 rod/tick^2", m="2 score kg"),
        time={"end": "1 swing"},
    )
    assert experiment.model.parameters["L"] == 4.9
    assert experiment.model.parameters["g"] == pytest.approx(9.8, rel=1e-15)
    assert experiment.model.parameters["m"] == 40.0
    assert experiment.time.end == pytest.approx(3 / math.sqrt(2), rel=1e-15)
    assert experiment.units["rod"] == "4.9 m"


@pytest.mark.parametrize(
    ("name", "value", "rule"),
    [
        ("min", "3 s", "'min' is a function of formulas"),
        ("pi", "3 s", "'pi' is a constant of formulas"),
        ("kg", "3 s", "'kg' is a unit already"),
        ("mm", "3 s", "'mm' is a unit already"),
        ("seconds", "3 s", "'seconds' is a unit already"),
        ("rod2", "3 m", "must consist of letters and _"),
        ("a b", "3 m", "must consist of letters and _"),
        ("lambda", "3 m", "must consist of letters and _"),
        ("rod", "0 m", "must be greater than 0"),
        ("rod", "-1 m", "must be greater than 0"),
        ("rod", "1e308 km", "must be a finite number"),
        ("rod", "1 rod", "unknown unit 'rod'"),
        ("rod", "m", "must be a number"),
        ("rod", [1], "must be a number with a unit"),
        ("rod", None, "must be a number with a unit"),
        ("rod", True, "must be a number with a unit"),
        ("rod", math.inf, "must be a finite number"),
        ("rod", 10**400, "must be a finite number"),
    ],
)
def test_refused_definitions(name: str, value: object, rule: str) -> None:
    """Nothing is said about what is measured in a unit whose definition is refused."""
    fault = only_fault(units={name: value}, **pendulum(L=f"1 {name}" if name == "rod" else 1))
    assert fault.key == f"units.{name}"
    assert rule in fault.rule


def test_units_must_be_a_mapping_of_some_names() -> None:
    assert only_fault(units=[1]).rule == "must be a mapping"
    many = {"x" * (i + 1): "1 m" for i in range(MAX_OWN + 1)}
    assert f"must not have more than {MAX_OWN} units" in only_fault(units=many).rule


def test_an_own_unit_is_offered() -> None:
    fault = only_fault(units={"rod": "4.9 m"}, **pendulum(L="3 rods"))
    assert fault.hint == "did you mean 'rod'?"


def test_powers_of_powers_end() -> None:
    units = {"a": "2 kg^9"} | {
        chr(98 + i): f"1 {chr(97 + i)}^9" for i in range(8) if chr(98 + i) not in "gmsedh"
    }
    assert "has an exponent of kg above 99" in faults_of(units=units)[0].rule


# --- the grammar and the registry -------------------------------------------------------------------


def test_factors() -> None:
    assert [(row.name, row.exponent) for row in factors("kg m2/s^3*N**-2")] == [
        ("kg", 1), ("m", 2), ("s", -3), ("N", -2),
    ]  # fmt: skip
    assert factors(f"m{MAX_EXPONENT}")[0].exponent == MAX_EXPONENT


@given(st.text(max_size=30))
def test_any_unit_is_read_or_refused(text: str) -> None:
    rule = ""
    try:
        assert finite(meaning(text).factor) >= 0.0
    except UnitError as error:
        rule = error.rule
    assert rule or text == "1" or factors(text)


PIECES = ("3", "1e9", "-", "m", "s", "kg", "rod", "deg", "^", "**", "/", "*", " ", "2", "-2", "(", ")",
          "pi", "sqrt", ".", "_", "%", "\u00b0", "os.system", "9" * 400, "\u00e9", "lambda")  # fmt: skip
QUANTITY = st.one_of(
    st.text(max_size=12), st.lists(st.sampled_from(PIECES), max_size=8).map("".join)
)


@pytest.mark.slow
@given(
    QUANTITY,
    QUANTITY,
    QUANTITY,
    st.dictionaries(QUANTITY, st.one_of(QUANTITY, st.floats()), max_size=3),
)
@QUIET
def test_any_text_is_a_quantity_or_a_fault(
    length: str, angle: str, end: str, units: dict[str, object]
) -> None:
    changes = {"units": units, "initial": {"theta": angle}, "time": {"end": end}}
    sweep = {"model.g": [length, end], "model.m": {"linspace": [length, angle, 3]}}
    attempt(lambda: Experiment.from_dict(content(**pendulum(L=length), **changes, sweep=sweep)))


def test_prefixes_and_names() -> None:
    assert unit_named("km") == unit_named("kilometre") == meaning("km")
    assert unit_named("nothing") is None
    assert registry() is registry()


@pytest.mark.slow
def test_pint_is_imported_for_units_alone(tmp_path: Path) -> None:
    probe = (
        "import sys; from vibsim.experiment import Experiment\n"
        "Experiment.from_yaml(sys.argv[1]); print('pint' in sys.modules)"
    )
    for changes, wanted in (({}, "False"), (pendulum(L="4.9 m"), "True")):
        path = write(tmp_path, json.dumps(content(**changes)))
        command = [sys.executable, "-c", probe, str(path)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        assert done.stdout.strip() == wanted


def test_every_unit_is_documented() -> None:
    text = (Path(__file__).resolve().parents[2] / "docs/experiment-file.md").read_text()
    told = set(re.findall(r"`([^`\n]+)`", text.partition("\n## units\n")[2].partition("\n## ")[0]))
    names = [line.split(" = ")[0] for line in DEFINITIONS.splitlines() if "offset" not in line]
    assert len(names) > 30
    assert [name for name in names if name.rstrip("-") not in told and name[-1] != "-"] == []


@pytest.mark.parametrize(
    ("check", "key"),
    [
        ({"value": "end", "quantity": "theta", "equals": "1 rad"}, "checks[0].equals"),
        (
            {"value": "at", "quantity": "theta", "at": {"t": "20 s"}, "below": 1},
            "checks[0].at.t",
        ),
    ],
)
def test_a_unit_where_none_is_taken_is_called_a_unit(check: dict[str, object], key: str) -> None:
    fault = only_fault(checks=[check])
    assert fault.key == key
    assert fault.rule.startswith("must be a number without a unit")
    assert "number alone" in fault.hint
