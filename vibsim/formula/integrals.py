"""Symbolic integrals of formulas, for the potential energy of a spring.

Integrals start at 0 and have forms that do not cancel there, so small energies keep all digits. Sums are integrated
term by term; a term is a constant times a power of x, or a function of the table `SMOOTH` of ``a x``. Functions with
corners or jumps (`BROKEN`) are also integrated for ``a x + b``, although ``F(a x + b) - F(b)`` may cost small energies
some digits. A term that is switched on by a condition is integrated up to, or from, the switching point. Everything
else is integrated by a Gauss-Legendre rule from 0 to x, written as a formula. It is accurate to round-off for a smooth
function, even with a corner at 0. For functions with complex poles near the real axis, such as ``x/sqrt(1 + x^2)`` at
i, the rule integrates over asinh(x): the interval from 0 to 128 then has length 5.5, and the pole is 1.6 away.
"""

from __future__ import annotations

import math
from functools import partial, reduce

import numpy as np

from vibsim.formula.algebra import filled, slope_of
from vibsim.formula.arrays import values
from vibsim.formula.tree import (
    ZERO,
    Binary,
    Call,
    Compare,
    Expression,
    Name,
    Negate,
    Number,
    literal,
    number,
    paired,
    put,
    walk,
)

QUADRATURE_POINTS = 24
"""Number of points of the rule, which is exact for polynomials up to degree 47."""
POLES = frozenset(
    ("sqrt", "hypot", "log", "log1p", "log2", "log10", "atan", "asinh", "tanh", "tan", "atan2")
)
"""Functions with complex singularities near the real axis."""
MAX_CONDITIONS = 4
"""Largest number of nested conditions or calls under a condition: each doubles the length of the integral."""

# log(cosh(x)) without overflow and without cancellation near 0: artanh(z) with z = y/(2 + y), y = sinh(x)**2
_Z = "(sinh(x)**2/(2 + sinh(x)**2))"
_ARTANH = reduce(lambda inner, k: f"1/{k} + {_Z}**2*({inner})", range(11, 0, -2), "1/13")
_LOG_COSH_FAR = "abs(x) + log(0.5*(1 + exp(-(2*abs(x)))))"
# series of e^x - 1 - x without its factor x^2/2, and x erf(x) minus the integral of erf
_EXP_SERIES = reduce(lambda inner, k: f"1 + x/{k}*({inner})", range(14, 2, -1), "1")
_ERF_REST = f"-({1.0 / math.sqrt(math.pi)!r}*expm1(-x**2))"

SMOOTH = {
    "sin": "2*(sin(0.5*x)*sin(0.5*x))",
    "cos": "sin(x)",
    "exp": "2*(exp(0.5*x)*sinh(0.5*x))",
    "expm1": f"where(abs(x) < 0.3, 0.5*x*x*({_EXP_SERIES}), expm1(x) - x)",
    "sinh": "2*(sinh(0.5*x)*sinh(0.5*x))",
    "cosh": "sinh(x)",
    "tanh": f"where(abs(x) < 0.3, {_Z}*({_ARTANH}), {_LOG_COSH_FAR})",
    # x asinh(x) + 1 - sqrt(1 + x^2)
    "asinh": "x*(asinh(x) - x/(1 + hypot(1, x)))",
    # no cancellation: the second term is at most half of the first
    "atan": "x*atan(x) - 0.5*log1p(x**2)",
    # log(1 - x^2) is accurate near 0 in one form, near 1 in the other
    "atanh": "x*atanh(x) + 0.5*where(abs(x) < 0.5, log1p(-x**2), log((1 - x)*(1 + x)))",
    "cbrt": "0.75*x*cbrt(x)",
    "erf": f"x*erf(x) - {_ERF_REST}",
    "erfc": f"x*erfc(x) + {_ERF_REST}",
}
"""Antiderivatives that vanish at 0, of functions that are smooth or have their only corner at 0."""
RAMP = "max(x, 0)"
BROKEN = {
    "abs": "0.5*(x*abs(x))",
    "ceil": "ceil(x)*(x - 0.5*(ceil(x) - 1))",
    "floor": "floor(x)*(x - 0.5*(floor(x) + 1))",
    "heaviside": RAMP,
    "round": "round(x)*(x - 0.5*round(x))",
    "sign": "abs(x)",
}
"""Antiderivatives that vanish at 0, of functions with corners or jumps, for which quadrature is inaccurate."""
# x = n period + m; in the two periods next to 0 the second form would cancel
_M = "mod(x, period)"
_N = f"round((x - {_M})/period)"
MOD = f"where(abs({_N} + 0.5) < 1, x*(0.5*x - {_N}*period), 0.5*({_N}*period*period + {_M}*{_M}))"


