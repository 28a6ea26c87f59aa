r"""The step of a scheme on ``u'' + g w u' + w^2 u = 0``, applied to unit vectors: any scheme, any type of number.

Time is measured in steps, so that dt = 1 and the acceleration is ``-p^2 u - g p v`` with ``p = w dt``; velocities are
``v dt``. The functions of the scheme itself run on numbers with ``+ - * /``: double-double (`vibsim.theory.doubled`),
with bounds of rounding (`vibsim.theory.rounding`), series in p (`vibsim.theory.laurent`), or functions of p
(`vibsim.theory.symbolic`). Coefficients enter as formulas, not as rounded floats.
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
"""Largest denominator of the fractions that floats are converted to."""
Reader = Callable[[str], Any]
"""Function that converts the formula of a coefficient to a number."""
Substitutes = Mapping[Callable[..., Any], Callable[..., Any]]
"""Replacements of functions that a step calls."""

_DIGITS = 60
_ROOT = ELEMENTARY["sqrt"].full
"""The only elementary function that steps call; it contains no coefficients."""
_NONE: Substitutes = MappingProxyType({})


@dataclass(frozen=True)
class UnitSteps:
    """Images of unit vectors; lists of numbers, one list per vector."""

    step: Sequence[Sequence[Any]]
    """The next state of each unit state."""
    velocity: Sequence[Any]
    """The scheme's own velocity of each unit state, times dt."""
    start: Sequence[Sequence[Any]]
    """State at step 1 from ``u_0 = 1`` and from ``v_0 dt = 1``; empty if not requested."""
    backward: Sequence[Any] | None
    """The one-sided velocity of each unit state, times dt, if the scheme ends with it."""


@lru_cache(maxsize=256)
def _carried(stepper: Stepper) -> int:
    """Return the number of entries of a state."""
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
    """Return the images of unit vectors under a step and the start.

    `p` is ``w dt`` in the type of number to use, `zero` a zero of that type and shape, `square` is ``p^2`` if that
    differs from the product, and `damping` is g (None for no damping).
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
        exact = rebound(function, read, substitutes)
        return handed(exact, acceleration, slopes, lambda u, v, t, q: rate)

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
    """Return a function with its coefficients converted by `read`, also in all functions that it calls."""
    if function in substitutes:
        return substitutes[function]
    if not isinstance(function, FunctionType):
        return function
    formulas = exact_names(function)
    names = dict(function.__globals__)
    for name in function.__code__.co_names:
        if name in formulas:
            names[name] = read(formulas[name])
        elif isinstance(names.get(name), FunctionType):
            names[name] = rebound(names[name], read, substitutes)
    copy = FunctionType(
        function.__code__, names, function.__name__, function.__defaults__, function.__closure__
    )
    copy.__kwdefaults__ = function.__kwdefaults__
    return copy


def reads(stepper: Stepper) -> set[str]:
    """Return the formulas of all coefficients of a scheme."""
    formulas: set[str] = set()
    for function in (stepper.start, stepper.step, stepper.backward):
        rebound(function, lambda formula: formulas.add(formula), {_ROOT: _ROOT})
    return formulas


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
    """Return the number that a float was written as: a fraction with a small denominator, or its decimal.

    An option `1/12` reaches a step as a float. As a decimal it would leave 1e-18 where terms cancel.
    """
    small = Fraction(number).limit_denominator(LARGEST)
    return small if float(small) == number else Fraction(repr(number))


def exact(
    formula: str, number: Callable[[Fraction], Any], power: Callable[[Any, Fraction], Any]
) -> Any:
    """Return the value of a coefficient in numbers of any type; arguments and ValueError as for `value_of`."""
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
    """Return the value of a formula in numbers of any type.

    `number` converts a fraction (a decimal stands for itself, or for the fraction that it was rounded from, not for the
    nearest float), `power` raises a number to a constant power, `names` gives values of the names in the formula.
    Raises ValueError if the formula contains anything but ``+ - * / **``, ``sqrt`` and ``abs``.
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
