"""Derivatives of formulas against numeric differentiation at 60 digits, with functions of its own."""

from __future__ import annotations

import math
from bisect import bisect
from itertools import accumulate

import mpmath
import pytest
from thinned import thinned

from vibsim.elementary import ELEMENTARY
from vibsim.engine.text import divided, with_quotients
from vibsim.formula import (
    ExpressionError,
    Number,
    derivative,
    evaluate,
    parse,
    to_formula,
    to_statements,
)
from vibsim.models import MODELS
from vibsim.models import tree as tree_of

FUNCTIONS = {name: function.full for name, function in ELEMENTARY.items()}
EXACT = {
    "abs": lambda x: x if x >= 0 else -x,
    "acos": mpmath.acos,
    "acosh": mpmath.acosh,
    "asin": mpmath.asin,
    "asinh": mpmath.asinh,
    "atan": mpmath.atan,
    "atan2": mpmath.atan2,
    "atanh": mpmath.atanh,
    "cbrt": lambda x: mpmath.sign(x) * mpmath.cbrt(abs(x)),
    "ceil": mpmath.ceil,
    "cos": mpmath.cos,
    "cosh": mpmath.cosh,
    "erf": mpmath.erf,
    "erfc": mpmath.erfc,
    "exp": mpmath.exp,
    "expm1": mpmath.expm1,
    "floor": mpmath.floor,
    "heaviside": lambda x: (1 + mpmath.sign(x)) / 2,
    "hypot": mpmath.hypot,
    "log": mpmath.log,
    "log10": mpmath.log10,
    "log1p": mpmath.log1p,
    "log2": lambda x: mpmath.log(x, 2),
    "max": max,
    "min": min,
    "mod": lambda x, y: x - mpmath.floor(x / y) * y,
    "power": mpmath.power,
    "round": mpmath.nint,
    "sign": mpmath.sign,
    "sin": mpmath.sin,
    "sinh": mpmath.sinh,
    "sqrt": mpmath.sqrt,
    "tan": mpmath.tan,
    "tanh": mpmath.tanh,
    "where": lambda condition, yes, no: yes if condition else no,
}
FORMULAS = {
    "abs": ("abs({})", (-2.0, 3.0)),
    "acos": ("acos({})", (-0.9999, -0.3, 0.7, 0.99999)),
    "acosh": ("acosh(1.1 + {}**2)", (-2.0, 0.1, 30.0)),
    "asin": ("asin({})", (-0.9999, -0.3, 0.7, 0.99999)),
    "asinh": ("asinh({})", (-50.0, -0.3, 0.7)),
    "atan": ("atan({})", (-50.0, -0.3, 0.7)),
    "atan2": ("atan2({0}, 0.3 - {0}**2)", (-2.0, 0.1, 3.0)),
    "atanh": ("atanh({})", (-0.9999, -0.3, 0.7, 0.99)),
    "cbrt": ("cbrt({})", (-50.0, -0.3, 0.7)),
    "ceil": ("ceil({0})*{0}", (-1.2, 0.4, 3.3)),
    "cos": ("cos({})", (-2.0, 0.1, 30.0)),
    "cosh": ("cosh({})", (-2.0, 0.1, 3.0)),
    "erf": ("erf({})", (-2.0, 0.1, 3.0)),
    "erfc": ("erfc({})", (-2.0, 0.1, 3.0)),
    "exp": ("exp({})", (-2.0, 0.1, 3.0)),
    "expm1": ("expm1({})", (-2.0, 0.1, 3.0)),
    "floor": ("floor({0})*{0}", (-1.2, 0.4, 3.3)),
    "heaviside": ("heaviside({0})*{0}**2", (-2.0, 3.0)),
    "hypot": ("hypot({0}, 0.3 - {0}**2)", (-2.0, 0.1, 3.0)),
    "log": ("log({})", (0.01, 2.0)),
    "log10": ("log10({})", (0.01, 2.0)),
    "log1p": ("log1p({})", (-0.9, 0.01, 2.0)),
    "log2": ("log2({})", (0.01, 2.0)),
    "max": ("max({0}**2, 2*{0})", (-1.0, 0.5, 3.0)),
    "min": ("min({0}**2, 2*{0})", (-1.0, 0.5, 3.0)),
    "mod": ("mod({0}, 0.7)*mod(3, 0.2 + {0}**2)", (-2.0, 0.1, 3.0)),
    "power": ("({0})**1.7 + 0.3*2.5**({0}) + ({0})**({0})", (0.2, 1.0, 3.0)),
    "round": ("round({0})*{0}", (-1.2, 0.4, 3.3)),
    "sign": ("sign({0})*{0}", (-2.0, 3.0)),
    "sin": ("sin({})", (-2.0, 0.1, 30.0)),
    "sinh": ("sinh({})", (-2.0, 0.1, 3.0)),
    "sqrt": ("sqrt({})", (0.01, 2.0)),
    "tan": ("tan({})", (-2.0, 0.1, 3.0)),
    "tanh": ("tanh({})", (-20.0, -2.0, 0.1, 3.0)),
    "where": ("where({0} < 1, sin({0}), {0}**3)", (-2.0, 0.9, 1.1)),
}
"""A formula for every function of the registry, with places where it is smooth."""
OTHERS = {
    "x": (0.0, 2.0),
    "3": (0.0, 2.0),
    "-x": (0.0, 2.0),
    "x - 2*x*x": (0.0, 2.0),
    "1/x - x/3 + x/(1 + x**2)": (-2.0, 0.7),
    "1e-200/(1e-200*x)": (0.7,),
    "x**0 + x**1 + x**2 + x**7": (-2.0, 0.0, 0.7),
    "x**-1 + x**-2 + 2*x**(-3)": (-2.0, 0.7),
    "x**0.5 + x**-0.5 + x**(1/3)": (0.01, 2.0),
    "abs(x)**1.5": (-2.0, 0.7),
    "2**x + (1 + x**2)**(x - 1)": (-2.0, 0.7),
    "x*sin(3*x)*exp(-x)/(2 + cos(x))": (-2.0, 0.0, 0.7),
    "where(x > 0, sqrt(x), x)": (-2.0, 0.7),
    "where(x, x, 1)*(x < 3)": (-2.0, 0.7),
    "x**3 if x > 0 and not x > 1 else sin(x)": (-2.0, 0.7, 1.5),
    "(0 < x < 1 or x < -1)*x**2": (-2.0, 0.7, 1.5),
}
CASES = {
    **{text.format("x"): places for text, places in FORMULAS.values()},
    **{text.format("(0.9*x/(1.3 + 0.01*x))"): places for text, places in FORMULAS.values()},
    **OTHERS,
}


