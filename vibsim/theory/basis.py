r"""The step of a scheme on ``u'' + g w u' + w^2 u = 0``, applied to unit vectors: any scheme, any kind of number.

Time is counted in steps, so that dt = 1 and the acceleration is ``-p^2 u - g p v`` with ``p = w dt``; velocities are
``v dt``. The functions of the scheme itself run, on numbers that have ``+ - * /``: twice the precision
(`vibsim.theory.doubled`), bounds of rounding (`vibsim.theory.rounding`), series in p (`vibsim.theory.laurent`), or
functions of p (`vibsim.theory.symbolic`). Coefficients that are formulas enter as formulas, not as the floats they were
rounded to.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import lru_cache
from types import FunctionType, MappingProxyType
from typing import Any

from vibsim.elementary import ELEMENTARY
from vibsim.formula import Binary, Call, Expression, Name, Negate, Number, parse
from vibsim.formula.tree import OPERATORS
from vibsim.schemes.base import Stepper, handed
from vibsim.schemes.code_generation import exact_names

LARGEST = 1000
"""The largest denominator of a fraction that a float is taken for."""
Reader = Callable[[str], Any]
"""Makes a number of the formula of a coefficient."""
Substitutes = Mapping[Callable[..., Any], Callable[..., Any]]
"""What runs in place of functions that a step calls."""

_DIGITS = 60
_ROOT = ELEMENTARY["sqrt"].full
"""The one elementary function that steps call; no coefficients are in it."""
_NONE: Substitutes = MappingProxyType({})


@dataclass(frozen=True)
class UnitSteps:
    """What became of unit vectors; lists of numbers, one list per vector."""

    step: Sequence[Sequence[Any]]
    """The next state of each unit state."""
    velocity: Sequence[Any]
    """The scheme's own velocity of each unit state, times dt."""
    start: Sequence[Sequence[Any]]
    """State 1 from ``u_0 = 1`` and from ``v_0 dt = 1``; empty where it was not wanted."""
    backward: Sequence[Any] | None
    """The one-sided velocity of each unit state, times dt, of a scheme that ends with it."""


@lru_cache(maxsize=256)
def _carried(stepper: Stepper) -> int:
    """Return how many numbers make a state."""
    start = handed(stepper.start, lambda u, v, t, q: 0.0, lambda u, v, t, q: (0.0, 0.0))
    return len(start(stepper.variant, 0.0, 0.0, 1.0, ()))


def unit_steps(
    stepper: Stepper,
    p: Any,
    zero: Any,
    read: Reader,
    *,
    square: Any = None,
    damping: Any = None,
    substitutes: Substitutes = _NONE,
    with_start: bool = True,
) -> UnitSteps:
    """Return what a step and the start make of unit vectors.

    p, ``w dt``, is of the kind of number that is wanted, `zero` nothing of that kind and shape, `square` ``p^2`` where
    it is more than the product, `damping` g, None for none.
    """
    one = zero + 1.0
    force, push = stepper.scaling(p) if stepper.scaling else (one, one)
    stiffness = (p * p if square is None else square) * force
    rate = 0.0 if damping is None else damping * p

    def acceleration(u: Any, v: Any, t: Any, q: Any) -> Any:
        return -(stiffness * u) if damping is None else -(stiffness * u + rate * force * v)

    def slopes(u: Any, v: Any, t: Any, q: Any) -> tuple[Any, Any]:
        return -stiffness, zero

    def bound(function: Callable[..., Any]) -> Callable[..., Any]:
        own = rebound(function, read, substitutes)
        return handed(own, acceleration, slopes, lambda u, v, t, q: rate)

    size = range(_carried(stepper))
    units = [tuple(one if i == j else zero for i in size) for j in size]
    step = bound(stepper.step)
    steps = [step(unit, zero, one, ()) for unit in units]
    starts: list[Sequence[Any]] = []
    if with_start:
        start = bound(stepper.start)
        starts = [start(stepper.variant, u, v, one, ()) for u, v in ((one, zero), (zero, push))]
    backward = None
    if stepper.end == "backward":
        one_sided = rebound(stepper.backward, read)
        backward = [one_sided(unit, one) for unit in units]
    return UnitSteps(
        [following for following, _ in steps], [own for _, own in steps], starts, backward
    )


