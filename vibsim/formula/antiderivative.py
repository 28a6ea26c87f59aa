"""Antiderivatives of functions of one argument, as formulas that vanish at 0 and do not cancel there."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from vibsim.formula.tree import Binary, Call, Compare, Expression, Negate, Number

ZERO, ONE, TWO, HALF = Number(0.0), Number(1.0), Number(2.0), Number(0.5)
PER_ROOT_PI = Number(1.0 / math.sqrt(math.pi))
SMALL = 0.3
"""Below, log cosh and what ``e^x`` has above ``1 + x`` are series."""


def _product(*factors: Expression) -> Expression:
    first, *rest = factors
    for factor in rest:
        first = Binary("*", first, factor)
    return first


def _call(function: str, *arguments: Expression) -> Expression:
    return Call(function, arguments)


def _of_halves(first: str, second: str) -> Callable[[Expression], Expression]:
    """Return a function that writes ``2 first(x/2) second(x/2)``."""

    def write(x: Expression) -> Expression:
        half = Binary("*", HALF, x)
        return Binary("*", TWO, Binary("*", _call(first, half), _call(second, half)))

    return write


def _log_cosh(x: Expression) -> Expression:
    """Write ``log(cosh(x))`` so that it overflows nowhere and has all its digits near 0.

    It is ``|x| + log((1 + exp(-2 |x|))/2)``, and with ``z = y/(2 + y)``, ``y = sinh(x)**2``, also artanh(z).
    """
    size = _call("abs", x)
    decay = _call("exp", Negate(Binary("*", TWO, size)))
    beyond = Binary("+", size, _call("log", Binary("*", HALF, Binary("+", ONE, decay))))
    y = Binary("**", _call("sinh", x), TWO)
    z = Binary("/", y, Binary("+", TWO, y))
    square = Binary("**", z, TWO)
    series: Expression = Binary("/", ONE, Number(13.0))
    for k in (11.0, 9.0, 7.0, 5.0, 3.0, 1.0):
        series = Binary("+", Binary("/", ONE, Number(k)), Binary("*", square, series))
    return _call("where", Compare("<", size, Number(SMALL)), Binary("*", z, series), beyond)


def _expm1(x: Expression) -> Expression:
    """Write ``e^x - 1 - x``."""
    series: Expression = ONE
    for k in range(14, 2, -1):
        series = Binary("+", ONE, Binary("*", Binary("/", x, Number(float(k))), series))
    near = _product(HALF, x, x, series)
    is_small = Compare("<", _call("abs", x), Number(SMALL))
    return _call("where", is_small, near, Binary("-", _call("expm1", x), x))


def _below_one(x: Expression) -> Expression:
    """Write ``(1 - exp(-x^2))/sqrt(pi)``."""
    return Negate(Binary("*", PER_ROOT_PI, _call("expm1", Negate(Binary("**", x, TWO)))))


def _asinh(x: Expression) -> Expression:
    """Write ``x asinh(x) + 1 - sqrt(1 + x^2)``."""
    beyond = Binary("/", x, Binary("+", ONE, _call("hypot", ONE, x)))
    return _product(x, Binary("-", _call("asinh", x), beyond))


def _atan(x: Expression) -> Expression:
    """Write ``x atan(x) - log(1 + x^2)/2``, whose second part is at most half of the first."""
    logarithm = _call("log1p", Binary("**", x, TWO))
    return Binary("-", _product(x, _call("atan", x)), _product(HALF, logarithm))


def _atanh(x: Expression) -> Expression:
    """Write ``x atanh(x) + log(1 - x^2)/2``, whose logarithm has its digits near 0 in one form, near 1 in another."""
    is_small = Compare("<", _call("abs", x), HALF)
    near = _call("log1p", Negate(Binary("**", x, TWO)))
    far = _call("log", Binary("*", Binary("-", ONE, x), Binary("+", ONE, x)))
    logarithm = _call("where", is_small, near, far)
    return Binary("+", _product(x, _call("atanh", x)), _product(HALF, logarithm))


def _of_steps(
    function: str, height: Callable[[Expression], Expression]
) -> Callable[[Expression], Expression]:
    """Return a function that writes ``n (x - height(n)/2)`` with the whole number ``n = function(x)``."""

    def write(x: Expression) -> Expression:
        n = _call(function, x)
        return Binary("*", n, Binary("-", x, _product(HALF, height(n))))

    return write


def ramp_integral(x: Expression) -> Expression:
    """Write the antiderivative of ``max(x, 0)``."""
    return _product(HALF, x, ramp(x))


def ramp(x: Expression) -> Expression:
    """Write ``max(x, 0)``."""
    return _call("max", x, ZERO)


def of_mod(x: Expression, period: Expression) -> Expression:
    """Write the antiderivative of ``mod(x, period)``, ``(n period^2 + m^2)/2`` with ``x = n period + m``.

    In the periods beside 0, where that cancels, it is ``x (x/2 - n period)``.
    """
    m = _call("mod", x, period)
    n = _call("round", Binary("/", Binary("-", x, m), period))
    near = Binary("*", x, Binary("-", _product(HALF, x), Binary("*", n, period)))
    far = _product(HALF, Binary("+", _product(n, period, period), Binary("*", m, m)))
    is_near = Compare("<", _call("abs", Binary("+", n, HALF)), ONE)
    return _call("where", is_near, near, far)


SMOOTH: Mapping[str, Callable[[Expression], Expression]] = {
    "sin": _of_halves("sin", "sin"),
    "cos": lambda x: _call("sin", x),
    "exp": _of_halves("exp", "sinh"),
    "expm1": _expm1,
    "sinh": _of_halves("sinh", "sinh"),
    "cosh": lambda x: _call("sinh", x),
    "tanh": _log_cosh,
    "asinh": _asinh,
    "atan": _atan,
    "atanh": _atanh,
    "cbrt": lambda x: _product(Number(0.75), x, _call("cbrt", x)),
    "erf": lambda x: Binary("-", _product(x, _call("erf", x)), _below_one(x)),
    "erfc": lambda x: Binary("+", _product(x, _call("erfc", x)), _below_one(x)),
}
"""Of functions that are smooth, or have their corner at 0."""

BROKEN: Mapping[str, Callable[[Expression], Expression]] = {
    "abs": lambda x: Binary("*", HALF, Binary("*", x, _call("abs", x))),
    "ceil": _of_steps("ceil", lambda n: Binary("-", n, ONE)),
    "floor": _of_steps("floor", lambda n: Binary("+", n, ONE)),
    "heaviside": ramp,
    "round": _of_steps("round", lambda n: n),
    "sign": lambda x: _call("abs", x),
}
"""Of functions with a corner or jumps, which a rule of points does not integrate."""
