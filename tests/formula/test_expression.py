"""Formulas: what they mean, what is refused, and that nothing is ever evaluated as Python."""

from __future__ import annotations

import copy
import math
import pickle
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vibsim.elementary import ELEMENTARY
from vibsim.formula import (
    MAX_DEPTH,
    Binary,
    Expression,
    ExpressionError,
    Name,
    Negate,
    Number,
    constant,
    derivative,
    evaluate,
    parse,
    put,
    to_formula,
    to_statements,
    values,
    walk,
)
from vibsim.models import MODELS, Model

FUNCTIONS = {name: function.full for name, function in ELEMENTARY.items()}


def source_of(tree: Expression) -> str:
    """Return the text for the engine in one line, with every factor of a power as often as it stands there."""
    *factors, last = (line.partition(" = ")[2] for line in to_statements({"_result": tree}))
    for i, factor in reversed(list(enumerate(factors, 1))):
        last = re.sub(rf"\b_{i}\b", factor, last)
    return last


def run(text: str, **values: float) -> float:
    """Evaluate what the engine would get: this test trusts its own texts only."""
    scope = {**FUNCTIONS, **values}
    exec("\n".join(to_statements({"_result": parse(text, values)})), scope)
    return float(scope["_result"])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2*pi/30", 2 * math.pi / 30),
        ("-2**2", -4.0),
        ("(-2)**2", 4.0),
        ("2**-1", 0.5),
        ("2**3**2", 512.0),
        ("-2**-2", -0.25),
        ("7-3-2", 2.0),
        ("8/4/2", 1.0),
        ("1 - -1", 2.0),
        ("+3", 3.0),
        ("1e-3", 1e-3),
        ("1.", 1.0),
        (".5E1", 5.0),
        ("e", math.e),
        (" sqrt(2) \n", math.sqrt(2)),
        ("log(exp(1))", 1.0),
        ("abs(-3)", 3.0),
        ("atan2(1, 1)", math.pi / 4),
        ("where(1 < 2, 3, 4)", 3.0),
        ("min(1, 2) + max(1, 2)", 3.0),
        ("sign(-2) + sign(0)", -1.0),
        ("4**0.5", 2.0),
        ("10**-8", 1e-8),
        ("0.3**0", 1.0),
        ("heaviside(-2) + heaviside(0) + heaviside(3)", 1.5),
        ("floor(-0.5) + ceil(0.5) + round(2.5)", 2.0),
        ("mod(-1, 3)", 2.0),
        ("mod(1, -3)", -2.0),
        ("hypot(3, -4)", 5.0),
        ("cbrt(-27)", -3.0),
        ("log10(1000) + log2(8)", 6.0),
        ("expm1(log1p(0))", 0.0),
        ("erf(0) + erfc(0)", 1.0),
        ("sinh(asinh(0)) + acosh(1) + atanh(0)", 0.0),
        ("2 if 1 < 2 else 3", 2.0),
        ("2 if 0 else 3 if 1 else 4", 3.0),
        ("1/0 if 0 > 1 else 5", 5.0),
        ("where(1 < 2, 3, sqrt(-1))", 3.0),
        ("1 < 2 < 3", 1.0),
        ("1 < 3 < 2", 0.0),
        ("1 < 2 > 0 != 5 == 5", 1.0),
        ("1 < 2 and 2 < 3 and 3 < 4", 1.0),
        ("1 < 2 and 2 > 3", 0.0),
        ("1 > 2 or 2 > 3 or 3 < 4", 1.0),
        ("1 > 2 or 2 > 3", 0.0),
        ("not 1 > 2", 1.0),
        ("not 1 < 2 or 3 < 4", 1.0),
        ("not (1 < 2 or 3 < 4)", 0.0),
        ("1 < 2 or 3 < 4 and 4 < 3", 1.0),
        ("2*(1 < 2)", 2.0),
    ],
)
def test_constant(text: str, value: float) -> None:
    assert constant(text) == value


