"""Dimensions of parameters, from formulas that are forces."""

from __future__ import annotations

from fractions import Fraction

import pytest

from vibsim.formula import Name, parse, to_formula
from vibsim.models.shared.linear_scales import DimensionError, over_scales, powers

KNOWN = {"u": (0, 1, 0), "v": (0, 1, -1), "t": (0, 0, 1)}
NAMES = ("k", "b", "A", "B", "w", "n", "t0", "a")


def found(*texts):
    trees = tuple(parse(text, (*KNOWN, *NAMES)) for text in texts)
    names = tuple(name for name in NAMES if any(name in tree.names for tree in trees))
    return powers(trees, KNOWN, names)


@pytest.mark.parametrize(
    ("texts", "wanted"),
    [
        (["k*u"], {"k": (1, 0, -2)}),
        (["b*v"], {"b": (1, 0, -1)}),
        (["b*abs(v)*v"], {"b": (1, -1, 0)}),
        (["b*sign(v)"], {"b": (1, 1, -2)}),
        (["-b*v**3"], {"b": (1, -2, 1)}),
        (["k*u/(1 + (u/a)**2)"], {"k": (1, 0, -2), "a": (0, 1, 0)}),
        (["k*a*tanh(u/a)"], {"k": (1, 0, -2), "a": (0, 1, 0)}),
        (["A*sin(w*t)"], {"A": (1, 1, -2), "w": (0, 0, -1)}),
        (["A*exp(-t/t0) + B*t"], {"A": (1, 1, -2), "B": (1, 1, -3), "t0": (0, 0, 1)}),
        (["where(t < t0, A, 0)"], {"A": (1, 1, -2), "t0": (0, 0, 1)}),
        (["where(t < t0, 0, A*t)"], {"A": (1, 1, -3), "t0": (0, 0, 1)}),
        (["A*heaviside(t - t0)"], {"A": (1, 1, -2), "t0": (0, 0, 1)}),
        (["max(k*u, A)"], {"k": (1, 0, -2), "A": (1, 1, -2)}),
        (["A*(u/a)**n"], {"A": (1, 1, -2), "a": (0, 1, 0), "n": (0, 0, 0)}),
        (["k*sqrt(u)"], {"k": (1, Fraction(1, 2), -2)}),
        (["k*u", "k*a*cos(t/t0)"], {"k": (1, 0, -2), "a": (0, 1, 0), "t0": (0, 0, 1)}),
        # a choice is left: the first takes all
        (["A*B*u"], {"A": (1, 0, -2), "B": (0, 0, 0)}),
        (["A*u", "B*A*u"], {"A": (1, 0, -2), "B": (0, 0, 0)}),
    ],
)
def test_dimensions(texts, wanted):
    assert found(*texts) == wanted


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("u", "u"),
        ("k*u + 0.5", "k*u + 0.5"),
        ("k*u + 0.1*k*u**3", "k*u + 0.1*k*u**3"),
        ("k*sin(u)", "sin(u)"),
        ("A*heaviside(t - 3)", "t - 3"),
        ("A*t**n", "t**n"),
        ("where(t < 1, A, 0)", "t < 1"),
        ("A*sin(w*t)*sin(w)", "sin(w)"),
    ],
)
def test_numbers_with_a_dimension_are_named(text, part):
    with pytest.raises(DimensionError) as caught:
        found(text)
    assert str(caught.value) == part


@pytest.mark.parametrize(
    ("power", "text"),
    [
        ((0, 0, 0), "p"),
        ((1, 0, -2), "p/m*T**2"),
        ((0, 1, 0), "p/X"),
        ((0, Fraction(1, 2), 0), "p/X**(1/2)"),
    ],
)
def test_over_scales(power, text):
    scales = Name("m"), Name("X"), Name("T")
    assert to_formula(over_scales("p", tuple(map(Fraction, power)), scales)) == text
