"""Bad input is refused with its file, line, key and rule; every fault of a file at once, and never a traceback."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from vibsim import Experiment, InputError, VibsimError

from .door import Content, build, vibsim

GOOD: Content = {
    "model": {"kind": "pendulum"},
    "initial": {"theta": 1.0},
    "time": {"end": 20.0},
    "levels": [6, 7, 8],
    "schemes": ["central"],
}

TEXT = """\
title: A pendulum
model: {kind: pendulum, g: 1.0}
initial: {theta: 1.0}
time: {end: 20.0}
levels: [6, 7, 8]
schemes: [central]
checks:
  - {converges: theta, order: 2}
"""

# what is replaced in TEXT by what; the line of the fault, its key, and words of the nearest choice
FILES: dict[str, tuple[str, str, int, str, str]] = {
    "unknown key": ("title:", "titel: x\ntitle:", 1, "titel", "'title'"),
    "unknown model": ("kind: pendulum", "kind: pendulun", 2, "model.kind", "'pendulum'"),
    "unknown parameter": ("g: 1.0", "gg: 1.0", 2, "model.gg", "g"),
    "unknown state": ("theta: 1.0", "theat: 1.0", 3, "initial.theat", "'theta'"),
    "unknown scheme": ("[central]", "[centrall]", 6, "schemes[0]", "'central'"),
    "unknown quantity": (
        "converges: theta",
        "converges: thetta",
        8,
        "checks[0].converges",
        "'theta'",
    ),
    "unknown check": ("converges: theta, order: 2", "convergs: theta", 8, "checks[0]", "converges"),
    "duplicate key": ("time:", "title: again\ntime:", 4, "title", ""),
    "NaN": ("end: 20.0", "end: .nan", 4, "time.end", ""),
    "infinity": ("theta: 1.0", "theta: .inf", 3, "initial.theta", ""),
    "wrong type": ("g: 1.0", "g: true", 2, "model.g", ""),
    "text for a number": ("g: 1.0", "g: heavy", 2, "model.g", ""),
    "out of range": ("g: 1.0", "g: -1.0", 2, "model.g", ""),
    "level out of range": ("[6, 7, 8]", "[6, 7, 99]", 5, "levels[2]", ""),
    "levels that fall": ("[6, 7, 8]", "[7, 6]", 5, "levels[1]", ""),
    "repeated scheme": ("[central]", "[central, central]", 6, "schemes[1]", ""),
    "wrong unit": ("g: 1.0", "g: 1 kg", 2, "model.g", "m s-2"),
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "bad_one.yaml"
    path.write_text(TEXT)
    return path


def fault(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        Experiment.from_yaml(path)
    return str(caught.value)


def test_the_file_is_right_before_it_is_changed(file: Path) -> None:
    assert Experiment.from_yaml(file).levels == (6, 7, 8)


@pytest.mark.parametrize("name", FILES)
def test_a_fault_is_told_with_file_line_key_and_choice(file: Path, name: str) -> None:
    old, new, line, key, choice = FILES[name]
    assert TEXT.count(old) == 1
    file.write_text(TEXT.replace(old, new))
    (told,) = fault(file).splitlines()
    assert told.startswith(f"{file}:{line}: {key}:"), told
    assert choice in told
    assert len(told) > len(f"{file}:{line}: {key}: "), "the rule is told"


def test_the_value_is_told(file: Path) -> None:
    file.write_text(TEXT.replace("g: 1.0", "g: -17.25"))
    assert "-17.25" in fault(file)


def test_all_faults_are_told_at_once_in_the_order_of_lines(file: Path) -> None:
    wrong = [("kind: pendulum", "kind: pendulun"), ("20.0", "-20.0"), ("[central]", "[rk44]")]
    text = TEXT
    for old, new in wrong:
        text = text.replace(old, new)
    file.write_text(text)
    lines = [int(found) for found in re.findall(r"yaml:(\d+): ", fault(file))]
    assert lines == sorted(lines)
    assert {2, 4, 6} <= set(lines)


FAULTS: dict[str, tuple[Content, str]] = {
    "no model": ({"model": None}, "model"),
    "no time": ({"time": None}, "time"),
    "no schemes": ({"schemes": None}, "schemes"),
    "empty schemes": ({"schemes": []}, "schemes"),
    "no levels": ({"levels": None}, "levels"),
    "a level that is no whole number": ({"levels": [6, 7.5]}, "levels[1]"),
    "levels the wrong way round": ({"levels": {"from": 8, "to": 6}}, "levels.to"),
    "end of 0": ({"time": {"end": 0}}, "time.end"),
    "step that does not fit": ({"time": {"end": 1, "base_dt": 0.3}}, "time.base_dt"),
    "two ways of steps": ({"time": {"end": 1, "base_dt": 1, "base_steps": 1}}, "time.base_dt"),
    "one step at the coarsest level": ({"levels": [0, 1]}, "levels"),
    "reserved name": ({"schemes": [{"kind": "central", "label": "exact"}]}, "schemes[0].label"),
    "unknown option": ({"schemes": [{"kind": "central", "strt": "taylor"}]}, "schemes[0].strt"),
    "unknown word": ({"schemes": [{"kind": "central", "start": "late"}]}, "schemes[0].start"),
    "option out of bounds": ({"schemes": [{"kind": "hht", "alpha": -0.5}]}, "schemes[0].alpha"),
    "adaptive schemes alone": ({"schemes": ["dop853"]}, "schemes"),
    "swept levels": ({"sweep": {"levels": [1]}}, "sweep.levels"),
    "swept steps": ({"sweep": {"time.base_steps": [1]}}, "sweep.time.base_steps"),
    "swept kind": ({"sweep": {"model.kind": ["spring"]}}, "sweep.model.kind"),
    "empty axis": ({"sweep": {"model.g": []}}, "sweep.model.g"),
    "zip of unequal lengths": (
        {"sweep": {"zip": {"model.g": [1, 2], "model.L": [1, 2, 3]}}},
        "sweep.zip",
    ),
    "sample without a seed": (
        {"sweep": {"sample": {"method": "sobol", "n": 4, "over": {"model.g": [1, 2]}}}},
        "sweep.sample.seed",
    ),
    "unknown way to sample": (
        {
            "sweep": {
                "sample": {"method": "sobl", "n": 4, "seed": 1, "over": {"model.g": [1, 2]}},
            }
        },
        "sweep.sample.method",
    ),
    "too many members": ({"sweep": {"model.g": {"linspace": [1, 2, 10**8]}}}, "sweep"),
    "samples that do not divide": ({"samples": {"every": 7}}, "samples"),
    "unknown samples": ({"samples": "some"}, "samples"),
    "unknown output": ({"output": "worst"}, "output"),
    "tolerance beside levels": ({"tolerance": 1e-6}, "tolerance"),
    "unknown value": ({"checks": [{"value": "maximum", "below": 1}]}, "checks[0].value"),
    "two comparisons": (
        {"checks": [{"value": "max", "quantity": "theta", "below": 1, "above": 0}]},
        "checks[0]",
    ),
    "level that is not run": (
        {"checks": [{"value": "max", "quantity": "theta", "at": {"level": 3}, "below": 1}]},
        "checks[0].at.level",
    ),
    "unknown scheme of a check": (
        {"checks": [{"stable": True, "schemes": ["rk4"]}]},
        "checks[0].schemes[0]",
    ),
    "unknown drift": (
        {"checks": [{"conserves": "energy", "drift": "cubic"}]},
        "checks[0].drift",
    ),
    "unknown reason": (
        {
            "checks": [
                {"converges": "theta", "order": 2, "expect": {"status": "FAIL", "reason": "bad"}}
            ]
        },
        "checks[0].expect.reason",
    ),
    "claim without a check": ({"checks": [{"claim": "c"}]}, "checks[0].that"),
    "repeated id": (
        {"checks": [{"id": "a", "stable": True}, {"id": "a", "stable": True}]},
        "checks[1].id",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_told_with_its_key(name: str) -> None:
    change, key = FAULTS[name]
    content: dict[str, Any] = {**GOOD, **change}
    with pytest.raises(InputError) as caught:
        build({k: v for k, v in content.items() if v is not None})
    assert any(f"{key}:" in line or f"{key}." in line for line in str(caught.value).splitlines()), (
        caught.value
    )


@pytest.mark.parametrize(
    "formula", ["().__class__", "open('x')", "theta.real", "lambda: 1", "[1]", "9**9**9", "foo(u)"]
)
def test_a_formula_is_never_run_as_python(formula: str) -> None:
    with pytest.raises(InputError, match=r"model\.spring"):
        build({**GOOD, "model": {"kind": "oscillator", "spring": formula}, "initial": {"u": 1.0}})


def test_a_scheme_that_cannot_treat_the_forces_is_refused_with_those_that_can() -> None:
    model = {"kind": "oscillator", "damping": "v**3"}
    with pytest.raises(InputError, match="rk4"):
        build({**GOOD, "model": model, "initial": {"u": 1.0}, "schemes": ["yoshida4"]})


def test_every_error_is_one_family() -> None:
    assert issubclass(InputError, VibsimError)
    assert issubclass(VibsimError, Exception)


def test_the_command_refuses_with_2_and_without_a_traceback(file: Path, tmp_path: Path) -> None:
    """All faults of all files, those that do not exist and those that are no YAML as well."""
    good, broken = tmp_path / "good.yaml", tmp_path / "broken.yaml"
    good.write_text(TEXT)
    file.write_text(TEXT.replace("pendulum,", "pendulun,").replace("20.0", ".nan"))
    broken.write_text("title: [\n")
    ended = vibsim("check", file, good, tmp_path / "none.yaml", broken)
    assert ended.returncode == 2
    for place in (f"{file}:2: model.kind:", f"{file}:4: time.end:", "none.yaml", f"{broken}:"):
        assert place in ended.stderr
    assert "Traceback" not in ended.stdout + ended.stderr
    assert vibsim("check", good).returncode == 0


def test_a_run_of_a_bad_file_is_refused_and_writes_nothing(file: Path, tmp_path: Path) -> None:
    file.write_text(TEXT.replace("20.0", "-1"))
    ended = vibsim("run", file, "--results", tmp_path / "results")
    assert ended.returncode == 2
    assert f"{file}:4: time.end:" in ended.stderr
    assert "Traceback" not in ended.stdout + ended.stderr
    assert not list(tmp_path.glob("results/adhoc/*"))