def integral(node: Expression, name: str) -> Expression:
    """Return the integral of a formula with respect to one of its names, from 0 to the value of that name."""
    result = _by_rules(node, name)
    return _by_quadrature(node, name) if result is None else result


def has_rule(node: Expression, name: str) -> bool:
    """Tell whether the integral of a formula is exact, without quadrature."""
    return _by_rules(node, name) is not None


def _by_rules(node: Expression, name: str) -> Expression | None:
    """Return the integral by rules; None if no rule applies."""

    def is_free(part: Expression) -> bool:
        return name not in part.names

    if is_free(node):
        return Binary("*", node, Name(name))
    match node:
        case Name():
            return filled("0.5*x**2", x=node)
        case Negate(operand):
            inner = _by_rules(operand, name)
            return None if inner is None else Negate(inner)
        case Binary("+" | "-" as symbol, left, right):
            return _combined(symbol, _by_rules(left, name), _by_rules(right, name))
        case Binary("*", left, right) if is_free(left):
            return _combined("*", left, _by_rules(right, name))
        case Binary("*" | "/" as symbol, left, right) if is_free(right):
            return _combined(symbol, _by_rules(left, name), right)
        case Binary("*", left, right):
            return _switched(left, right, 1.0, name) or _switched(right, left, 1.0, name)
        case Binary("**", base, exponent) if (power := literal(exponent)) is not None:
            return _power(node, base, power, name)
        case Binary("**", base, exponent) if is_free(base) and not isinstance(base, Name):
            # e**x
            return _by_rules(filled("exp(log(base)*x)", base=base, x=exponent), name)
        case Compare("<" | "<=", left, right) if is_free(left) != is_free(right):
            return _linear_argument(RAMP, Binary("-", right, left), node, name)
        case Compare(">" | ">=", left, right) if is_free(left) != is_free(right):
            return _linear_argument(RAMP, Binary("-", left, right), node, name)
        case Call("where", (condition, yes, no)) if is_free(condition):
            first, second = _by_rules(yes, name), _by_rules(no, name)
            if first is None or second is None:
                return None
            return Call("where", (condition, first, second))
        case Call("where", (condition, yes, no)):
            first = _switched(yes, condition, 1.0, name)
            return _combined("+", first, _switched(no, condition, -1.0, name))
        case Call(function, arguments):
            return _function(node, function, arguments, name)
    return None


def _power(node: Expression, base: Expression, power: float, name: str) -> Expression | None:
    """Return the integral of a power of x, ``max(a x + b, 0)`` or ``a x + b``."""
    n = Number(power + 1.0)
    match base:
        case Name():
            return filled("x**n/n", x=base, n=n) if power > 0.0 else None
        case Call("max", (x, Number(0.0))):
            return _linear_argument("max(x, 0)**n/n", x, node, name, n=n) if power > 0.0 else None
    if power < 1.0 or not power.is_integer() or not _may_be_zero(base, name):
        return None
    return _linear_argument("x**n/n", base, node, name, n=n)


def _may_be_zero(x: Expression, name: str) -> bool:
    """Tell whether an argument may be 0 at the start of the integral: it is 0, or depends on other names.

    Functions of u - 1, say, are left to quadrature, which does not cancel.
    """
    start = put(x, name, ZERO)
    return bool(start.names) or values(start, {}) == 0.0


def _function(
    node: Expression, function: str, arguments: tuple[Expression, ...], name: str
) -> Expression | None:
    """Return the integral of a function of ``a x + b``."""
    x, *others = arguments
    if function in SMOOTH:
        return _linear_argument(SMOOTH[function], x, node, name) if _may_be_zero(x, name) else None
    if function in BROKEN:
        return _linear_argument(BROKEN[function], x, node, name)
    if len(others) != 1:
        return None
    (y,) = others
    are_free = [name not in argument.names for argument in arguments]
    if function == "mod" and are_free[1]:
        return _linear_argument(MOD, x, node, name, period=y)
    # with the name in only one of them, the slope of the difference cannot vanish by cancellation
    if function in ("max", "min") and are_free[0] != are_free[1]:
        # max(a, b) = b + max(a - b, 0), min(a, b) = a - max(a - b, 0)
        base, symbol = (y, "+") if function == "max" else (x, "-")
        difference = Binary("-", x, y)
        ramp = filled(RAMP, x=difference)
        above = _linear_argument("0.5*x*max(x, 0)", difference, ramp, name)
        return _combined(symbol, _by_rules(base, name), above)
    return None


