"""Bounds of formulas hold every value, for every function, and are those values where nothing varies."""

from __future__ import annotations

import numpy as np
import pytest

from vibsim.formula import FUNCTIONS, bounds, parse, values

TWO = {"atan2", "hypot", "max", "min", "mod"}
MORE = [
    "x + y", "x - y*x", "x/y", "x/(y + 10)", "x**2", "x**3", "x**-2", "x**0.5", "abs(x)**y", "2**x",
    "x < y", "x >= y", "x == y", "x != y", "1 if x > 0 and y > 0 else x", "-x", "mod(x, 0.7)",
    "exp(-((x - 1)/0.1)**2)", "sin(3*x + y)*cos(x)",
]  # fmt: skip


def formulas() -> list[str]:
    calls = [f"{name}(x, y)" if name in TWO else f"{name}(x)" for name in sorted(FUNCTIONS)]
    return [call for call in calls if not call.startswith("where")] + MORE


@pytest.mark.parametrize("text", formulas())
def test_bounds_hold_every_value(text: str) -> None:
    random = np.random.default_rng(5)
    formula = parse(text, ("x", "y"))
    centre = random.uniform(-4.0, 4.0, (2, 400))
    half = 10.0 ** random.uniform(-6.0, 1.0, (2, 400))
    ends = [(c - h, c + h) for c, h in zip(centre, half, strict=True)]
    # some end at 0 or begin there
    for first, (a, b) in zip((0, 40), ends, strict=True):
        last = slice(first, first + 80)
        a[last], b[last] = -np.abs(a[last]), 0.0
        a[last.stop : last.stop + 80], b[last.stop : last.stop + 80] = 0.0, 1.0 + half[0, :80]
    low, high = bounds(formula, dict(zip("xy", ends, strict=True)))
    part = random.uniform(0.0, 1.0, (64, 2, 400))
    x, y = (a + part[:, i] * (b - a) for i, (a, b) in enumerate(ends))
    found = values(formula, {"x": x, "y": y})
    room = 1e-12 * (1.0 + np.abs(found))
    known = np.isfinite(found)
    assert np.all(~known | ((found >= low - room) & (found <= high + room)))


@pytest.mark.parametrize("text", formulas())
def test_bounds_of_a_point_are_its_value(text: str) -> None:
    random = np.random.default_rng(6)
    formula = parse(text, ("x", "y"))
    x, y = random.uniform(0.05, 0.95, (2, 50))
    low, high = bounds(formula, {"x": (x, x), "y": y})
    value = np.broadcast_to(values(formula, {"x": x, "y": y}), x.shape)
    known = np.isfinite(value)
    np.testing.assert_allclose(np.broadcast_to(low, x.shape)[known], value[known], rtol=1e-12)
    np.testing.assert_allclose(np.broadcast_to(high, x.shape)[known], value[known], rtol=1e-12)
