"""Formulas of a user: what is taken, what is refused where and why, and that names mean what the user says."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from experiment_files import build, calls_at_most, faults_of, only_fault, write

from vibsim import simulate
from vibsim.cli import main
from vibsim.engine import LANES, integrate
from vibsim.experiment import Experiment, canonical, restore
from vibsim.models.oscillator import written
from vibsim.schemes import SCHEMES
from vibsim.simulation.members import members

HEAD = "title: An oscillator\nmodel:\n  kind: oscillator\n"
TAIL = "time: {end: 5.0}\nlevels: {from: 4, to: 6}\nschemes: [rk4]\n"
FIRST = 4
"""Line of the first key of a model."""
Capture = pytest.CaptureFixture[str]


def text_of(model: str, more: str = "") -> str:
    """Return a file with these lines in its section ``model``, and these behind it."""
    lines = "".join(f"  {line}\n" for line in model.splitlines())
    return HEAD + lines + more + TAIL


def oscillator(more: dict[str, Any] | None = None, **model: Any) -> Experiment:
    return build(**_sections(more, model))


def _sections(more: dict[str, Any] | None, model: dict[str, Any]) -> dict[str, Any]:
    usual = {"initial": None, "schemes": ["rk4"], "time": {"end": 5.0}, "levels": [5, 6]}
    return {**usual, "model": {"kind": "oscillator", **model}, **(more or {})}


@pytest.fixture(scope="module", autouse=True)
def _imported() -> None:
    """Take the time of what the first command imports out of the times below."""
    oscillator(spring="k*u", parameters={"k": 1})
    assert main(["list", "models"]) == 0


SOUND = {
    "nothing": "",
    "numbers": "m: 2*pi\nspring: 2\nforce: 0.5",
    "all": "m: 1.5\nspring: k*u + u**3\ndamping: {quadratic: 0.3}\nforce: F0*cos(2*t)\n"
    "parameters: {k: 2.0, F0: 0.5}",
    "damping": "damping: c*v + v**3/10\nparameters: {c: 0.1}",
    "linear": "damping: {linear: 1/30}",
    "driving": "damping: {linear: -0.1}",
    "friction": "damping: mu*sign(v)\nparameters: {mu: 0.1}",
    "own b": "damping: b*v\nparameters: {b: 0.1}",
    "exact": "spring: sin(u)\ndamping: {linear: 0.1}\nexact: a*cos(w*t)\nparameters: {a: 1, w: 2}",
    "constants": "spring: pi*u + e*u**3",
    "own constant": "spring: e*u\nparameters: {e: 2}",
    "spaces": 'spring: "  k * u  "\nparameters: {k: 2*pi}',
    "fast": "spring: sin(20*u)",
    "of one side": "spring: u**1.5",
    "with a potential": "spring: where(u<1,u,2*u-1)\npotential: where(u<1,0.5*u**2,u**2-u+0.5)",
    "with a jump": "spring: u + 3*heaviside(u - 0.7) + floor(u)",
    "with two slopes": "spring: u if u < 1 else 2*u - 1",
    "with a stop": "spring: u + 10*max(u - 0.5, 0) + erf(u)",
    "with a constant": "spring: u\npotential: 0.5*u**2 + 7",
    "with poles": "spring: tan(u)\npotential: -log(cos(u))",
    "fast potential": "spring: sin(20*u)\npotential: 0.1*sin(10*u)**2",
    "rational": "spring: u/(1 + u**2)\npotential: 0.5*log(1 + u**2)",
    "parentheses": "spring: " + "(" * 90 + "u" + ")" * 90,
    "names": "parameters: {power: 1, k__: 1, K9: 1, print: 1, kind: 1, spring: 1, e: 1, pi: 1}",
}


@pytest.mark.parametrize("model", SOUND.values(), ids=SOUND)
def test_sound_files_are_taken(tmp_path: Path, capsys: Capture, model: str) -> None:
    assert main(["check", str(write(tmp_path, text_of(model)))]) == 0, capsys.readouterr().err
    experiment = Experiment.from_yaml(tmp_path / "case.yaml")
    assert restore(canonical(experiment)) == experiment
    assert restore(canonical(experiment)).model.definition is experiment.model.definition


LONG = "u + " * 250_000 + "u"
"""A megabyte."""
DEEP = "nest deeper than 100"
UNNAMED = "a name must consist of letters, digits and _"
WORD = "is a word of the grammar of formulas"

FAULTY: list[tuple[str, int, str, str, str]] = [
    # lines of the model, line of the fault, its key, its value as shown, the rule and the hint
    ("spring: q*u\nparameters: {k: 1}", 0, "spring", "q*u", "unknown name 'q' at character 1"),
    ("spring: stif*u\nparameters: {stiff: 1}", 0, "spring", "stif*u", "did you mean 'stiff'?"),
    ("spring: u\ndamping: c*v", 1, "damping", "c*v", "it may name v and parameters"),
    ("damping: b*v", 0, "damping", "b*v", "unknown name 'b' at character 1"),
    ("force: F0*cos(t)", 0, "force", "F0*cos(t)", "unknown name 'F0'"),
    ("force: cos(tt)", 0, "force", "cos(tt)", "did you mean 't'?"),
    ("force: cos(u)", 0, "force", "cos(u)", "it may name t and parameters"),
    ("exact: cos(w*t)", 0, "exact", "cos(w*t)", "unknown name 'w' at character 5"),
    ("spring: v", 0, "spring", "v", "it may name u and parameters"),
    ("damping: (1 - u**2)*v", 0, "damping", "(1 - u**2)*v", "on both takes `kind: system`"),
    ("spring: t*u", 0, "spring", "t*u", "unknown name 't'"),
    ("potential: x**2/2", 0, "potential", "x**2/2", "unknown name 'x'"),
    ("spring: sine(u)", 0, "spring", "sine(u)", "did you mean 'sin'?"),
    ("sprong: u", 0, "sprong", "u", "did you mean 'spring'?"),
    ("parameters: {lambda: 1}", 0, "parameters.lambda", "1", f"'lambda' {WORD}"),
    ("parameters: {is: 1}", 0, "parameters.is", "1", f"'is' {WORD}"),
    ("parameters: {and: 1}", 0, "parameters.and", "1", f"'and' {WORD}"),
    ("parameters: {None: 1}", 0, "parameters.None", "1", f"'None' {WORD}"),
    ("parameters: {t: 1}", 0, "parameters.t", "1", "'t' is the time"),
    ("parameters: {u: 1}", 0, "parameters.u", "1", "'u' is the displacement"),
    ("parameters: {v: 1}", 0, "parameters.v", "1", "'v' is the velocity"),
    ("parameters: {m: 1}", 0, "parameters.m", "1", "'m' is the mass"),
    ("parameters: {sin: 1}", 0, "parameters.sin", "1", "'sin' is a function"),
    ("parameters: {where: 1}", 0, "parameters.where", "1", "'where' is a function"),
    ("parameters: {b: 1}\ndamping: {linear: 1}", 0, "parameters.b", "1", "the damping"),
    ("parameters: {a b: 1}", 0, "parameters.a b", "1", UNNAMED),
    ("parameters: {'': 1}", 0, "parameters", "1", UNNAMED),
    ("parameters: {1x: 1}", 0, "parameters.1x", "1", UNNAMED),
    ("parameters: {_k: 1}", 0, "parameters._k", "1", UNNAMED),
    ("parameters: {__class__: 1}", 0, "parameters.__class__", "1", UNNAMED),
    ("parameters: {\u03b1: 1}", 0, "parameters.\u03b1", "1", UNNAMED),
    ("parameters: {k: .nan}", 0, "parameters.k", ".nan", "must be a finite number"),
    ("parameters: {k: u}", 0, "parameters.k", "u", "must be a number, or a constant formula"),
    ("parameters: {k: [1]}", 0, "parameters.k", "[1]", "must be a number"),
    ("parameters: [1]", 0, "parameters", "[1]", "must be a mapping"),
    ("spring: u.real", 0, "spring", "u.real", "attribute access is not allowed"),
    ("spring: (1).__class__", 0, "spring", "(1).__class__", "attribute access is not allowed"),
    ("spring: __import__(1)", 0, "spring", "__import__(1)", "unknown function '__import__'"),
    ("spring: \"__import__('os')\"", 0, "spring", "__import__('os')", '"\'" is not allowed'),
    ("spring: eval(u)", 0, "spring", "eval(u)", "unknown function 'eval'"),
    ("spring: power(u, 2)", 0, "spring", "power(u, 2)", "unknown function 'power'"),
    ("spring: sin(u)(u)", 0, "spring", "sin(u)(u)", "only a function can be called"),
    ("spring: sin(x=u)", 0, "spring", "sin(x=u)", "sin takes no arguments by keyword"),
    ("spring: sin(*u)", 0, "spring", "sin(*u)", "'*' is not allowed before an argument"),
    ("spring: sin(u, u)", 0, "spring", "sin(u, u)", "sin takes 1 argument(s), has 2"),
    ('spring: "(x for x in u)"', 0, "spring", "(x for x in u)", "this operation is not allowed"),
    ('spring: "[u for u in u]"', 0, "spring", "[u for u in u]", "'[' is not allowed"),
    ("spring: u[0]", 0, "spring", "u[0]", "'[' is not allowed"),
    ('spring: "lambda: u"', 0, "spring", "lambda: u", "':' is not allowed"),
    ("spring: u if u", 0, "spring", "u if u", "expected an operator"),
    ("spring: u and u", 0, "spring", "u and u", "'and', 'or' and 'not' need comparisons"),
    ("spring: mod(u)", 0, "spring", "mod(u)", "mod takes 2 argument(s), has 1"),
    ("spring: 1 < (u < 2) < 3", 0, "spring", "1 < (u < 2) < 3", "join two comparisons with and"),
    ("spring: u^2", 0, "spring", "u^2", "write ** for a power"),
    ("spring: 2u", 0, "spring", "2u", "write 2*u"),
    ("spring: 9**9**9*u", 0, "spring", "9**9**9*u", "has no finite value"),
    ("spring: u**9**9**9", 0, "spring", "u**9**9**9", "has no finite value"),
    ("spring: u**2000", 0, "spring", "u**2000", "an exponent must be at most 1024"),
    ("spring: u + sqrt(-1)", 0, "spring", "u + sqrt(-1)", "has no finite value"),
    ("spring: 1e999*u", 0, "spring", "1e999*u", "is too large"),
    ("spring: " + "-" * 150 + "u", 0, "spring", "-" * 20, DEEP),
    ("spring: " + "sin(" * 120 + "u" + ")" * 120, 0, "spring", "sin(sin(", DEEP),
    ("spring: " + "(" * 250 + "u" + ")" * 250, 0, "spring", "((((", DEEP),
    ("spring: " + "u**" * 400 + "u", 0, "spring", "u**u**", DEEP),
    ("spring: " + LONG, 0, "spring", "u + u", "must have at most 2000 characters, has 1000001"),
    ("spring: s\u0456n(u)", 0, "spring", "s\u0456n(u)", "character '\u0456' is not allowed"),
    ("spring: \uff55", 0, "spring", "\uff55", "is not allowed in a formula"),
    ("spring: 2\u00b7u", 0, "spring", "2\u00b7u", "write *"),
    ("spring: u \u2212 1", 0, "spring", "u \u2212 1", "write -"),
    ("spring: ''", 0, "spring", "", "must not be empty"),
    ("spring: '  '", 0, "spring", "", "is empty"),
    ("spring: true", 0, "spring", "true", "must be a formula, or a number"),
    ("spring: [1]", 0, "spring", "[1]", "must be a formula, or a number"),
    ("spring: .inf", 0, "spring", ".inf", "must be a finite number"),
    ("damping: .nan", 0, "damping", ".nan", "must be a finite number"),
    ("spring: {linear: 1}", 0, "spring", "{linear: 1}", "must be a formula, or a number"),
    ("m: 0", 0, "m", "0", "must be greater than 0"),
    ("exact: cos(t)\nforce: sin(t)", 1, "force", "sin(t)", "not be given together with exact"),
    ("exact: cos(t)\nforce: 0", 1, "force", "0", "not be given together with exact"),
    ("exact: 1/t", 0, "exact", "1/t", "must have a finite value at t = 0, where u is inf"),
    ("exact: sqrt(t)", 0, "exact", "sqrt(t)", "a finite value at t = 0, where v is inf"),
    (
        "damping: {linear: 1, quadratic: 1}",
        0,
        "damping",
        "",
        "one of linear, quadratic, coulomb, or be",
    ),
    ("damping: {}", 0, "damping", "", "must have one of linear, quadratic, coulomb, or be a"),
    ("damping: {coulomb: -1}", 0, "damping.coulomb", "-1", "friction opposes the motion"),
    (
        "damping: {coulomb: 1}\nexact: cos(t)",
        1,
        "exact",
        "cos(t)",
        "together with coulomb friction",
    ),
    ("damping: {cubic: 1}", 0, "damping.cubic", "1", "choose from linear, quadratic"),
    ("damping: {linear: b}", 0, "damping.linear", "b", "must be a number, or a constant formula"),
    ("damping: {linear: .inf}", 0, "damping.linear", ".inf", "must be a finite number"),
    ("spring: u*abs(u-1)", 0, "spring", "u*abs(u-1)", "write the energy as `potential`"),
    ("spring: 1/u", 0, "spring", "1/u", "write the energy as `potential`"),
    ("spring: u*exp(-u**2)", 0, "spring", "u*exp(-u**2)", "write the energy as `potential`"),
    ("spring: u\npotential: u**2", 1, "potential", "u**2", "is not the integral of the spring"),
    ("spring: u\npotential: u", 1, "potential", "u", "is not the integral of the spring"),
    (
        "spring: u\npotential: u**2/2 + (u > 0.7)",
        1,
        "potential",
        "u**2/2 + (u > 0.7)",
        "slope differs near u = 1",
    ),
    (
        "spring: u\npotential: sqrt(-u**2)",
        1,
        "potential",
        "sqrt(-u**2)",
        "cannot be compared with the spring",
    ),
]


def _id(row: tuple[str, int, str, str, str]) -> str:
    return row[0][:40].encode("ascii", "replace").decode()


@pytest.mark.parametrize(("model", "line", "key", "value", "rule"), FAULTY, ids=map(_id, FAULTY))
def test_faults_are_told_with_their_place(
    tmp_path: Path, capsys: Capture, model: str, line: int, key: str, value: str, rule: str
) -> None:
    file = write(tmp_path, text_of(model))
    # what is not refused at once takes ten times as much
    with calls_at_most(50_000_000):
        assert main(["check", str(file)]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert "Traceback" not in told.err
    (message,) = told.err.splitlines()
    head = f"{file}:{FIRST + line}: model.{key}: {value}"
    assert message.startswith(head)
    assert rule in message[len(head) :]
    assert len(message) < 600


def test_a_file_above_a_megabyte_is_refused(tmp_path: Path, capsys: Capture) -> None:
    assert main(["check", str(write(tmp_path, text_of(f"spring: {LONG * 2}")))]) == 2
    assert "must not be larger than 1048576 bytes" in capsys.readouterr().err


def test_every_fault_is_told_at_once() -> None:
    faults = faults_of(
        **_sections(
            {"initial": {"w": 1}},
            {"spring": "q*u", "damping": "u", "force": "v", "parameters": {"is": 1, "k": 1}},
        )
    )
    keys = {fault.key for fault in faults}
    parts = ("spring", "damping", "force", "parameters.is")
    assert keys == {"initial.w", *(f"model.{part}" for part in parts)}


def test_too_many_parameters_are_refused() -> None:
    fault = only_fault(**_sections(None, {"parameters": {f"k{i}": 1 for i in range(51)}}))
    assert "must not have more than 50 parameters, has 51" in fault.rule


@pytest.mark.parametrize(
    ("initial", "key", "start"),
    [
        ({"u": 1.0}, "initial.u", "must be 2, where"),
        ({"v": 1.0}, "initial.v", "must be 6, where"),
        ({"u": 2.0, "v": 0}, "initial.v", "must be 6, where"),
    ],
)
def test_initial_values_must_not_contradict_the_exact_solution(
    initial: dict[str, float], key: str, start: str
) -> None:
    model = {"exact": "a*cos(t) + 6*t", "parameters": {"a": 2}}
    fault = only_fault(**_sections({"initial": initial}, model))
    assert fault.key == key
    assert start in fault.rule


@pytest.mark.parametrize("initial", [None, {"u": 2.0}, {"u": 2, "v": 6}])
def test_initial_values_are_those_of_the_exact_solution(initial: Any) -> None:
    one = oscillator({"initial": initial}, exact="a*cos(t) + 6*t", parameters={"a": 2})
    assert one.initial == {"u": 2.0, "v": 6.0}


@pytest.mark.parametrize(
    ("model", "key", "hint"),
    [
        ({"exact": "cos(t)"}, "initial.u", "model.m"),
        ({"exact": "cos(t)"}, "initial.v", "model.m"),
        ({"parameters": {"k": 1}}, "model.k", "did you mean"),
        ({"parameters": {"k": 1}}, "model.parameters.q", "did you mean 'model.parameters.k'?"),
        ({}, "model.spring", "did you mean 'model.m'?"),
        ({}, "model.damping.linear", "choose from initial.u, initial.v, model.m, time.end"),
        ({"damping": "v"}, "model.damping.linear", "choose from"),
        (
            {"damping": {"quadratic": 1}},
            "model.damping.linear",
            "did you mean 'model.damping.quadratic'?",
        ),
    ],
)
def test_what_is_no_number_of_the_model_cannot_be_swept(
    model: dict[str, Any], key: str, hint: str
) -> None:
    fault = only_fault(**_sections({"sweep": {key: [1.0, 2.0]}}, model))
    assert fault.key == f"sweep.{key}"
    assert (fault.rule, hint in fault.hint) == ("cannot be swept", True)


def test_a_swept_mass_keeps_its_bound() -> None:
    fault = only_fault(**_sections({"sweep": {"model.m": [1, 0]}}, {}))
    assert (fault.key, fault.rule) == ("sweep.model.m[1]", "must be greater than 0")


SWEEP = {
    "model.parameters.k": [1.0, 2.5],
    "model.damping.linear": [0.0, 0.1, 3.0],
    "model.m": [0.5, 1.0],
}


@pytest.mark.slow
def test_every_member_has_its_own_numbers() -> None:
    """Against a file that writes the numbers of the member into its formulas."""
    swept = oscillator(
        {"sweep": SWEEP, "initial": {"u": 1, "v": -0.3}},
        spring="k*u + u**3",
        damping={"linear": 9},
        force="cos(k*t)",
        parameters={"k": 9},
    )
    data = simulate(swept, 5)
    cases = [(k, b, m) for k in (1.0, 2.5) for b in (0.0, 0.1, 3.0) for m in (0.5, 1.0)]
    assert swept.members == len(cases)
    for case, (k, b, m) in enumerate(cases):
        one = simulate(
            oscillator(
                {"initial": {"u": 1, "v": -0.3}},
                m=m,
                spring="k*u + u**3",
                damping={"linear": b},
                force="cos(k*t)",
                parameters={"k": k},
            ),
            5,
        )
        alone = simulate(swept.alone(case), 5)
        for name in ("u", "v", "potential_energy", "energy_deviation"):
            whole = data[name].isel(case=case).to_numpy()
            assert np.isfinite(whole).all()
            np.testing.assert_array_equal(whole, one[name].isel(case=0).to_numpy())
            np.testing.assert_array_equal(whole, alone[name].isel(case=0).to_numpy())
    ends = data.u.isel(scheme=0, time=-1) if "time" in data.u.dims else data.u[..., -1]
    assert len(np.unique(ends)) == len(cases)


@pytest.mark.slow
def test_a_member_alone_starts_on_its_own_exact_solution() -> None:
    swept = oscillator(
        {"sweep": {"model.parameters.a": {"linspace": [0.3, 1.9, 7]}, "model.m": [0.5, 2]}},
        spring="sin(u)",
        damping={"quadratic": 0.2},
        exact="tanh(a)*cos(a*t) + exp(-a*t/7)*sin(t + a)",
        parameters={"a": 1.1},
    )
    together = members(swept, 0, swept.members)
    data = simulate(swept, 5)
    assert len(np.unique(together.initial["u"])) == 7
    for case in range(swept.members):
        alone = swept.alone(case)
        a = alone.model.parameters["parameters.a"]
        assert alone.initial["u"] == pytest.approx(math.tanh(a) + math.sin(a), rel=1e-14)
        assert alone.initial["v"] == pytest.approx(math.cos(a) - math.sin(a) * a / 7, rel=1e-13)
        one = members(alone, 0, 1)
        for name in ("u", "v"):
            assert one.initial[name].tobytes() == together.initial[name][case : case + 1].tobytes()
        single = simulate(alone, 5)
        for name in ("u", "v", "u_exact", "v_exact", "energy_deviation"):
            np.testing.assert_array_equal(
                data[name].isel(case=case).to_numpy(), single[name].isel(case=0).to_numpy()
            )
        assert np.isfinite(single.u.to_numpy()).all()
        assert np.abs(single.u - single.u_exact).max() < 0.02


def test_a_member_alone_can_be_written_out_and_checked(tmp_path: Path, capsys: Capture) -> None:
    sweep = "sweep: {model.parameters.k: [1, 2], model.damping.linear: [0, 1]}\n"
    model = "spring: k*u\ndamping: {linear: 0.5}\nparameters: {k: 3}"
    file = write(tmp_path, text_of(model, sweep))
    assert main(["check", f"{file}@2"]) == 0
    assert "1 member" in capsys.readouterr().out
    one = Experiment.from_yaml(file).alone(2)
    assert one.model.parameters == {"m": 1.0, "damping.linear": 0.0, "parameters.k": 2.0}
    assert restore(canonical(one)) == one


OWN = ("p", "n", "dt", "power", "acceleration", "h", "state", "e", "pi", "I", "S", "N", "beta")
"""Names of the engine's own text, and of constants."""
PLAIN = tuple(f"quantity{i}" for i in range(len(OWN)))