def _combined(symbol: str, left: Expression | None, right: Expression | None) -> Expression | None:
    return None if left is None or right is None else Binary(symbol, left, right)


def _switched(node: Expression, condition: Expression, side: float, name: str) -> Expression | None:
    """Return the integral of a formula times the indicator of ``a x + b > 0`` (side 1) or of its negation (side -1).

    With the integral H of the formula and the switching point c it is ``H(max(x, c)) - H(max(0, c))`` above c, and the
    same with ``min`` below c.
    """
    match condition:
        case Compare("<" | "<=", left, right):
            difference = Binary("-", right, left)
        case Compare(">" | ">=", left, right):
            difference = Binary("-", left, right)
        case Call("heaviside", (argument,)):
            difference = Binary("-", argument, ZERO)
        case _:
            return None
    nested = sum(isinstance(inner, Compare | Call) for inner in walk(node))
    rate = slope_of(difference, name) or ZERO
    slope = math.nan if rate.names else float(values(rate, {}))
    antiderivative = _by_rules(node, name) if nested <= MAX_CONDITIONS else None
    if slope == 0.0 or not math.isfinite(slope) or antiderivative is None:
        return None
    switch = Binary("/", Negate(put(difference, name, ZERO)), number(slope))
    function = "max" if slope * side > 0.0 else "min"
    ends = (put(antiderivative, name, Call(function, (end, switch))) for end in (Name(name), ZERO))
    return Binary("-", *ends)


def _linear_argument(
    text: str, x: Expression, node: Expression, name: str, **more: Expression
) -> Expression | None:
    """Return the integral of `node`, a function of x with antiderivative `text`; None if x is not ``a name + b``."""
    antiderivative = filled(text, x=x, **more)
    slope = slope_of(x, name, with_start=False)
    if slope is None:
        slope = slope_of(x, name)
        antiderivative = Binary("-", antiderivative, filled(text, x=put(x, name, ZERO), **more))
    return _over_slope(antiderivative, slope, node, name)


def _over_slope(
    antiderivative: Expression, slope: Expression | None, node: Expression, name: str
) -> Expression | None:
    """Return an antiderivative by ``a x + b`` over the slope a; for slope 0, the constant `node` times x."""
    if slope is None:
        return None
    quotient, constant = Binary("/", antiderivative, slope), Binary("*", node, Name(name))
    if slope.names:
        return Call("where", (Compare("==", slope, ZERO), constant, quotient))
    return quotient if values(slope, {}) != 0.0 else constant


def _by_quadrature(node: Expression, name: str) -> Expression:
    """Return the Gauss-Legendre rule over x or, if complex poles may be near, over asinh(x)."""
    x: Expression = Name(name)
    variable = Call("asinh", (x,)) if _has_poles(node, name) else x
    terms: list[Expression] = []
    points, weights = np.polynomial.legendre.leggauss(QUADRATURE_POINTS)
    for point, weight in zip(
        (0.5 * (points + 1.0)).tolist(), (0.5 * weights).tolist(), strict=True
    ):
        y = Binary("*", Number(point), variable)
        force = put(node, name, y)
        if variable != x:
            force = Binary("*", put(node, name, Call("sinh", (y,))), Call("cosh", (y,)))
        terms.append(Binary("*", Number(weight), force))
    return Binary("*", variable, paired(terms, partial(Binary, "+")))


def _has_poles(node: Expression, name: str) -> bool:
    """Tell whether a formula may have complex singularities, as 1/(1 + x^2) at x = i."""

    def may_have(part: Expression) -> bool:
        match part:
            case Binary("/", _, below):
                return name in below.names
            case Binary("**", base, exponent):
                power = literal(exponent)
                is_entire = power is not None and power >= 0.0 and power.is_integer()
                return name in base.names and not is_entire
            case Call(function, _):
                return function in POLES and name in part.names
        return False

    return any(may_have(part) for part in walk(node))