@pytest.mark.parametrize(
    ("text", "position", "word"),
    [
        ("theta.real", 0, "attribute"),
        ("(1).__class__", 0, "attribute"),
        ("__import__(1)", 0, "unknown function"),
        ("sine(1)", 0, "did you mean 'sin'"),
        ("sin", 0, "write sin(...)"),
        ("1 + thta", 4, "did you mean 'theta'"),
        ("sin(x=1)", 0, "keyword"),
        ("sin()", 0, "takes 1 argument"),
        ("sin(1, 2)", 0, "takes 1 argument"),
        ("sin(*theta)", 4, "before an argument"),
        ("sin(1)(2)", 0, "only a function"),
        ("'text'", 0, "not allowed"),
        ("[1, 2]", 0, "not allowed"),
        ("{1}", 0, "not allowed"),
        ("1 and 2", 0, "need comparisons"),
        ("1 < 2 and theta", 10, "write x != 0"),
        ("sign(theta) or 1 < 2", 0, "need comparisons"),
        ("not 1", 4, "need comparisons"),
        ("1 < (2 < 3) < 4", 5, "join two comparisons"),
        ("1 < max(2 < 3, 2) < 4", 4, "within a chain"),
        ("1 < (1 if theta > 2 else 3) < 4", 5, "within a chain"),
        ("1 in 2", 0, "'in' and 'is'"),
        ("1 < 2 in 2", 0, "'in' and 'is'"),
        ("1 is not 2", 0, "'in' and 'is'"),
        ("1 % 2", 2, "write mod(x, y)"),
        ("7 // 2", 0, "use floor(a/b)"),
        ("theta & 2", 6, "write and"),
        ("theta | 2", 6, "write or"),
        ("theta @ 2", 6, "not allowed"),
        ("~theta", 0, "not allowed"),
        ("theta if theta", 0, "expected"),
        ("theta if 1 else", 15, "ends where"),
        ("theta > 1 and", 13, "ends where"),
        ("not", 3, "ends where"),
        ("if", 2, "ends where"),
        ("and 1 < 2", 0, "expected"),
        ("ln(2)", 0, "write log"),
        ("arctan2(1, 2)", 0, "write atan2"),
        ("Heaviside(1)", 0, "write heaviside"),
        ("pow(1, 2)", 0, "write a**b"),
        ("erff(1)", 0, "did you mean 'erf'"),
        ("eval(1)", 0, "unknown function"),
        ("heaviside(1, 2)", 0, "takes 1 argument"),
        ("hypot(1)", 0, "takes 2 argument"),
        ("mod(1)", 0, "takes 2 argument"),
        ("round(1, 2)", 0, "takes 1 argument"),
        ("log(8, 2)", 0, "takes 1 argument"),
        ("mod(x=1, y=2)", 0, "keyword"),
        ("floor(**theta)", 0, "keyword"),
        ("mod + 1", 0, "write mod(...)"),
        ("theta.floor()", 0, "only a function"),
        ("floor.__globals__", 0, "attribute"),
        ("(lambda: 1)()", 7, "not allowed"),
        ("f'{theta}'", 1, "not allowed"),
        ("await theta", 0, "not allowed"),
        ("yield 1", 0, "expected"),
        ("print(theta)", 0, "unknown function"),
        ("__builtins__", 0, "unknown name"),
        ("1, 2", 0, "list of values"),
        ("(x for x in theta)", 0, "not allowed"),
        ("lambda: 1", 6, "not allowed"),
        ("(y := 1)", 3, "not allowed"),
        ("theta = 1", 6, "a formula has no ="),
        ("2*sin theta", 2, "write sin(...)"),
        ("2^3", 1, "write **"),
        ("2 \u00d7 3", 2, "write *"),
        ("\u03b8 + 1", 0, "not allowed"),
        ("\uff11 + 1", 0, "not allowed"),
        ("s\u0456n(1)", 1, "not allowed"),
        ("2 + \u03c0", 4, "write pi"),
        ("1_000", 0, "not a number"),
        ("0x10", 0, "not a number"),
        ("1j", 0, "not a number"),
        ("1e999", 0, "too large"),
        ("9" * 400, 0, "too large"),
        ("theta**2000", 7, "at most 1024"),
        ("2pi", 1, "write 2*p"),
        ("2e", 1, "write 2*e"),
        ("1 +", 3, "ends where"),
        ("1 2", 2, "expected an operator"),
        ("1 + * 2", 4, "expected an operator"),
        ("(1", 0, "unmatched parenthesis"),
        ("1)", 1, "unmatched parenthesis"),
        ("", 0, "empty"),
        (" \t\n", 0, "empty"),
        ("1;2", 1, "not allowed"),
        ("1 # note", 2, "not allowed"),
        ("...", 0, "not a number"),
        ("None", 0, "not a number"),
        ("True", 0, "not a number"),
        ("\x00", 0, "not allowed"),
    ],
)
def test_refused_where_and_why(text: str, position: int, word: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        parse(text, ["theta"])
    assert word in str(caught.value)
    assert caught.value.position == position


@pytest.mark.parametrize(
    "text", ["1/0", "sqrt(-1)", "10**400", "exp(1000)", "9**9**9", "(-8)**0.5"]
)
def test_constant_must_be_finite(text: str) -> None:
    with pytest.raises(ExpressionError, match="no finite value"):
        constant(text)


@pytest.mark.parametrize(
    "text",
    [
        "-" * 200 + "1",
        "(" * 300 + "1" + ")" * 300,
        "1" + "*1" * 150,
        "sin(" * 120 + "1" + ")" * 120,
        "not " * 120 + "1 < 2",
        "1 if 2 else " * 120 + "3",
        "1 < 2 and (" * 99 + "2 < 3" + ")" * 99,
    ],
)
def test_deep_nesting_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError, match="must not nest deeper than 100"):
        constant(text)


