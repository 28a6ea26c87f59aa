"""Values of formulas for arrays, by numpy: for exact solutions and frequencies, not for steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.formula.tree import Binary, Call, Compare, Expression, Name, Negate, Number

_OPERATORS: Mapping[str, Callable[..., Any]] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "**": np.power,
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
    "==": np.equal,
    "!=": np.not_equal,
}


def _by_scipy(name: str) -> Callable[..., Any]:
    """Return a function of SciPy, which is imported when it is called."""
    return lambda x: getattr(import_module("scipy.special"), name)(x)


_SAME_NAME = (
    *("abs", "cbrt", "ceil", "cos", "cosh", "exp", "expm1", "floor", "hypot", "log", "log10"),
    *("log1p", "log2", "mod", "sign", "sin", "sinh", "sqrt", "tan", "tanh"),
)
_FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "acos": np.arccos,
    "acosh": np.arccosh,
    "asin": np.arcsin,
    "asinh": np.arcsinh,
    "atan": np.arctan,
    "atan2": np.arctan2,
    "atanh": np.arctanh,
    "erf": _by_scipy("erf"),
    "erfc": _by_scipy("erfc"),
    "heaviside": lambda x: np.heaviside(x, 0.5),
    "max": np.maximum,
    "min": np.minimum,
    "round": np.rint,
    "where": lambda condition, yes, no: np.where(condition != 0.0, yes, no),
    **{name: getattr(np, name) for name in _SAME_NAME},
}


def values(expression: Expression, numbers: Mapping[str, Any]) -> NDArray[np.float64]:
    """Return the values of a formula; NaN or infinite where it has none.

    Parameters
    ----------
    numbers
        Value of every name: floats, or arrays that broadcast against each other.
    """
    with np.errstate(all="ignore"):
        return np.asarray(_values(expression, numbers), dtype=np.float64)


def _values(node: Expression, numbers: Mapping[str, Any]) -> Any:
    match node:
        case Number(value):
            # of numpy, whose division by zero is infinite
            return np.float64(value)
        case Name(name):
            return np.asarray(numbers[name], dtype=np.float64)
        case Negate(operand):
            return np.negative(_values(operand, numbers))
        case Binary(symbol, left, right):
            return _OPERATORS[symbol](_values(left, numbers), _values(right, numbers))
        case Compare(symbol, left, right):
            found = _OPERATORS[symbol](_values(left, numbers), _values(right, numbers))
            return np.where(found, 1.0, 0.0)
        case Call(function, arguments):
            return _FUNCTIONS[function](*(_values(argument, numbers) for argument in arguments))