def formulas(names: tuple[str, ...]) -> dict[str, str]:
    """Return formulas that use every name, each in its own way."""
    p, n, dt, power, acceleration, h, state, e, pi, *rest = names
    weights = " + ".join(f"{name}/{i + 2}" for i, name in enumerate(rest))
    return {
        "spring": f"({weights})*u + {e}*u**3",
        "damping": f"{p}*v + {n}*abs(v)**{power}",
        "force": f"{acceleration}*t - {state}*t**2 + {h}/({pi} + t) + {dt}",
    }


def test_a_parameter_may_have_any_name_that_is_allowed() -> None:
    """The same bits as with harmless names, in every lane."""
    rng = np.random.default_rng(3)
    count = 9
    parameters = rng.uniform(0.2, 0.9, (count, 1 + len(OWN)))
    initial = rng.uniform(-0.5, 0.5, (count, 2))
    dt = np.linspace(0.01, 0.05, count)

    def run(names: tuple[str, ...], lane: str, **more: Any) -> Any:
        model = written(formulas(names), names)
        numbers = (parameters, initial, dt, 64, 8)
        return integrate(model, SCHEMES["rk4"], {}, *numbers, lane=lane, **more)

    plain, own = run(PLAIN, "plain"), run(OWN, "plain")
    assert np.isfinite(plain.position).all()
    assert len(np.unique(plain.position[:, -1])) == count
    assert own.gathered.deviation.tobytes() == plain.gathered.deviation.tobytes()
    # compiled without energies, which take as long again
    compiled = [run(OWN, lane, with_gathered=False) for lane in LANES if lane != "plain"]
    for other in (own, *compiled):
        assert other.position.tobytes() == plain.position.tobytes()
        assert other.velocity.tobytes() == plain.velocity.tobytes()


