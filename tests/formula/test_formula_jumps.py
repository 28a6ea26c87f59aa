"""Jumps of formulas are found where they are; corners, singular slopes and steep ramps are none."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vibsim.formula import first_jump, parse, values
from vibsim.formula.jumps import held

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


@pytest.mark.parametrize(
    "text",
    [
        *(f"{name}(x)" for name in ("abs", "ceil", "floor", "heaviside", "round", "sign")),
        *(
            "mod(x, 0.7)",
            "max(x, y)",
            "min(y, x)",
            "x < y",
            "0 <= x",
            "2*x > y",
            "y >= -x",
            "x != y",
        ),
        "abs(x - round(y)) + (x if ceil(x + y) > 1 else y)",
    ],
)
def test_modes_in_place_of_corners_and_jumps_give_the_same_values(text: str) -> None:
    """The mode of a quantity is its floor where all integers count, otherwise -1 below 0 and 0 above."""
    formula = parse(text, ("x", "y"))
    (smooth,), switches = held((formula,), ("x", "y"))
    numbers = dict(zip("xy", np.random.default_rng(3).uniform(-3.0, 3.0, (2, 50)), strict=True))
    expected = np.broadcast_to(values(formula, numbers), 50)
    for switch in switches:
        quantity = values(switch.quantity, numbers)
        numbers[switch.mode] = np.floor(quantity if switch.whole else np.sign(quantity) / 2.0)
    np.testing.assert_allclose(np.broadcast_to(values(smooth, numbers), 50), expected, rtol=1e-12)
