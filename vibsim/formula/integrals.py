"""Integrals of formulas, as formulas: the potential energy of a spring.

The integral is taken from 0, in forms that do not cancel there: a small energy has all its digits. A sum is integrated
term by term; a term is a constant factor times a power of x, or a function of the table `SMOOTH` of ``a x``. What has a
corner or jumps is integrated for ``a x + b`` too, though the difference ``F(a x + b) - F(b)`` may cost a small energy
some digits; what holds on one side of a place alone is integrated up to that place or from there. Anything else is
integrated by Gauss and Legendre's rule between 0 and x, written out as a formula: right to round-off for a function
that is smooth there, even if it has a corner at 0. Where a function has poles beside the real axis, as
``x/sqrt(1 + x^2)`` at i, the rule is one over asinh(x): the way from 0 to 128 is then 5.5 long, and i still 1.6 away.
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
"""Points of the rule: polynomials up to degree 47 are integrated exactly."""
POLES = frozenset(
    ("sqrt", "hypot", "log", "log1p", "log2", "log10", "atan", "asinh", "tanh", "tan", "atan2")
)
"""Functions that are singular beside the real axis."""
MAX_CONDITIONS = 4
"""Most conditions inside one that decides of a part: each of them doubles the text of the integral."""

# log(cosh(x)) overflows nowhere and has all its digits near 0: it is artanh(z) with z = y/(2 + y), y = sinh(x)**2
_Z = "(sinh(x)**2/(2 + sinh(x)**2))"
_ARTANH = reduce(lambda inner, k: f"1/{k} + {_Z}**2*({inner})", range(11, 0, -2), "1/13")
_LOG_COSH_FAR = "abs(x) + log(0.5*(1 + exp(-(2*abs(x)))))"
# e^x - 1 - x as a series, and what lies between erf and x erf
_BEYOND_LINEAR = reduce(lambda inner, k: f"1 + x/{k}*({inner})", range(14, 2, -1), "1")
_BELOW_ONE = f"-({1.0 / math.sqrt(math.pi)!r}*expm1(-x**2))"

SMOOTH = {
    "sin": "2*(sin(0.5*x)*sin(0.5*x))",
    "cos": "sin(x)",
    "exp": "2*(exp(0.5*x)*sinh(0.5*x))",
    "expm1": f"where(abs(x) < 0.3, 0.5*x*x*({_BEYOND_LINEAR}), expm1(x) - x)",
    "sinh": "2*(sinh(0.5*x)*sinh(0.5*x))",
    "cosh": "sinh(x)",
    "tanh": f"where(abs(x) < 0.3, {_Z}*({_ARTANH}), {_LOG_COSH_FAR})",
    # x asinh(x) + 1 - sqrt(1 + x^2)
    "asinh": "x*(asinh(x) - x/(1 + hypot(1, x)))",
    # the second part is at most half of the first
    "atan": "x*atan(x) - 0.5*log1p(x**2)",
    # 1 - x^2 has its digits near 0 in one form, near 1 in another
    "atanh": "x*atanh(x) + 0.5*where(abs(x) < 0.5, log1p(-x**2), log((1 - x)*(1 + x)))",
    "cbrt": "0.75*x*cbrt(x)",
    "erf": f"x*erf(x) - {_BELOW_ONE}",
    "erfc": f"x*erfc(x) + {_BELOW_ONE}",
}
"""Antiderivatives that vanish at 0, of functions that are smooth or have their corner at 0."""
RAMP = "max(x, 0)"
BROKEN = {
    "abs": "0.5*(x*abs(x))",
    "ceil": "ceil(x)*(x - 0.5*(ceil(x) - 1))",
    "floor": "floor(x)*(x - 0.5*(floor(x) + 1))",
    "heaviside": RAMP,
    "round": "round(x)*(x - 0.5*round(x))",
    "sign": "abs(x)",
}
"""Of functions with a corner or jumps, which a rule of points does not integrate."""
# with x = n period + m; in the periods beside 0 the second form would cancel
_M = "mod(x, period)"
_N = f"round((x - {_M})/period)"
MOD = f"where(abs({_N} + 0.5) < 1, x*(0.5*x - {_N}*period), 0.5*({_N}*period*period + {_M}*{_M}))"


def integral(node: Expression, name: str) -> Expression:
    """Return the integral of a formula over one of its names, from 0 to the value of that name."""
    found = _found(node, name)
    return _by_quadrature(node, name) if found is None else found


def has_rule(node: Expression, name: str) -> bool:
    """Tell whether the integral of a formula is exact, and not by quadrature."""
    return _found(node, name) is not None


def _found(node: Expression, name: str) -> Expression | None:
    """Return the integral by the rules; None where they give none."""

    def is_free(part: Expression) -> bool:
        return name not in part.names

    if is_free(node):
        return Binary("*", node, Name(name))
    match node:
        case Name():
            return filled("0.5*x**2", x=node)
        case Negate(operand):
            inner = _found(operand, name)
            return None if inner is None else Negate(inner)
        case Binary("+" | "-" as symbol, left, right):
            return _joined(symbol, _found(left, name), _found(right, name))
        case Binary("*", left, right) if is_free(left):
            return _joined("*", left, _found(right, name))
        case Binary("*" | "/" as symbol, left, right) if is_free(right):
            return _joined(symbol, _found(left, name), right)
        case Binary("*", left, right):
            return _of_part(left, right, 1.0, name) or _of_part(right, left, 1.0, name)
        case Binary("**", base, exponent) if (power := literal(exponent)) is not None:
            return _of_power(node, base, power, name)
        case Binary("**", base, exponent) if is_free(base) and not isinstance(base, Name):
            # e**x
            return _found(filled("exp(log(base)*x)", base=base, x=exponent), name)
        case Compare("<" | "<=", left, right) if is_free(left) != is_free(right):
            return _of_linear(RAMP, Binary("-", right, left), node, name)
        case Compare(">" | ">=", left, right) if is_free(left) != is_free(right):
            return _of_linear(RAMP, Binary("-", left, right), node, name)
        case Call("where", (condition, yes, no)) if is_free(condition):
            first, second = _found(yes, name), _found(no, name)
            if first is None or second is None:
                return None
            return Call("where", (condition, first, second))
        case Call("where", (condition, yes, no)):
            first = _of_part(yes, condition, 1.0, name)
            return _joined("+", first, _of_part(no, condition, -1.0, name))
        case Call(function, arguments):
            return _of_function(node, function, arguments, name)
    return None


def _of_power(node: Expression, base: Expression, power: float, name: str) -> Expression | None:
    """Return the integral of a power of x, of ``max(a x + b, 0)``, or of ``a x + b``."""
    n = Number(power + 1.0)
    match base:
        case Name():
            return filled("x**n/n", x=base, n=n) if power > 0.0 else None
        case Call("max", (x, Number(0.0))):
            return _of_linear("max(x, 0)**n/n", x, node, name, n=n) if power > 0.0 else None
    if power < 1.0 or not power.is_integer() or not _may_begin(base, name):
        return None
    return _of_linear("x**n/n", base, node, name, n=n)


def _may_begin(x: Expression, name: str) -> bool:
    """Tell whether an argument is 0 where the integral begins, or is one of a spring between two coordinates.

    Functions of u - 1 are left to points, whose sum does not cancel.
    """
    start = put(x, name, ZERO)
    return bool(start.names) or values(start, {}) == 0.0


def _of_function(
    node: Expression, function: str, arguments: tuple[Expression, ...], name: str
) -> Expression | None:
    """Return the integral of a function of ``a x + b``."""
    x, *others = arguments
    if function in SMOOTH:
        return _of_linear(SMOOTH[function], x, node, name) if _may_begin(x, name) else None
    if function in BROKEN:
        return _of_linear(BROKEN[function], x, node, name)
    if len(others) != 1:
        return None
    (y,) = others
    are_free = [name not in argument.names for argument in arguments]
    if function == "mod" and are_free[1]:
        return _of_linear(MOD, x, node, name, period=y)
    # with the name in one of them alone, the slopes of their difference cannot cancel
    if function in ("max", "min") and are_free[0] != are_free[1]:
        # max(a, b) = b + max(a - b, 0), min(a, b) = a - max(a - b, 0)
        base, symbol = (y, "+") if function == "max" else (x, "-")
        difference = Binary("-", x, y)
        ramp = filled(RAMP, x=difference)
        above = _of_linear("0.5*x*max(x, 0)", difference, ramp, name)
        return _joined(symbol, _found(base, name), above)
    return None


def _joined(symbol: str, left: Expression | None, right: Expression | None) -> Expression | None:
    return None if left is None or right is None else Binary(symbol, left, right)


def _of_part(node: Expression, condition: Expression, side: float, name: str) -> Expression | None:
    """Return the integral of a formula where a condition ``a x + b > 0`` holds (side 1), or where it does not (-1).

    On one side of the place c, where H is the integral of the formula, it is ``H(max(x, c)) - H(max(0, c))``, on the
    other the same with ``min``.
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
    inside = sum(isinstance(part, Compare | Call) for part in walk(node))
    rate = slope_of(difference, name) or ZERO
    slope = math.nan if rate.names else float(values(rate, {}))
    whole = _found(node, name) if inside <= MAX_CONDITIONS else None
    if slope == 0.0 or not math.isfinite(slope) or whole is None:
        return None
    place = Binary("/", Negate(put(difference, name, ZERO)), number(slope))
    function = "max" if slope * side > 0.0 else "min"
    ends = (put(whole, name, Call(function, (end, place))) for end in (Name(name), ZERO))
    return Binary("-", *ends)