def test_a_declared_name_wins_over_a_constant() -> None:
    """With e = 4 and pi = 9 the period is that of ``u'' + 36 u = 0``."""
    one = oscillator(
        {"initial": {"u": 1.0}, "levels": {"from": 8, "to": 9}},
        spring="e*pi*u",
        parameters={"e": 4, "pi": 9},
    )
    assert one.model.definition.natural_frequency(one.model.parameters) == 6.0
    data = simulate(one, 9)
    exact = np.cos(6 * 5.0)
    assert float(data.u.to_numpy().ravel()[-1]) == pytest.approx(exact, abs=1e-4)


def test_no_damping_is_called_none() -> None:
    """As the other words for a damping; schemes for forces of the position alone take it."""
    made = oscillator({"schemes": ["velocity_verlet"]}, damping="none")
    assert made.model == oscillator({"schemes": ["velocity_verlet"]}).model
    declared = oscillator(damping="none*v", parameters={"none": 0.1})
    assert not declared.model.definition.conservative


@pytest.mark.parametrize(
    ("model", "key", "rule", "hint"),
    [
        ({"damping": 0.3}, "model.damping", "does not depend on v", "write (0.3)*v"),
        (
            {"damping": "c", "parameters": {"c": 1}},
            "model.damping",
            "does not depend on v",
            "write (c)*v",
        ),
        ({"spring": None}, "model.spring", "must be a formula, or a number", "leave the key out"),
        ({"spring": "u/0"}, "model.spring", "a constant in it has no finite value", ""),
        ({"force": "t/(2 - 2)"}, "model.force", "a constant in it has no finite value", ""),
    ],
)
def test_what_is_likely_a_slip_is_refused(
    model: dict[str, Any], key: str, rule: str, hint: str
) -> None:
    fault = only_fault(**_sections(None, model))
    assert fault.key == key
    assert rule in fault.rule
    assert hint in fault.hint
