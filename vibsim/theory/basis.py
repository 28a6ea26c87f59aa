r"""The step of a scheme on ``u'' + w^2 u = 0``, applied to unit vectors: any scheme, any kind of number.

Time is counted in steps, so that dt = 1 and the acceleration is ``-p^2 u`` with ``p = w dt``; velocities are ``v dt``.
The functions of the scheme itself run, on numbers that have ``+ - * /``, ``abs`` and comparisons: twice the precision
(`vibsim.theory.doubled`), bounds of rounding (`vibsim.theory.rounding`), or functions of p
(`vibsim.theory.symbolic`). Coefficients that are formulas enter as formulas, not as the floats they were rounded to.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import lru_cache
from types import FunctionType, MappingProxyType
from typing import Any

from vibsim.elementary import ELEMENTARY
from vibsim.formula import Binary, Call, Expression, Name, Negate, Number, parse
from vibsim.schemes.base import Stepper, handed
from vibsim.schemes.code_generation import exact_names

Reader = Callable[[str], Any]
"""Makes a number of the formula of a coefficient."""

_DIGITS = 60
_ROOT = ELEMENTARY["sqrt"].full
"""The one elementary function that steps call; no coefficients are in it."""


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
def carried(stepper: Stepper) -> int:
    """Return how many numbers make a state."""
    start = handed(stepper.start, lambda u, v, t, q: 0.0, lambda u, v, t, q: (0.0, 0.0))
    return len(start(stepper.variant, 0.0, 0.0, 1.0, ()))


def unit_steps(
    stepper: Stepper,
    p: Any,
    zero: Any,
    read: Reader,
    square: Any = None,
    *,
    with_start: bool = True,
) -> UnitSteps:
    """Return what a step and the start make of unit vectors.

    Parameters
    ----------
    p
        ``w dt``, in the kind of number that is wanted.
    zero
        Nothing, of that kind and shape.
    read
        Makes such a number of a formula.
    square
        ``p^2``, where it is more than the product.
    with_start
        Whether the start is wanted too.
    """
    one = zero + 1.0
    force, push = stepper.scaling(p) if stepper.scaling else (one, one)
    stiffness = (p * p if square is None else square) * force

    def acceleration(u: Any, v: Any, t: Any, q: Any) -> Any:
        return -(stiffness * u)

    def slopes(u: Any, v: Any, t: Any, q: Any) -> tuple[Any, Any]:
        return -stiffness, zero

    def bound(function: Callable[..., Any]) -> Callable[..., Any]:
        return handed(rebound(function, read), acceleration, slopes)

    size = range(carried(stepper))
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
    function: Callable[..., Any],
    read: Reader,
    others: Mapping[Callable[..., Any], Callable[..., Any]] = MappingProxyType({}),
) -> Callable[..., Any]:
    """Return a function whose named coefficients are numbers made by `read`, in all that it calls as well.

    Parameters
    ----------
    others
        What takes the place of functions that it calls.
    """
    if function in others:
        return others[function]
    if not isinstance(function, FunctionType):
        return function
    formulas = exact_names(function)
    known = dict(function.__globals__)
    for name in function.__code__.co_names:
        if name in formulas:
            known[name] = read(formulas[name])
        elif isinstance(known.get(name), FunctionType):
            known[name] = rebound(known[name], read, others)
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
    with localcontext() as context:
        context.prec = _DIGITS
        value: Decimal = exact(formula, _quotient, lambda x, y: x**y)
        return +value


def _quotient(value: Fraction) -> Decimal:
    return Decimal(value.numerator) / Decimal(value.denominator)


def exact(formula: str, number: Callable[[Fraction], Any], power: Callable[[Any, Any], Any]) -> Any:
    """Return the value of a formula in numbers of any kind.

    Parameters
    ----------
    number
        Makes such a number of a fraction. A decimal of the formula stands for itself, not for the nearest float.
    power
        Raises one to another.

    Raises
    ------
    ValueError
        Where the formula has more in it than ``+ - * / **`` and ``sqrt``.
    """

    def value(node: Expression) -> Any:
        match node:
            case Number(number_value):
                return number(Fraction(repr(float(number_value))))
            case Negate(operand):
                return -value(operand)
            case Binary("+", left, right):
                return value(left) + value(right)
            case Binary("-", left, right):
                return value(left) - value(right)
            case Binary("*", left, right):
                return value(left) * value(right)
            case Binary("/", left, right):
                return value(left) / value(right)
            case Binary("**", left, right):
                return power(value(left), value(right))
            case Call("sqrt", (operand,)):
                return power(value(operand), number(Fraction(1, 2)))
            case Call() | Name():
                raise ValueError(
                    f"coefficient {formula} is not algebraic, so theory cannot be exact"
                )
        raise ValueError(f"coefficient {formula} is no formula of numbers")

    return value(parse(formula, ()))
