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

import numpy as np

from vibsim.core.errors import VibsimError
from vibsim.elementary import ELEMENTARY
from vibsim.formula import Binary, Call, Expression, Name, Negate, Number, parse
from vibsim.formula.tree import OPERATORS
from vibsim.schemes.base import Stepper, handed
from vibsim.schemes.code_generation import exact_names
from vibsim.schemes.newton import solved, solved_together
from vibsim.schemes.step_numbers import MOST_COMPARISONS, EndlessStepError, Plain, counting
from vibsim.theory.doubled import Doubled

SMALL = 0.1
"""A value of ``w dt`` at which every scheme that is accepted can make a step."""
_LONGER = 4
"""How many times as many comparisons two numbers of 32 digits may take to agree as two floats."""
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


class NoSeriesError(ValueError):
    """A step without series about ``w dt = 0``, or whose frequency tends to another one than w."""


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
    most: int = MOST_COMPARISONS,
) -> UnitSteps:
    """Return the images of unit vectors under a step and the start.

    `p` is ``w dt`` in the type of number to use, `zero` a zero of that type and shape, `square` is ``p^2`` if that
    differs from the product, and `damping` is g (None for no damping). `EndlessStepError` if one call of a function
    makes more than `most` comparisons.
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
        whole = handed(exact, acceleration, slopes, lambda u, v, t, q: rate)
        return counting(whole, most)

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
        one_sided = counting(rebound(stepper.backward, read), most)
        backward = [one_sided(unit, one) for unit in units]
    return UnitSteps(
        [following for following, _ in steps], [own for _, own in steps], starts, backward
    )


def where_it_ends(
    run: Callable[[Doubled, int], UnitSteps], stepper: Stepper, p: Doubled
) -> UnitSteps:
    """Return ``run(p, most)``, in arrays (`unit_steps`), NaN for each p where a loop of the step does not end.

    A number of arrays continues a loop while any entry does. So where it does not end, a float tells for each p alone
    whether the step can be used there.
    """
    try:
        return run(p, MOST_COMPARISONS)
    except EndlessStepError:
        usable = np.array([_ends(stepper, float(x)) for x in p.high.flat]).reshape(p.shape)
    near = Doubled(np.where(usable, p.high, SMALL), np.where(usable, p.low, 0.0))
    try:
        found = run(near, _LONGER * MOST_COMPARISONS)
    except EndlessStepError:
        name = stepper.step.__name__
        raise VibsimError(
            f"the theory of the step {name} cannot be computed: a loop of it does not end in numbers of 32 digits. End "
            "it when a correction is small, such as abs(change) > 1e-14"
        ) from None
    gap = np.where(usable, 0.0, np.nan)

    def marked(numbers: Sequence[Any]) -> list[Any]:
        return [number + gap for number in numbers]

    return UnitSteps(
        [marked(column) for column in found.step],
        marked(found.velocity),
        [marked(column) for column in found.start],
        None if found.backward is None else marked(found.backward),
    )


@lru_cache(maxsize=4096)
def _ends(stepper: Stepper, p: float) -> bool:
    """Tell whether no function of a scheme makes too many comparisons of floats at ``w dt = p``."""
    return not _compares(stepper, p, MOST_COMPARISONS)


def _compares(stepper: Stepper, p: float, most: int, substitutes: Substitutes = _NONE) -> bool:
    """Tell whether a function of a scheme makes more than so many comparisons of floats at ``w dt = p``."""

    def read(formula: str) -> Plain:
        return Plain(float(decimal(formula)))

    try:
        unit_steps(stepper, Plain(p), Plain(0.0), read, substitutes=substitutes, most=most)
    except EndlessStepError:
        return True
    return False


@lru_cache(maxsize=256)
def require_formula(stepper: Stepper) -> None:
    """Raise `NoSeriesError` if the step or the start of a scheme compares numbers or takes an absolute value.

    The equation of an implicit step does not count: on a linear problem it has a formula as its solution.
    """
    if _compares(stepper, SMALL, 0, LINEAR):
        raise NoSeriesError("the step compares numbers, so that it is not one formula")


def _solved(
    x: Any, u: Any, d_u: Any, v: Any, d_v: Any, t: Any, p: Any, acceleration: Any, slopes: Any
) -> Any:
    """Solve the equation of `vibsim.schemes.newton.solved` for a linear force."""
    by_u, by_v = slopes(u, v, t, p)
    return acceleration(u, v, t, p) / (1.0 - (d_u * by_u + d_v * by_v))


def _solved_together(
    x: Any, y: Any, u: Any, d_u: Any, v: Any, d_v: Any, t: Any, p: Any, acceleration: Any, slopes: Any
) -> Any:  # fmt: skip
    """Solve the equations of `vibsim.schemes.newton.solved_together` for a linear force."""
    one, two = (acceleration(u[i], v[i], t[i], p) for i in range(2))
    by_u, by_v = slopes(u[0], v[0], t[0], p)
    a, b, c, d = (by_u * i + by_v * j for i, j in zip(d_u, d_v, strict=True))
    bottom = (1.0 - a) * (1.0 - d) - b * c
    return (one * (1.0 - d) + b * two) / bottom, (two * (1.0 - a) + c * one) / bottom


LINEAR: Substitutes = MappingProxyType({solved: _solved, solved_together: _solved_together})
"""Solutions of the equations of implicit steps for a linear force."""


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
