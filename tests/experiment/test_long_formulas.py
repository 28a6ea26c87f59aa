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


SLOW = {"marks": pytest.mark.slow}


@pytest.mark.parametrize(
    ("kind", "key", "text", "is_sound"),
    thinned(
        [
            ("oscillator", "spring", total("sin({k}*u)", 94), True),
            pytest.param(
                "oscillator", "spring", "u + 1e-9*" + product("sin(0.01*{k}*u)", 94), False, **SLOW
            ),
            ("oscillator", "spring", nested("sin", 94, "u"), False),
            pytest.param("oscillator", "spring", total("tanh({k}*u)", 90), False, **SLOW),
            ("oscillator", "spring", "**".join(["u"] * 90), False),
            pytest.param("oscillator", "spring", "/".join(["(1 + u**2)"] * 90), False, **SLOW),
            pytest.param(
                "oscillator", "damping", "v*" + product("cosh(0.01*{k}*v)", 90), False, **SLOW
            ),
            ("oscillator", "exact", product("sin({k}*t)", 60), False),
            ("vehicle", "road", nested("sin", 90, "x"), False),
            pytest.param("vehicle", "road", product("abs(sin({k}*x))", 89), False, **SLOW),
            ("circuit", "voltage", product("abs(sin({k}*t))", 89), False),
        ],
        3,
    ),
)
def test_a_long_formula_takes_bounded_work(kind: str, key: str, text: str, is_sound: bool) -> None:
    sweep = {"initial.v" if kind == "oscillator" else "time.end": {"linspace": [1.0, 2.0, 500]}}
    sweep = {} if kind == "circuit" or key == "exact" else sweep
    scheme = "rk4" if key == "damping" else "central"
    found = faults_of(
        {"kind": kind, key: text}, schemes=[scheme], **({"sweep": sweep} if sweep else {})
    )
    assert [fault.key for fault in found] == ([] if is_sound else [f"model.{key}"])
    for fault in found:
        assert "operations" in fault.rule or "too long" in fault.rule


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