def _of_linear(
    text: str, x: Expression, node: Expression, name: str, **more: Expression
) -> Expression | None:
    """Return the integral of a function `node` of ``a x + b``, from an antiderivative; None for other arguments."""
    found = filled(text, x=x, **more)
    slope = slope_of(x, name, with_start=False)
    if slope is None:
        slope = slope_of(x, name)
        found = Binary("-", found, filled(text, x=put(x, name, ZERO), **more))
    return _over_slope(found, slope, node, name)


def _over_slope(
    found: Expression, slope: Expression | None, node: Expression, name: str
) -> Expression | None:
    """Return an antiderivative by ``a x + b`` over the slope a; where that is 0, `node` is a constant."""
    if slope is None:
        return None
    quotient, constant = Binary("/", found, slope), Binary("*", node, Name(name))
    if slope.names:
        return Call("where", (Compare("==", slope, ZERO), constant, quotient))
    return quotient if values(slope, {}) != 0.0 else constant


def _by_quadrature(node: Expression, name: str) -> Expression:
    """Write Gauss and Legendre's rule, over x itself or, where poles are near, over asinh(x)."""
    x: Expression = Name(name)
    way = Call("asinh", (x,)) if _has_poles(node, name) else x
    terms: list[Expression] = []
    places, weights = np.polynomial.legendre.leggauss(QUADRATURE_POINTS)
    for place, weight in zip(
        (0.5 * (places + 1.0)).tolist(), (0.5 * weights).tolist(), strict=True
    ):
        y = Binary("*", Number(place), way)
        force = put(node, name, y)
        if way != x:
            force = Binary("*", put(node, name, Call("sinh", (y,))), Call("cosh", (y,)))
        terms.append(Binary("*", Number(weight), force))
    return Binary("*", way, paired(terms, partial(Binary, "+")))


def _has_poles(node: Expression, name: str) -> bool:
    """Tell whether a formula may be singular beside the real axis, as 1/(1 + x^2) is at x = i."""

    def may(part: Expression) -> bool:
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

    return any(may(part) for part in walk(node))