def rebound(
    function: Callable[..., Any], read: Reader, substitutes: Substitutes = _NONE
) -> Callable[..., Any]:
    """Return a function whose named coefficients are numbers made by `read`, in all that it calls as well."""
    if function in substitutes:
        return substitutes[function]
    if not isinstance(function, FunctionType):
        return function
    formulas = exact_names(function)
    known = dict(function.__globals__)
    for name in function.__code__.co_names:
        if name in formulas:
            known[name] = read(formulas[name])
        elif isinstance(known.get(name), FunctionType):
            known[name] = rebound(known[name], read, substitutes)
    copy = FunctionType(
        function.__code__, known, function.__name__, function.__defaults__, function.__closure__
    )
    copy.__kwdefaults__ = function.__kwdefaults__
    return copy


def reads(stepper: Stepper) -> set[str]:
    """Return the formulas of all coefficients of a scheme."""
    found: set[str] = set()
    for function in (stepper.start, stepper.step, stepper.backward):
        rebound(function, lambda formula: found.add(formula), {_ROOT: _ROOT})
    return found


@lru_cache(maxsize=1024)
def decimal(formula: str) -> Decimal:
    """Return the value of a formula to 60 digits."""

    def quotient(value: Fraction) -> Decimal:
        return Decimal(value.numerator) / Decimal(value.denominator)

    with localcontext() as context:
        context.prec = _DIGITS
        value: Decimal = exact(formula, quotient, lambda x, y: x ** quotient(y))
        return +value


def fraction_of(number: float) -> Fraction:
    """Return the number that a float was written as: the fraction of small numbers that it is, or else its decimal.

    An option `1/12` reaches a step as a float. As a decimal it would leave a rest of 1e-18 where terms cancel.
    """
    small = Fraction(number).limit_denominator(LARGEST)
    return small if float(small) == number else Fraction(repr(number))


def exact(
    formula: str, number: Callable[[Fraction], Any], power: Callable[[Any, Fraction], Any]
) -> Any:
    """Return the value of a coefficient in numbers of any kind, as `value_of`; ValueError where it has more in it."""
    try:
        return value_of(parse(formula, ()), number, power, {})
    except ValueError:
        raise ValueError(
            f"coefficient {formula} is not algebraic, so theory cannot be exact"
        ) from None


def value_of(
    node: Expression,
    number: Callable[[Fraction], Any],
    power: Callable[[Any, Fraction], Any],
    names: Mapping[str, Any],
) -> Any:
    """Return the value of a formula in numbers of any kind.

    `number` makes such a number of a fraction (a decimal of the formula stands for itself, or for the fraction that it
    was rounded from, not for the nearest float), `power` raises one to a power, which is a constant of the formula,
    `names` are numbers for the names of the formula. ValueError where it has more in it than ``+ - * / **``, ``sqrt``
    and ``abs``.
    """

    def value(node: Expression) -> Any:
        match node:
            case Number(constant):
                return number(fraction_of(float(constant)))
            case Name(name) if name in names:
                return names[name]
            case Negate(operand):
                return -value(operand)
            case Binary("**", base, exponent):
                return power(value(base), value_of(exponent, Fraction, operator.pow, {}))
            case Binary(sign, left, right) if sign in OPERATORS:
                return OPERATORS[sign](value(left), value(right))
            case Call("sqrt", (operand,)):
                return power(value(operand), Fraction(1, 2))
            case Call("abs", (operand,)):
                return abs(value(operand))
        raise ValueError("a formula with more than + - * /, powers, roots and abs")

    return value(node)
