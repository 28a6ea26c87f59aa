"""Evaluate a formula, or write it as text or as source for the engine.

Evaluation and source use the order of operations of the formula, and multiplications for integer powers. So a constant
has the same bits here and in the engine.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from itertools import accumulate

from vibsim.elementary import ELEMENTARY
from vibsim.elementary.exact import whole_power
from vibsim.formula.parser import ExpressionError, parse
from vibsim.formula.tree import (
    FUNCTIONS,
    OPERATORS,
    Binary,
    Call,
    Compare,
    Expression,
    Name,
    Negate,
    Number,
    folded,
    literal,
    parts_of,
)

MAX_NESTING = 120
"""Nesting of parentheses above which `to_statements` splits an expression; Python's limit is 200."""


def constant(text: str) -> float:
    """Return the value of a formula without names, e.g. ``2*pi/30``.

    Raises
    ------
    ExpressionError
        If the text is not a formula, contains names, or has no finite value.
    """
    value = evaluate(parse(text, ()), {}, text)
    if not math.isfinite(value):
        raise ExpressionError(text, 0, "has no finite value")
    return value


def evaluate(expression: Expression, values: Mapping[str, float], text: str = "") -> float:
    """Return the value of `expression` for the given `values` of its names.

    Raises
    ------
    ExpressionError
        If the value does not exist: division by zero, overflow, root of a negative number.
    """
    try:
        return float(_value(expression, values))
    except ZeroDivisionError:
        hint = "it divides by zero"
    except OverflowError:
        hint = "it is too large"
    except (ValueError, TypeError):
        hint = "a function or power does not exist there"
    raise ExpressionError(text, 0, "has no finite value", hint)


def _value(node: Expression, values: Mapping[str, float]) -> float:
    match node:
        case Number(value):
            return value
        case Name(name):
            return values[name]
        case Negate(operand):
            return -_value(operand, values)
        case Binary("**", base, exponent):
            return _power(_value(base, values), _value(exponent, values), literal(exponent))
        case Binary(symbol, left, right) | Compare(symbol, left, right):
            return float(OPERATORS[symbol](_value(left, values), _value(right, values)))
        case Call("where", (condition, yes, no)):
            # the other branch need not have a value
            chosen = _value(condition, values)
            if math.isnan(chosen):
                raise ValueError
            return _value(yes if chosen != 0.0 else no, values)
        case Call(function, arguments):
            numbers = [_value(argument, values) for argument in arguments]
            return _finite(FUNCTIONS[function][1](*numbers))
    raise AssertionError(node)


def _finite(value: float) -> float:
    """Return the result of a function; raise an error if it is not finite, as operators of Python do."""
    if math.isnan(value):
        raise ValueError
    if math.isinf(value):
        raise OverflowError
    return value


def _power(base: float, exponent: float, constant: float | None) -> float:
    """Return a power, by multiplication if the exponent is an integer constant, as in the engine."""
    if constant is None or not exponent.is_integer():
        return _finite(ELEMENTARY["power"].full(base, exponent))
    return float(whole_power(base, int(exponent)))


def to_formula(expression: Expression) -> str:
    """Return the text of a formula with minimal parentheses; `parse` returns the same expression for it."""
    return _text_of(expression)[0]


_PRECEDENCE = {"+": 2, "-": 2, "*": 3, "/": 3}
_COMPARED, _NEGATED, _POWER, _ATOM = 1, 4, 5, 6
"""Precedence of a comparison, a sign, a power, and an atom or call."""


def _text_of(node: Expression) -> tuple[str, int]:
    """Return the text of a formula and the precedence of its outermost operation."""
    match node:
        case Number(value):
            return f"{value:.0f}" if value < 1e15 and value.is_integer() else repr(value), _ATOM
        case Name(name):
            return name, _ATOM
        case Negate(operand):
            return f"-{_within(operand, _NEGATED)}", _NEGATED
        case Binary("**", base, exponent):
            # powers are right-associative, and an exponent may have a sign
            return f"{_within(base, _ATOM)}**{_within(exponent, _NEGATED)}", _POWER
        case Binary(symbol, left, right):
            binding = _PRECEDENCE[symbol]
            gap = " " if binding == _PRECEDENCE["+"] else ""
            text = f"{_within(left, binding)}{gap}{symbol}{gap}{_within(right, binding + 1)}"
            return text, binding
        case Compare(symbol, left, right):
            least = _COMPARED + 1
            return f"{_within(left, least)} {symbol} {_within(right, least)}", _COMPARED
        case Call(function, arguments):
            return f"{function}({', '.join(_within(a, 0) for a in arguments)})", _ATOM
    raise AssertionError(node)


def _within(node: Expression, least: int) -> str:
    text, binding = _text_of(node)
    return text if binding >= least else f"({text})"


def to_statements(formulas: Mapping[str, Expression]) -> list[str]:
    """Return formulas as Python assignments for the engine; the last ones assign to the keys of `formulas`.

    Common subexpressions are evaluated once: ``sin(x)*sin(x)`` becomes ``_1 = sin(x)`` and ``result = (_1 * _1)``.
    Every operation has parentheses, which fixes the order. The source contains numbers, names, ``+ - * /``,
    comparisons, calls of `FUNCTIONS`, and ``power(base, exponent)`` for exponents that are not integer constants.
    Integer powers are expanded by repeated squaring from the leading bit of the exponent. No name of a formula
    starts with ``_``.
    """
    lines: list[str] = []
    parts = parts_of(*formulas.values())
    uses = Counter(operand for part in parts for operand in part.operands)
    uses.update(formulas.values())

    def named(source: str) -> str:
        if source.isidentifier() or source.replace(".", "", 1).isdigit():
            return source
        lines.append(f"_{len(lines) + 1} = {source}")
        return f"_{len(lines)}"

    def power(base: str, exponent: str, whole: float | None) -> str:
        if whole is None or not whole.is_integer():
            return f"power({base}, {exponent})"
        if whole == 0.0:
            return "1.0"
        factor = product = named(base)
        for bit in bin(abs(int(whole)))[3:]:
            half = named(product)
            product = f"({half} * {half})"
            if bit == "1":
                product = f"({product} * {factor})"
        return product if whole > 0.0 else f"(1.0 / {product})"

    def source(node: Expression, *operands: str) -> str:
        match node:
            case Number(value):
                text = repr(value)
            case Name(name):
                text = name
            case Negate():
                text = f"(-{operands[0]})"
            case Binary("**", _, exponent):
                text = power(operands[0], operands[1], literal(exponent))
            case Binary(symbol) | Compare(symbol):
                text = f"({operands[0]} {symbol} {operands[1]})"
            case Call(function):
                text = f"{function}({', '.join(operands)})"
        is_shared = uses[node] > 1 and literal(node) is None
        is_deep = text.count("(") > MAX_NESTING and _nesting(text) > MAX_NESTING
        return named(text) if is_shared or is_deep else text

    sources = folded(list(formulas.values()), source)
    return lines + [f"{result} = {last}" for result, last in zip(formulas, sources, strict=True)]


def _nesting(source: str) -> int:
    return max(accumulate((c == "(") - (c == ")") for c in source))