def value(formula: str, x: float) -> float:
    """Evaluate the derivative as the engine does."""
    scope = {**FUNCTIONS, "x": x, "divided": divided}
    text = "\n".join(to_statements({"_r": derivative(parse(formula, ["x"]), "x")}))
    exec(compile(with_quotients(text), "<derivative>", "exec"), scope)
    return float(scope["_r"])


def exact(formula: str, x: float) -> mpmath.mpf:
    """Differentiate the formula, which is Python too, numerically at 60 digits."""
    with mpmath.workdps(60):
        return mpmath.diff(lambda at: eval(formula, {**EXACT, "x": at}), mpmath.mpf(x))


def test_every_function_of_the_registry_is_here():
    assert set(FORMULAS) == set(EXACT) == set(ELEMENTARY)


@pytest.mark.parametrize("formula", CASES)
def test_derivative_is_that_of_numeric_differentiation(formula):
    for x in CASES[formula]:
        wanted = exact(formula, x)
        # some forty operations, each off by 1 unit in the last place of terms that are little above the sum
        assert abs(value(formula, x) - wanted) <= 40 * 2.0**-52 * max(1.0, abs(wanted)), x


@pytest.mark.parametrize(
    "model",
    [model for model in MODELS.values() if model.loaded is None],
    ids=lambda model: model.kind,
)
def test_slopes_of_every_model(model):
    names = [*(state.name for state in model.states), "t", *(p.name for p in model.parameters)]
    values = {name: 0.7 + 0.1 * i for i, name in enumerate(names)}
    text = to_formula(tree_of(model, model.acceleration))
    tree = parse(text, names)
    for name in (model.position, model.velocity, "t"):
        with mpmath.workdps(60):
            exact_values = {key: mpmath.mpf(number) for key, number in values.items()}
            wanted = mpmath.diff(
                lambda at, n=name, v=exact_values: eval(text, {**EXACT, **v, n: at}),
                exact_values[name],
            )
        found = evaluate(derivative(tree, name), values)
        assert abs(found - wanted) <= 40 * 2.0**-52 * max(1.0, abs(wanted))


@pytest.mark.parametrize(
    ("formula", "x", "wanted"),
    [
        ("abs(x)", 0.0, 0.0),
        ("abs(x)**1.5", 0.0, 0.0),
        ("x*abs(x)", 0.0, 0.0),
        ("sign(x)", 2.0, 0.0),
        ("heaviside(x)", 0.0, 0.0),
        ("heaviside(x)*x", 0.0, 0.5),
        ("floor(x) + ceil(x) + round(x)", 1.0, 0.0),
        ("mod(x, 2)", 2.0, 1.0),
        # a quotient that rounds to 3
        ("mod(0.3, x)", 0.3 / 3 * (1 + 2.0**-52), -2.0),
        ("asinh(1e200*x)", 1.0, 1.0),
        ("erfc(x)", 30.0, 0.0),
        ("x > 1", 2.0, 0.0),
        ("where(x > 1, 2, 3)", 1.0, 0.0),
        ("max(x, -x)", 0.0, 1.0),
        ("min(x, -x)", 0.0, 1.0),
        ("where(x > 0, sqrt(x), 2*x)", 0.0, 2.0),
        ("x/1e200/1e200", 1.0, 0.0),
        ("tanh(x)", 800.0, 0.0),
    ],
)
def test_corners_have_the_slope_of_the_branch_taken(formula, x, wanted):
    assert value(formula, x) == wanted


def test_a_derivative_by_another_name_is_zero():
    assert derivative(parse("sin(x)*x**2", ["x", "y"]), "y") == Number(0.0)


def test_tanh_and_acos_keep_their_digits_at_the_edge():
    assert value("tanh(x)", 20.0) == pytest.approx(4 * math.exp(-40), rel=1e-14)
    assert value("acos(x)", 1 - 2.0**-50) == pytest.approx(-(2.0**24.5), rel=1e-14)


@pytest.mark.parametrize(
    "nest",
    thinned(
        [
            "(x/{})",
            "({}*x)",
            "atan2({}, x)",
            "tan({})",
            "({})**x",
            "hypot({}, x)",
            "erf({})",
            "mod({}, 2 + x)",
            "x if x > 2 else {}",
        ],
        8,
    ),
)
def test_the_derivative_of_the_deepest_formula_is_still_python(nest):
    deep = list(accumulate(range(700), lambda formula, _: nest.format(formula), initial="x"))

    def is_too_deep(formula):
        if len(formula) > 2000:
            return True
        try:
            parse(formula, ["x"])
        except ExpressionError:
            return True
        return False

    deepest = deep[bisect(deep, False, key=is_too_deep) - 1]
    assert deepest != "x"
    assert math.isfinite(value(deepest, 1.0))