def test_depth_limit_is_exact() -> None:
    assert constant("-" * (MAX_DEPTH - 1) + "1") in (1.0, -1.0)
    with pytest.raises(ExpressionError, match="deeper than 100"):
        constant("-" * MAX_DEPTH + "1")


@pytest.mark.parametrize("count", [99, 100, 101, 160, 999])
def test_a_sum_may_have_any_number_of_terms(count: int) -> None:
    assert constant("+".join(["1"] * count)) == count
    assert constant("-".join(["1"] * count)) == 2 - count
    signs = ["+", "-"] * count
    text = "".join(f"{sign}x" for sign in signs[:count])[1:]
    read = parse(text, ["x"])
    assert evaluate(read, {"x": 0.5}) == 0.5 * (count % 2)
    assert evaluate(derivative(read, "x"), {}) == count % 2


def test_a_sum_of_up_to_100_terms_is_added_from_left_to_right() -> None:
    text = "+".join(f"1e{k % 17}" for k in range(MAX_DEPTH))
    assert constant(text) == eval(text)


@pytest.mark.parametrize("word", ["and", "or", "<"])
def test_a_long_row_of_conditions_is_no_deep_one(word: str) -> None:
    text = f" {word} ".join(f"{i}" if word == "<" else f"{i} < 200" for i in range(150))
    assert constant(text) == 1.0
    assert len(to_statements({"y": parse(text, ())})) == 1


@pytest.mark.slow
def test_chains_in_a_row_do_not_explode() -> None:
    """A side of a chain stands twice in the tree: chains within chains would double it again and again."""
    text = "1 < x"
    while len(text) < 1900:
        text = f"({text})*(1 < x < 2)"
        try:
            tree = parse(text, ["x"])
        except ExpressionError:
            break
    assert sum(1 for _ in walk(tree)) < len(text)


def test_length_limit() -> None:
    with pytest.raises(ExpressionError, match="at most 2000 characters, has 2001"):
        constant("1" * 2001)


def test_tree_is_frozen_comparable_and_portable() -> None:
    tree = parse("-x**2", ["x"])
    assert tree == Negate(Binary("**", Name("x"), Number(2.0)))
    assert hash(tree) == hash(parse(" - x ** 2.0", ["x"]))
    assert pickle.loads(pickle.dumps(tree)) == tree
    with pytest.raises(AttributeError):
        tree.operand = Number(1.0)


def test_names_in_order_of_use() -> None:
    assert list(parse("b*a + sin(b)*pi", ["a", "b", "c"]).names) == ["b", "a"]


def test_declared_name_wins_over_constant() -> None:
    assert parse("e*pi", ["e"]).names == {"e"}


@pytest.mark.parametrize(
    ("text", "source"),
    [
        ("x**2", "(x * x)"),
        ("x**3", "((x * x) * x)"),
        ("x**5", "(((x * x) * (x * x)) * x)"),
        ("x**-2", "(1.0 / (x * x))"),
        ("x**0", "1.0"),
        ("x**1", "x"),
        ("-x**2", "(-(x * x))"),
        ("x**0.5", "power(x, 0.5)"),
        ("x**y", "power(x, y)"),
        ("a - b - x", "((a - b) - x)"),
        ("a - (b - x)", "(a - (b - x))"),
        ("x/3", "(x / 3.0)"),
        ("0.1*x", "(0.1 * x)"),
        ("where(x > 0, a, b)", "where((x > 0.0), a, b)"),
        ("a if x > 0 else b", "where((x > 0.0), a, b)"),
        ("a < x < b", "((a < x) * (x < b))"),
        ("a < x and x < b", "((a < x) * (x < b))"),
        ("a < x or x < b", "max((a < x), (x < b))"),
        ("not a < x", "(1.0 - (a < x))"),
        ("mod(x, a)", "mod(x, a)"),
    ],
)
def test_source_for_the_engine(text: str, source: str) -> None:
    assert source_of(parse(text, ["x", "y", "a", "b"])) == source


def test_statements_work_out_a_factor_once() -> None:
    lines = to_statements({"energy": parse("2*m*sin(x)**2", ["m", "x"])})
    assert lines == ["_1 = sin(x)", "energy = ((2.0 * m) * (_1 * _1))"]


