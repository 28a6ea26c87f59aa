"""Integrals of formulas, as formulas: the potential energy of a spring.

The integral is taken from 0, in forms that do not cancel there: a small energy has all its digits. A sum is integrated
term by term; a term is a constant factor times a power of x, or a function of the table below of ``a x``. Anything else
is integrated by Gauss and Legendre's rule between 0 and x, written out as a formula: right to round-off for a function
that is smooth there, even if it has a corner at 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np

from vibsim.expression.parser import literal
from vibsim.expression.tree import (
    Binary,
    Call,
    Compare,
    Expression,
    Name,
    Negate,
    Number,
    names_in,
    rebuilt,
)

ONE, TWO, HALF = Number(1.0), Number(2.0), Number(0.5)
POINTS = 24
"""Points of the rule: polynomials up to degree 47 are integrated exactly."""
SMALL = 0.3
"""Below, log cosh is a series."""


def integral(node: Expression, name: str) -> Expression:
    """Return the integral of a formula over one of its names, from 0 to the value of that name."""
    found = _found(node, name)
    return _by_quadrature(node, name) if found is None else found


def has_rule(node: Expression, name: str) -> bool:
    """Tell whether the integral of a formula is exact, and not by quadrature."""
    return _found(node, name) is not None


def _found(node: Expression, name: str) -> Expression | None:
    """Return the integral by the rules; None where they give none."""
    if name not in names_in(node):
        return Binary("*", node, Name(name))
    match node:
        case Name():
            return Binary("*", HALF, Binary("**", node, TWO))
        case Negate(operand):
            inner = _found(operand, name)
            return None if inner is None else Negate(inner)
        case Binary("+" | "-" as symbol, left, right):
            first, second = _found(left, name), _found(right, name)
            return None if first is None or second is None else Binary(symbol, first, second)
        case Binary("*", left, right) if name not in names_in(left):
            inner = _found(right, name)
            return None if inner is None else Binary("*", left, inner)
        case Binary("*" | "/" as symbol, left, right) if name not in names_in(right):
            inner = _found(left, name)
            return None if inner is None else Binary(symbol, inner, right)
        case Binary("**", Name() as base, exponent):
            power = literal(exponent)
            if power is None or power <= 0.0:
                return None
            raised = Binary("**", base, Number(power + 1.0))
            return Binary("/", raised, Number(power + 1.0))
        case Call(function, (argument,)) if function in _OF_MULTIPLE:
            factor = _factor(argument, name)
            if factor is None:
                return None
            return Binary("/", _OF_MULTIPLE[function](argument), factor)
        case _:
            return None


def _factor(node: Expression, name: str) -> Expression | None:
    """Return the a of a formula ``a x``; None where it is another one."""
    match node:
        case Name(own) if own == name:
            return ONE
        case Negate(operand):
            inner = _factor(operand, name)
            return None if inner is None else Negate(inner)
        case Binary("*", left, right) if name not in names_in(left):
            inner = _factor(right, name)
            return None if inner is None else _times(left, inner)
        case Binary("*", left, right) if name not in names_in(right):
            inner = _factor(left, name)
            return None if inner is None else _times(right, inner)
        case Binary("/", left, right) if name not in names_in(right):
            inner = _factor(left, name)
            return None if inner is None else Binary("/", inner, right)
        case _:
            return None


def _times(left: Expression, right: Expression) -> Expression:
    return left if right == ONE else Binary("*", left, right)


def _of_halves(first: str, second: str) -> Callable[[Expression], Expression]:
    """Return a function that writes ``2 first(x/2) second(x/2)``."""

    def write(x: Expression) -> Expression:
        half = Binary("*", HALF, x)
        return Binary("*", TWO, Binary("*", Call(first, (half,)), Call(second, (half,))))

    return write


def _log_cosh(x: Expression) -> Expression:
    """Write ``log(cosh(x))`` so that it overflows nowhere and has all its digits near 0.

    It is ``|x| + log((1 + exp(-2 |x|))/2)``, and with ``z = y/(2 + y)``, ``y = sinh(x)**2``, also artanh(z).
    """
    size = Call("abs", (x,))
    decay = Call("exp", (Negate(Binary("*", TWO, size)),))
    beyond = Binary("+", size, Call("log", (Binary("*", HALF, Binary("+", ONE, decay)),)))
    y = Binary("**", Call("sinh", (x,)), TWO)
    z = Binary("/", y, Binary("+", TWO, y))
    square = Binary("**", z, TWO)
    series: Expression = Binary("/", ONE, Number(13.0))
    for k in (11.0, 9.0, 7.0, 5.0, 3.0, 1.0):
        series = Binary("+", Binary("/", ONE, Number(k)), Binary("*", square, series))
    return Call("where", (Compare("<", size, Number(SMALL)), Binary("*", z, series), beyond))


_OF_MULTIPLE: Mapping[str, Callable[[Expression], Expression]] = {
    "sin": _of_halves("sin", "sin"),
    "cos": lambda x: Call("sin", (x,)),
    "exp": _of_halves("exp", "sinh"),
    "sinh": _of_halves("sinh", "sinh"),
    "cosh": lambda x: Call("sinh", (x,)),
    "tanh": _log_cosh,
    "abs": lambda x: Binary("*", HALF, Binary("*", x, Call("abs", (x,)))),
    "sign": lambda x: Call("abs", (x,)),
}
"""Integral of a function of one argument ``a x`` from 0, times a."""


@cache
def _rule() -> tuple[tuple[float, float], ...]:
    """Return places between 0 and 1 and their weights."""
    x, weights = np.polynomial.legendre.leggauss(POINTS)
    return tuple(zip((0.5 * (x + 1.0)).tolist(), (0.5 * weights).tolist(), strict=True))


def _by_quadrature(node: Expression, name: str) -> Expression:
    def at(place: float) -> Expression:
        here = Binary("*", Number(place), Name(name))
        return rebuilt(node, lambda part: here if part == Name(name) else part)

    terms = [Binary("*", Number(weight), at(place)) for place, weight in _rule()]
    while len(terms) > 1:
        # in pairs, so that the tree stays flat
        ends = zip(terms[::2], terms[1::2], strict=False)
        odd = terms[len(terms) - len(terms) % 2 :]
        terms = [Binary("+", left, right) for left, right in ends] + odd
    return Binary("*", Name(name), terms[0])
