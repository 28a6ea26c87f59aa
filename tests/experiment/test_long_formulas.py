"""Long formulas: what follows from them is worked out with bounded work, or refused with a sentence."""

from __future__ import annotations

from typing import Any

import pytest
from experiment_files import calls_at_most
from thinned import thinned

from vibsim.core.errors import Fault, InputError
from vibsim.engine.kernel import source
from vibsim.experiment import Experiment
from vibsim.schemes import SCHEMES


def nested(function: str, count: int, name: str) -> str:
    return f"{function}(" * count + name + ")" * count


def product(text: str, count: int) -> str:
    return "*".join(text.format(k=k) for k in range(1, count + 1))


def total(text: str, count: int) -> str:
    return "+".join(text.format(k=k) for k in range(1, count + 1))


def faults_of(model: dict[str, Any], **more: Any) -> tuple[Fault, ...]:
    content: dict[str, Any] = {
        "title": "A long formula",
        "model": model,
        "time": {"end": 1.0, "base_steps": 4},
        "levels": [4, 5, 6],
        "schemes": ["central"],
    }
    # the longest one needs half of it
    with calls_at_most(50_000_000):
        try:
            Experiment.from_dict(content | more)
        except InputError as error:
            return error.faults
    return ()


NO_ENERGY = "its potential energy cannot be computed"
SLOW = {"marks": pytest.mark.slow}


@pytest.mark.parametrize(
    ("kind", "key", "text", "rule"),
    thinned(
        [
            ("oscillator", "spring", total("sin({k}*u)", 94), ""),
            pytest.param(
                "oscillator",
                "spring",
                "u + 1e-9*" + product("sin(0.01*{k}*u)", 94),
                "",
                **SLOW,
            ),
            ("oscillator", "spring", nested("sin", 94, "u"), NO_ENERGY),
            pytest.param("oscillator", "spring", total("tanh({k}*u)", 90), "", **SLOW),
            ("oscillator", "spring", "**".join(["u"] * 90), NO_ENERGY),
            pytest.param("oscillator", "spring", "/".join(["(1 + u**2)"] * 90), NO_ENERGY, **SLOW),
            pytest.param(
                "oscillator", "damping", "v*" + product("cosh(0.01*{k}*v)", 90), "", **SLOW
            ),
            ("oscillator", "exact", product("sin({k}*t)", 60), ""),
            ("vehicle", "road", nested("sin", 90, "x"), ""),
            pytest.param(
                "vehicle", "road", product("abs(sin({k}*x))", 89), "its slope jumps", **SLOW
            ),
            ("circuit", "voltage", product("abs(sin({k}*t))", 89), ""),
        ],
        3,
    ),
)
def test_a_long_formula_takes_bounded_work(kind: str, key: str, text: str, rule: str) -> None:
    sweep = {"initial.v" if kind == "oscillator" else "time.end": {"linspace": [1.0, 2.0, 500]}}
    sweep = {} if kind == "circuit" or key == "exact" else sweep
    scheme = "rk4" if key == "damping" else "central"
    found = faults_of(
        {"kind": kind, key: text}, schemes=[scheme], **({"sweep": sweep} if sweep else {})
    )
    assert [fault.key for fault in found] == ([f"model.{key}"] if rule else [])
    assert all(rule in fault.rule for fault in found)


@pytest.mark.slow
def test_many_calls_are_not_written_out_one_by_one() -> None:
    """Each call that becomes part of a kernel is a page of machine code: 282 of them took 38 s to compile."""
    few, many = (
        Experiment.from_dict(
            {
                "title": "A spring",
                "model": {"kind": "oscillator", "spring": total("sin({k}*u)", count)},
                "time": {"end": 1.0},
                "levels": [4, 5, 6],
                "schemes": ["central"],
            }
        ).model.definition
        for count in (4, 94)
    )
    scheme = SCHEMES["rk4"]
    stepper = scheme.stepper({row.name: row.default for row in scheme.options})
    assert "@compiled\ndef sin(" in source(few, stepper)
    assert "@called\ndef sin(" in source(many, stepper)
