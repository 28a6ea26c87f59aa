"""What becomes of a formula: a number, or source text for the engine.

Both take the operations in the formula's own order, whole powers by multiplication, so that a constant has the same
bits whether it was worked out here or in the engine.
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
"""Parentheses in each other from which `to_statements` gives a part a name: Python reads 200, derivatives have more."""


def constant(text: str) -> float:
    """Work out a formula without names, e.g. ``2*pi/30``.

    Raises
    ------
    ExpressionError
        Where the text is no formula, names something, or has no finite value.
    """
    value = evaluate(parse(text, ()), {}, text)
    if not math.isfinite(value):
        raise ExpressionError(text, 0, "has no finite value")
    return value


def evaluate(expression: Expression, values: Mapping[str, float], text: str = "") -> float:
    """Return the value of `expression` at the given `values` of its names.

    Raises
    ------
    ExpressionError
        Where the value does not exist: division by zero, overflow, root of a negative number.
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
            # the other one need not exist
            chosen = _value(condition, values)
            if math.isnan(chosen):
                raise ValueError
            return _value(yes if chosen != 0.0 else no, values)
        case Call(function, arguments):
            found = [_value(argument, values) for argument in arguments]
            return _existing(FUNCTIONS[function][1](*found))
    raise AssertionError(node)


def _existing(value: float) -> float:
    """Return what a function gave; raise where it does not exist, as the operators of Python do."""
    if math.isnan(value):
        raise ValueError
    if math.isinf(value):
        raise OverflowError
    return value


def _power(base: float, exponent: float, written: float | None) -> float:
    """Return a power: by multiplication where a whole exponent is written as a number, as in the engine."""
    if written is None or not exponent.is_integer():
        return _existing(ELEMENTARY["power"].full(base, exponent))
    return float(whole_power(base, int(exponent)))


def to_formula(expression: Expression) -> str:
    """Write `expression` as a formula, with no more parentheses than needed: `parse` gives the same tree again."""
    return _written(expression)[0]


_BINDING = {"+": 2, "-": 2, "*": 3, "/": 3}
_COMPARED, _NEGATED, _POWER, _ATOM = 1, 4, 5, 6
"""How tightly a comparison, a sign, a power and anything that cannot be taken apart bind."""


def _written(node: Expression) -> tuple[str, int]:
    """Return the text of a formula and how tightly its last operation binds."""
    match node:
        case Number(value):
            return f"{value:.0f}" if value < 1e15 and value.is_integer() else repr(value), _ATOM
        case Name(name):
            return name, _ATOM
        case Negate(operand):
            return f"-{_within(operand, _NEGATED)}", _NEGATED
        case Binary("**", base, exponent):
            # a power takes a sign behind it, and is itself taken from right to left
            return f"{_within(base, _ATOM)}**{_within(exponent, _NEGATED)}", _POWER
        case Binary(symbol, left, right):
            own = _BINDING[symbol]
            gap = " " if own == _BINDING["+"] else ""
            text = f"{_within(left, own)}{gap}{symbol}{gap}{_within(right, own + 1)}"
            return text, own
        case Compare(symbol, left, right):
            least = _COMPARED + 1
            return f"{_within(left, least)} {symbol} {_within(right, least)}", _COMPARED
        case Call(function, arguments):
            return f"{function}({', '.join(_within(a, 0) for a in arguments)})", _ATOM
    raise AssertionError(node)


def _within(node: Expression, least: int) -> str:
    text, binding = _written(node)
    return text if binding >= least else f"({text})"


def to_statements(formulas: Mapping[str, Expression]) -> list[str]:
    """Write formulas as assignments of Python for the engine, each of the last ones to the name of a result.

    What several of their parts use is worked out once: ``sin(x)*sin(x)`` becomes ``_1 = sin(x)`` and
    ``result = (_1 * _1)``. Every operation has its parentheses, so that their order is the formula's. There are
    numbers, names, ``+ - * /``, comparisons, and calls of `FUNCTIONS`, and of ``power(base, exponent)`` where an
    exponent is not a whole number. A whole power is squared and multiplied from the exponent's leading bit on. No name
    of a formula begins with ``_``.
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
        factor = found = named(base)
        for bit in bin(abs(int(whole)))[3:]:
            half = named(found)
            found = f"({half} * {half})"
            if bit == "1":
                found = f"({found} * {factor})"
        return found if whole > 0.0 else f"(1.0 / {found})"

    def source(node: Expression, *operands: str) -> str:
        match node:
            case Number(value):
                found = repr(value)
            case Name(name):
                found = name
            case Negate():
                found = f"(-{operands[0]})"
            case Binary("**", _, exponent):
                found = power(operands[0], operands[1], literal(exponent))
            case Binary(symbol) | Compare(symbol):
                found = f"({operands[0]} {symbol} {operands[1]})"
            case Call(function):
                found = f"{function}({', '.join(operands)})"
        is_shared = uses[node] > 1 and literal(node) is None
        is_deep = found.count("(") > MAX_NESTING and _nesting(found) > MAX_NESTING
        return named(found) if is_shared or is_deep else found

    found = folded(list(formulas.values()), source)
    return lines + [f"{result} = {last}" for result, last in zip(formulas, found, strict=True)]


def _nesting(source: str) -> int:
    return max(accumulate((c == "(") - (c == ")") for c in source))
