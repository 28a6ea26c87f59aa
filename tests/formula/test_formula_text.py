"""Formulas as a user reads them, their integrals, and their values for arrays."""

from __future__ import annotations

import itertools
import math
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from thinned import thinned

from vibsim.formula import (
    FUNCTIONS,
    Binary,
    Call,
    Compare,
    Expression,
    ExpressionError,
    Name,
    Negate,
    Number,
    evaluate,
    has_rule,
    integral,
    parse,
    to_formula,
    values,
)

NAMES = ("u", "k", "e", "pi", "t_0")
_LEAVES = st.one_of(
    st.floats(0.0, 1000.0).map(lambda x: Number(abs(x))),
    st.floats(1e-300, 1e300).map(Number),
    st.integers(0, 1000).map(lambda n: Number(float(n))),
    st.sampled_from(NAMES).map(Name),
)


def _nodes(inner: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
    # a power is refused where its exponent is a number above 1024
    exponent = inner.filter(lambda node: not isinstance(node, Number | Negate)) | st.floats(
        0.0, 1024.0
    ).map(lambda x: Number(abs(x)))
    return st.one_of(
        inner.map(Negate),
        st.builds(Binary, st.sampled_from("+-*/"), inner, inner),
        st.builds(Binary, st.just("**"), inner, exponent),
        st.builds(Binary, st.just("**"), inner, inner.map(lambda x: Negate(Call("sin", (x,))))),
        st.builds(Compare, st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), inner, inner),
        st.sampled_from(sorted(FUNCTIONS)).flatmap(
            lambda f: st.tuples(*[inner] * FUNCTIONS[f][0]).map(lambda found: Call(f, found))
        ),
    )


TREES = st.recursive(_LEAVES, _nodes, max_leaves=25)


@pytest.mark.slow
# a strategy that contains itself has a long name, which a few of its draws write out
@pytest.mark.filterwarnings("ignore:Generating overly large repr")
@given(TREES)
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_text_of_a_formula_reads_back_as_the_same_tree(tree: Expression) -> None:
    assert parse(to_formula(tree), NAMES) == tree


def test_every_pair_of_operations_reads_back() -> None:
    """Where parentheses are needed is a matter of two operations, one inside the other."""
    u, k = Name("u"), Name("k")
    parts: list[Any] = [lambda a, b, s=s: Binary(s, a, b) for s in ("+", "-", "*", "/", "**")]
    parts += [lambda a, b: Negate(a), lambda a, b: Compare("<", a, b)]
    parts += [lambda a, b: Call("min", (a, b))]
    for outer, inner, sign in itertools.product(parts, parts, (False, True)):
        part = Negate(inner(k, u)) if sign else inner(k, u)
        for tree in (outer(part, u), outer(u, part)):
            assert parse(to_formula(tree), NAMES) == tree, to_formula(tree)


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("((k)*(u))+(u**3.0)", "k*u + u**3"),
        ("-(u**2)", "-u**2"),
        ("(-u)**2", "(-u)**2"),
        ("u**(-2)", "u**-2"),
        ("(u**2)**3", "(u**2)**3"),
        ("u**(2**3)", "u**2**3"),
        ("u-(k-u)", "u - (k - u)"),
        ("(u-k)-u", "u - k - u"),
        ("u/(k*u)", "u/(k*u)"),
        ("u/k*u", "u/k*u"),
        ("-(k*u)", "-(k*u)"),
        ("-k*u", "-k*u"),
        ("0.10*u", "0.1*u"),
        ("1e-9*u", "1e-09*u"),
        ("1e20*u", "1e+20*u"),
        ("where(u<=1,u,(2*u)-1)", "where(u <= 1, u, 2*u - 1)"),
        ("(u<1)*u", "(u < 1)*u"),
    ],
)
def test_text_has_no_more_parentheses_than_needed(text: str, written: str) -> None:
    tree = parse(text, NAMES)
    assert to_formula(tree) == written
    assert parse(written, NAMES) == tree


NUMBERS = {"k": 1.7, "c": -0.4}
BY_RULE = [
    "3",
    "k",
    "u",
    "-u",
    "k*u + u**3",
    "u**2 - c*u**5/k",
    "u*k",
    "(k + c)*u",
    "2*(u - u**3/6)",
    "-(k*u)",
    "sin(u)",
    "k*sin(3*u)",
    "sin(u*k/2)",
    "cos(u)",
    "cos(-u)",
    "exp(u)",
    "exp(-k*u)",
    "sinh(u)",
    "sinh(c*u)",
    "cosh(2*u)",
    "tanh(u)",
    "tanh(k*u)/k",
    "tanh(-u)",
    "abs(u)",
    "abs(c*u)",
    "sign(u)",
    "k*sign(-u)",
    "u + k*sign(u) + tanh(u)/2",
]
BY_QUADRATURE = [
    "u*u",
    "k*abs(u)*u",
    "u*(1 + k*u**2)",
    "u**2*(u + 1)**3",
    "u/(20 + u**2)",
    "u*exp(-u/5)",
    "sin(u)*cos(u/2)",
    "tanh(u/9)**3",
    "sin(u + 0.3)",
    "sqrt(30 + u**2)*u",
    "u*cosh(u/4)",
]
_MP: dict[str, Any] = {
    **{name: getattr(mpmath, name) for name in ("sin", "cos", "exp", "sinh", "cosh", "tanh")},
    **{"abs": abs, "sign": mpmath.sign, "sqrt": mpmath.sqrt},
    **{name: mpmath.mpf(value) for name, value in NUMBERS.items()},
}


INTEGRALS_TO = [1e-6, -1e-6, 0.01, -0.2, 0.31, -1.0, 1.7, -3.2, 4.6]


