"""Jumps of formulas are found where they are; corners, singular slopes and steep ramps are none."""

from __future__ import annotations

import math

import pytest

from vibsim.formula import first_jump, parse

END = 4.0


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("c*heaviside(t - 0.7)", 0.7),
        ("heaviside(t)", 0.0),
        ("c if t > 1/3 else 0", 1 / 3),
        ("sign(sin(2*pi*t/1.5 + 1))", (math.pi - 1) * 1.5 / (2 * math.pi)),
        ("mod(t, 1.1)", 1.1),
        ("sin(t) + 1e-3*floor(t + 0.5)", 0.5),
        ("atan2(sin(t), cos(t))", math.pi),
        ("round(t)", 0.5),
        ("(t < 1)*t**2", 1.0),
    ],
)
def test_a_jump_is_found_where_it_is(text: str, place: float) -> None:
    found = first_jump(parse(text, ("t", "c")), {"c": 12.0}, END)
    assert found == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        "sin(300*t)*exp(-t)",
        "abs(sin(40*t))",
        "abs(mod(t, 0.5) - 0.25)",
        "max(t - 1, 0)**1.5",
        "sqrt(abs(t - 1))",
        "cbrt(t - 1)",
        "t**0.5",
        "where(t < 1, t**2, 2*t - 1)",
        "c*(1 + tanh((t - 1)/1e-6))/2",
        "(t - 1)*heaviside(t - 1)",
        "sqrt(1.5 - t)",
        "log(t)*t",
        "0*heaviside(t - 1)",
    ],
)
def test_what_is_continuous_has_none(text: str) -> None:
    assert first_jump(parse(text, ("t", "c")), {"c": 12.0}, END) is None
