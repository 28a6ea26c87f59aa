"""Values of formulas for arrays, and bounds over intervals of names, by numpy. Time steps do not use them.

Bounds cover what happens between two samples. They come from interval arithmetic without outward rounding: bounds only
direct a search, and values decide. An operation that is undefined somewhere in its intervals is unbounded.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.elementary import on_arrays
from vibsim.elementary.exact import whole_power
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
)

Interval = tuple[Floats, Floats]


_FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    **{name: on_arrays.named(name) for name in FUNCTIONS},
    **{"abs": np.abs, "ceil": np.ceil, "floor": np.floor, "sign": np.sign, "sqrt": np.sqrt},
    **{"max": np.maximum, "min": np.minimum, "mod": np.mod, "round": np.rint},
    "heaviside": lambda x: np.heaviside(x, 0.5),
    "where": lambda condition, yes, no: np.where(condition != 0.0, yes, no),
}
FALLING = frozenset(("acos", "erfc"))
EVEN = frozenset(("abs", "cosh"))
TURNS = {"sin": 0.25, "cos": 0.0}
"""Position of the first maximum of a periodic function, in periods."""


def values(expression: Expression, numbers: Mapping[str, Any]) -> Floats:
    """Return the values of a formula; NaN or infinite where it is undefined.

    Parameters
    ----------
    numbers
        Value of every name: floats, or arrays that broadcast against each other.
    """
    return values_of([expression], numbers)[0]


def values_of(expressions: Sequence[Expression], numbers: Mapping[str, Any]) -> list[Floats]:
    """Return the values of several formulas; common subexpressions are evaluated once."""
    with np.errstate(all="ignore"):
        results = folded(expressions, partial(_value_of, numbers))
    return [np.asarray(value, dtype=np.float64) for value in results]


def _value_of(numbers: Mapping[str, Any], node: Expression, *operands: Any) -> Any:
    """Return the value of a formula from those of its operands."""
    match node:
        case Number(value):
            # a numpy number, whose division by zero is infinite
            return np.float64(value)
        case Name(name):
            return np.asarray(numbers[name], dtype=np.float64)
        case Negate():
            return np.negative(*operands)
        case Binary("**", _, exponent):
            return _raised(operands[0], operands[1], literal(exponent))
        case Binary(symbol):
            return OPERATORS[symbol](*operands)
        case Compare(symbol):
            return np.where(OPERATORS[symbol](*operands), 1.0, 0.0)
        case Call(function):
            return _FUNCTIONS[function](*operands)


def _raised(base: Floats, exponent: Floats, constant: float | None) -> Any:
    """Return a power, by multiplication if the exponent is an integer `constant`, as in the engine."""
    if constant is not None and constant.is_integer():
        return whole_power(base, int(constant))
    return on_arrays.power(base, exponent)


def bounds(expression: Expression, numbers: Mapping[str, Any]) -> Interval:
    """Return bounds of the values of a formula.

    Parameters
    ----------
    numbers
        For every name its value, or a pair of bounds; arrays that broadcast against each other.
    """
    with np.errstate(all="ignore"):
        [(low, high)] = folded([expression], partial(_bounds_of, numbers))
        return _or_unbounded(low, high)


def _or_unbounded(low: Any, high: Any) -> Interval:
    """Return bounds, infinite where they are NaN."""
    unknown = np.isnan(low) | np.isnan(high)
    return np.where(unknown, -np.inf, low), np.where(unknown, np.inf, high)


def _bounds_of(numbers: Mapping[str, Any], node: Expression, *operands: Interval) -> Interval:
    """Return the bounds of a formula from those of its operands."""
    match node:
        case Number(value):
            return np.asarray(value, dtype=float), np.asarray(value, dtype=float)
        case Name(name):
            value = numbers[name]
            return value if isinstance(value, tuple) else (np.asarray(value), np.asarray(value))
        case Negate():
            [(low, high)] = operands
            return -high, -low
        case Binary("**", _, exponent):
            base, power = operands
            return _power(base, power, literal(exponent))
        case Binary("*"):
            return _or_unbounded(*_product(*operands))
        case Binary("/"):
            return _or_unbounded(*_quotient(*operands))
        case Binary(symbol):
            return _or_unbounded(*_corners(OPERATORS[symbol], *operands))
        case Compare(symbol):
            return _comparison(symbol, *operands)
        case Call(function):
            return _or_unbounded(*_call(function, operands))
    raise AssertionError(node)


def _product(a: Interval, b: Interval) -> Interval:
    # 0 times infinity is 0 here: 0 bounds the product with any finite value
    products = [np.nan_to_num(x * y, nan=0.0, posinf=np.inf, neginf=-np.inf) for x in a for y in b]
    return np.minimum.reduce(products), np.maximum.reduce(products)


def _quotient(a: Interval, b: Interval) -> Interval:
    has_pole = (b[0] <= 0.0) & (b[1] >= 0.0)
    low, high = _product(a, (1.0 / b[1], 1.0 / b[0]))
    return np.where(has_pole, -np.inf, low), np.where(has_pole, np.inf, high)


def _power(base: Interval, exponent: Interval, number: float | None) -> Interval:
    if number is not None and number == round(number):
        if number < 0:
            return _quotient((np.ones(()), np.ones(())), _power(base, exponent, -number))
        low, high = _absolute(base) if number % 2 == 0 else base
        return whole_power(low, int(number)), whole_power(high, int(number))
    low, high = _corners(on_arrays.power, base, exponent)
    has_value = base[0] >= 0.0
    return np.where(has_value, low, -np.inf), np.where(has_value, high, np.inf)


def _corners(function: Callable[..., Any], a: Interval, b: Interval) -> Interval:
    """Return the bounds of a function that is monotone in both arguments."""
    corners = [function(x, y) for x in a for y in b]
    return np.minimum.reduce(corners), np.maximum.reduce(corners)


def _absolute(a: Interval) -> Interval:
    """Return the bounds of the absolute value."""
    ends = np.abs(a[0]), np.abs(a[1])
    has_zero = (a[0] <= 0.0) & (a[1] >= 0.0)
    return np.where(has_zero, 0.0, np.minimum(*ends)), np.maximum(*ends)


def _comparison(symbol: str, a: Interval, b: Interval) -> Interval:
    low, high = _corners(np.subtract, a, b)
    sure = {
        "<": (high < 0.0, low >= 0.0),
        "<=": (high <= 0.0, low > 0.0),
        ">": (low > 0.0, high <= 0.0),
        ">=": (low >= 0.0, high < 0.0),
        "==": ((low == 0.0) & (high == 0.0), (low > 0.0) | (high < 0.0)),
        "!=": ((low > 0.0) | (high < 0.0), (low == 0.0) & (high == 0.0)),
    }
    is_true, is_false = sure[symbol]
    return np.where(is_true, 1.0, 0.0), np.where(is_false, 0.0, 1.0)


def _call(function: str, args: Sequence[Interval]) -> Interval:
    match function:
        case "min" | "max" | "hypot":
            a, b = (_absolute(x) for x in args) if function == "hypot" else args
            return _function_value(function, a[0], b[0]), _function_value(function, a[1], b[1])
        case "atan2":
            is_right = args[1][0] > 0.0
            low, high = _corners(on_arrays.atan2, *args)
            return np.where(is_right, low, -np.pi), np.where(is_right, high, np.pi)
        case "mod":
            return _modulo(*args)
        case "where":
            return _where(*args)
        case "sin" | "cos":
            return _periodic(function, args[0])
        case "tan":
            low, high = (_function_value("tan", x) for x in args[0])
            same_branch = np.floor(args[0][0] / np.pi - 0.5) == np.floor(args[0][1] / np.pi - 0.5)
            return np.where(same_branch, low, -np.inf), np.where(same_branch, high, np.inf)
    ends = _absolute(args[0]) if function in EVEN else args[0]
    low, high = (_function_value(function, x) for x in ends)
    return (high, low) if function in FALLING else (low, high)


def _function_value(function: str, *arguments: Floats) -> Floats:
    names = [f"x{i}" for i in range(len(arguments))]
    call = Call(function, tuple(Name(name) for name in names))
    return values(call, dict(zip(names, arguments, strict=True)))


def _periodic(function: str, x: Interval) -> Interval:
    """Return the bounds of sine or cosine: 1 if a maximum lies between the ends, -1 if a minimum does."""
    ends = [_function_value(function, end) for end in x]
    turns = [end / (2.0 * np.pi) - TURNS[function] for end in x]
    # true for infinite ends, too
    wide = ~(turns[1] - turns[0] < 1.0)
    top = wide | (np.ceil(turns[0]) <= np.floor(turns[1]))
    bottom = wide | (np.ceil(turns[0] - 0.5) <= np.floor(turns[1] - 0.5))
    return np.where(bottom, -1.0, np.minimum(*ends)), np.where(top, 1.0, np.maximum(*ends))


def _modulo(x: Interval, y: Interval) -> Interval:
    whole = [np.floor(end / y[0]) for end in x]
    same_branch = (whole[0] == whole[1]) & (y[0] == y[1])
    low, high = (end - whole[0] * y[0] for end in x)
    return (
        np.where(same_branch, np.minimum(low, high), np.minimum(y[0], 0.0)),
        np.where(same_branch, np.maximum(low, high), np.maximum(y[1], 0.0)),
    )


def _where(condition: Interval, yes: Interval, no: Interval) -> Interval:
    never = (condition[0] == 0.0) & (condition[1] == 0.0)
    always = (condition[0] > 0.0) | (condition[1] < 0.0)
    low, high = np.minimum(yes[0], no[0]), np.maximum(yes[1], no[1])
    return (
        np.where(always, yes[0], np.where(never, no[0], low)),
        np.where(always, yes[1], np.where(never, no[1], high)),
    )