def true_integrals(text: str, places: list[float]) -> dict[float, float]:
    """Return the integrals from 0 by another rule, with 50 digits: this test trusts its own texts only."""
    code = compile(text, "formula", "eval")

    def force(x: Any) -> Any:
        return eval(code, {**_MP, "u": x})

    found = {}
    with mpmath.workdps(50):
        for side in (1.0, -1.0):
            ahead = sorted((u for u in places if side * u > 0.0), key=abs)
            total = mpmath.mpf(0)
            for before, u in itertools.pairwise([0.0, *ahead]):
                total += mpmath.quad(force, mpmath.linspace(before, u, 3))
                found[u] = float(total)
    return found


@pytest.mark.parametrize("text", thinned([*BY_RULE, *BY_QUADRATURE], 3))
def test_integral_has_all_its_digits(text: str) -> None:
    known = ("u", *NUMBERS)
    tree = parse(text, known)
    assert has_rule(tree, "u") == (text in BY_RULE)
    rule = integral(tree, "u")
    assert values(rule, {**NUMBERS, "u": 0.0}) == 0.0
    for u, true in true_integrals(text, INTEGRALS_TO).items():
        found = float(values(rule, {**NUMBERS, "u": u}))
        # terms of different sign may cancel where the force itself is 0 somewhere between
        sizes = (abs(float(values(tree, {**NUMBERS, "u": x}))) for x in (u, u / 2, u / 4))
        size = abs(u) * max(sizes)
        least = 1e-13 * abs(true) if abs(u) < 1e-3 else 1e-13 * max(abs(true), size)
        assert found == pytest.approx(true, rel=0.0, abs=least), u


@pytest.mark.parametrize("u", [1e-160, 1e-9, 1e-3, 0.2999, 0.3, 0.3001, 5.0, 700.0, 1e5, 1e300])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_integral_of_tanh_at_any_argument(u: float, sign: float) -> None:
    with mpmath.workdps(400):
        x = mpmath.mpf(u)
        true = float(x + mpmath.log1p(mpmath.exp(-2 * x)) - mpmath.log(2))
    found = float(values(integral(parse("tanh(u)", ["u"]), "u"), {"u": sign * u}))
    # half of u**2 has few bits left below the least normal number
    assert found == pytest.approx(true, rel=1e-14, abs=5e-324 if u < 1e-100 else 0.0)


@pytest.mark.parametrize(
    ("text", "u", "true"),
    [
        ("exp(u)", 700.0, math.expm1(700.0)),
        ("exp(u)", -800.0, -1.0),
        ("sinh(u)", 1e-9, 0.5e-18),
        ("sin(u)", -1e-9, 0.5e-18),
        ("exp(u) - 1", 30.0, math.expm1(30.0) - 30.0),
    ],
)
def test_integral_at_tiny_and_huge_arguments(text: str, u: float, true: float) -> None:
    found = float(values(integral(parse(text, ["u"]), "u"), {"u": u}))
    assert found == pytest.approx(true, rel=1e-13)


PLACES = [-1e300, -712.0, -3.5, -1.0, -0.5, -0.0, 0.0, 1e-9, 0.3, 1.0, 2.0, 40.0, 712.0, 1e300]


def agrees(text: str, numbers: dict[str, float]) -> None:
    """Both have the same value to a few roundings, or neither has a finite one."""
    tree = parse(text, numbers)
    found = float(values(tree, numbers))
    try:
        expected = evaluate(tree, numbers)
    except ExpressionError:
        assert not math.isfinite(found), (text, numbers, found)
        return
    assert found == pytest.approx(expected, rel=1e-13), (text, numbers)


@pytest.mark.parametrize("function", sorted(set(FUNCTIONS) - {"where"}))
def test_arrays_have_the_values_of_numbers(function: str) -> None:
    count = FUNCTIONS[function][0]
    text = f"{function}({', '.join('uk'[:count])})"
    for numbers in itertools.product(PLACES, repeat=count):
        if function in ("sin", "cos", "tan") and abs(numbers[0]) > 1e9:
            continue  # far beyond what an angle is
        agrees(text, dict(zip("uk", numbers, strict=False)))


@pytest.mark.parametrize(
    "text",
    [f"u {s} k" for s in ("+", "-", "*", "/", "<", "<=", ">", ">=", "==", "!=")]
    + ["-u", "u**2", "u**-3", "u**0", "u**0.5", "where(u < k, u, k)", "where(u - k, 1, 2)"],
)
def test_arrays_have_the_values_of_operations(text: str) -> None:
    for u, k in itertools.product(PLACES, PLACES):
        agrees(text, {"u": u, "k": k})


@pytest.mark.parametrize("text", ["1/0", "1/(1 - 1)", "log(0)", "sqrt(-1)", "exp(1e9)", "asin(2)"])
def test_what_has_no_value_is_no_error(text: str) -> None:
    assert not np.isfinite(values(parse(text, ()), {}))


def test_arrays_are_broadcast() -> None:
    u, k = np.linspace(-1, 1, 5), np.array([[1.0], [2.0]])
    tree = parse("where(u < 0, k*u, u**2/k)", ["u", "k"])
    found = values(tree, {"u": u, "k": k})
    assert found.shape == (2, 5)
    assert found.dtype == np.float64
    for i, j in itertools.product(range(2), range(5)):
        assert found[i, j] == evaluate(tree, {"u": u[j], "k": k[i, 0]})
    assert values(parse("2", ()), {}).shape == ()
    assert values(parse("u + 1", ["u"]), {"u": np.array([1, 2])}).tolist() == [2.0, 3.0]