def test_what_formulas_have_in_common_is_worked_out_once_and_has_the_same_bits() -> None:
    names = ("x", "y")
    quotient = parse("(sin(x - y)*y + x**3)/(2 - cos(x - y)**2)", names)
    formulas = {f"_slope_{name}": derivative(quotient, name) for name in names}
    text = "\n".join(to_statements(formulas))
    assert text.count("(x - y)") == 1
    assert text.count("sin(") == 1
    numbers = {"x": 0.7, "y": -0.3}
    scope = {**FUNCTIONS, **numbers}
    exec(text, scope)
    assert [scope[result] for result in formulas] == [
        evaluate(row, numbers) for row in formulas.values()
    ]


def test_formulas_that_read_alike_are_one_object_also_when_they_are_copied() -> None:
    names = ("x", "y")
    text = "where(x < y, sin(-x)**2, x + 3.5)"
    tree = parse(text, names)
    assert parse(text, names) is tree
    assert pickle.loads(pickle.dumps(tree)) is tree
    assert copy.deepcopy(tree) is tree
    assert parse("where(x < y, sin(-x)**2, y + 3.5)", names) is not tree
    assert list(tree.names) == ["x", "y"]


def test_a_formula_that_would_be_endless_when_written_out_is_worked_with() -> None:
    x = Name("x")
    tree = x
    for _ in range(400):
        tree = Binary("*", tree, Binary("-", Number(2.0), tree))
    slope = derivative(tree, "x")
    # 1 - (1 - x)^(2^n) for n = 400: 0 at 0, with a slope of 2^n
    assert values(tree, {"x": 0.0}) == 0.0
    assert values(slope, {"x": 0.0}) == 2.0**400
    assert len(to_statements({"found": slope})) < 3000
    assert put(slope, "x", Name("y")).names == {"y"}


def test_powers_of_powers_do_not_explode() -> None:
    tree = parse("(" * 12 + "x" + "**1000)" * 12, ["x"])
    assert len("\n".join(to_statements({"y": tree}))) < 20_000


@pytest.mark.parametrize(
    "model",
    [model for model in MODELS.values() if model.loaded is None],
    ids=lambda model: model.kind,
)
def test_model_formulas(model: Model) -> None:
    names = [*(s.name for s in model.states), "t", *(p.name for p in model.parameters)]
    values = {name: 0.7 + 0.1 * i for i, name in enumerate(names)}
    for formula in (model.acceleration, model.kinetic_energy, model.potential_energy):
        text = formula if isinstance(formula, str) else to_formula(formula)
        tree = parse(text, names)
        assert set(tree.names) <= set(names)
        # the formula is Python too; only the powers are taken differently, which costs a few roundings
        expected = eval(text, {**FUNCTIONS, **values})
        assert run(text, **values) == pytest.approx(expected, rel=1e-15)
        assert evaluate(tree, values) == run(text, **values)


_LEAVES = st.one_of(
    st.floats(0.5, 2.0).map(repr), st.sampled_from(["x", "y", "pi"]), st.integers(1, 5).map(str)
)
FORMULAS = st.recursive(
    _LEAVES,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["+", "-", "*", "/", " - "]), inner).map("".join),
        inner.map("({})".format),
        inner.map("-({})".format),
        inner.map("cos({})".format),
        inner.map("erf({})".format),
        inner.map("mod({}, 0.7)".format),
        st.tuples(inner, inner).map("hypot({0[0]}, {0[1]})".format),
        st.tuples(inner, inner).map("(1*(({0[0]}) < ({0[1]}) or not ({0[0]}) < 2))".format),
        st.tuples(inner.map("({})".format), st.integers(-3, 6)).map(lambda p: f"{p[0]}**{p[1]}"),
    ),
    max_leaves=12,
)


@pytest.mark.slow
@given(FORMULAS)
@settings(max_examples=150, deadline=None)
def test_both_ways_give_the_same_bits(text: str) -> None:
    values = {"x": 1.3, "y": -0.6}
    try:
        expected = evaluate(parse(text, values), values)
    except ExpressionError:
        return
    assert repr(run(text, **values)) == repr(expected)


@given(st.text(alphabet="xy019.+-*/()<>=!, esinqrtadofl^_'\"[]{}:;\\\n\t\u03c0\u0660", max_size=60))
@settings(max_examples=250, deadline=None)
def test_any_text_is_a_formula_or_refused(text: str) -> None:
    try:
        evaluate(parse(text, ["x", "y"]), {"x": 1.0, "y": 2.0})
    except ExpressionError as error:
        position = error.position
    else:
        position = 0
    assert 0 <= position <= len(text)
