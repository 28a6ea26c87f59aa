r"""The principal mode of a scheme on ``u'' + g u' + u = 0``, and how the start excites it, as series in the step h.

Time is counted in units of ``1/w``, so that ``h = w dt`` and ``g = c/w`` for a damping rate c. The functions of the
scheme itself run on series with exact coefficients (`vibsim.theory.laurent`). Of the eigenvalues of its step two tend
to ``exp(lambda h)``, ``lambda = -g/2 +- i w_d``; they are the roots of ``x^2 - T x + D``. The part of the start that
lies in their plane, the principal part y, is all that is left of a solution once parasitic parts have died out:

    y(t) = Re(B~ exp(lambda~ t)),      lambda~ = s~ +- i w~,   D = exp(2 s~ h),   T = 2 exp(s~ h) cos(w~ h)

Source: vibration text (B), sections 4.1-4.2 and 5.6, where the same is done by hand for two schemes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import Any

from vibsim.schemes.base import Stepper, handed
from vibsim.theory import series
from vibsim.theory.basis import carried, rebound
from vibsim.theory.division import by_quadratic
from vibsim.theory.exact import coefficients
from vibsim.theory.laurent import Field, Laurent
from vibsim.theory.polynomial import SUBSTITUTES
from vibsim.theory.series import Series

KNOWN = 14
"""Power of h from which on nothing is known; what is formed of differences of states loses some of them."""

Matrix = list[list[Laurent]]
Vector = list[Laurent]


@dataclass(frozen=True, eq=False)
class Mode:
    """Series in h, lists of exact numbers from the power 0 on, all of one length."""

    field: Field
    rate: Series
    """``s~``, the rate of growth."""
    frequency: Series
    """``w~/w_d``."""
    position: tuple[Series, Series]
    """``y(0)`` where the position is 1 at the start, and where the velocity is (in units of w)."""
    slope: tuple[Series, Series]
    """``y'(0) - s~ y(0)`` of both."""


@lru_cache(maxsize=1024)
def principal_mode(stepper: Stepper, damping: float) -> Mode:
    """Return the principal mode of a scheme.

    Parameters
    ----------
    stepper
        The arithmetic of the scheme on a model with or without linear damping (`Scheme.stepper_for`).
    damping
        ``g = c/w``, the damping rate over the frequency; below 2, so that the motion oscillates.
    """
    domain, elements = coefficients(stepper)

    def number(fraction: Fraction) -> Any:
        return domain.convert(fraction.numerator) / domain.convert(fraction.denominator)

    field = Field(number, lambda x: float(domain.to_sympy(x)), KNOWN)
    matrix, starts = _linear(stepper, field, elements.__getitem__, field.constant(damping))
    polynomial = characteristic(matrix)
    length = min(coefficient.end for coefficient in polynomial)
    trace, determinant = series.principal([_listed(row, length) for row in polynomial])
    pairs = [_first_two(matrix, start, polynomial, trace, determinant) for start in starts]
    return _mode(field, damping, trace, determinant, pairs)


def _linear(
    stepper: Stepper, field: Field, read: Callable[[str], Any], damping: Laurent
) -> tuple[Matrix, list[Vector]]:
    """Return the matrix of a step, and state 1 from the position 1 and from the velocity 1 at the start."""
    zero, one = field.constant(0.0), field.constant(1.0)
    h = field.series(field.number(Fraction(1)), 1)
    force, push = stepper.scaling(h) if stepper.scaling else (one, one)  # type: ignore[arg-type]

    def acceleration(u: Any, v: Any, t: Any, p: Any) -> Any:
        return -((u + damping * v) * force)

    def slopes(u: Any, v: Any, t: Any, p: Any) -> Any:
        raise ValueError("what solves the equation of a step by series asks for no slopes")

    def rate(u: Any, v: Any, t: Any, p: Any) -> Any:
        return damping

    def ready(function: Callable[..., Any]) -> Callable[..., Any]:
        own = rebound(function, lambda formula: field.series(read(formula)), SUBSTITUTES)
        return handed(own, acceleration, slopes, rate)

    def exact(state: Sequence[Any]) -> Vector:
        return [x if isinstance(x, Laurent) else field.constant(x) for x in state]

    step, start = ready(stepper.step), ready(stepper.start)
    size = range(carried(stepper))
    units = (tuple(one if i == j else zero for i in size) for j in size)
    columns = [exact(step(unit, zero, h, ())[0]) for unit in units]
    pairs = ((one, zero), (zero, one * push))
    starts = [exact(start(stepper.variant, u, v, h, ())) for u, v in pairs]
    return [list(row) for row in zip(*columns, strict=True)], starts


def characteristic(matrix: Matrix) -> list[Laurent]:
    """Return the coefficients of the characteristic polynomial, the highest power first, by Leverrier's method.

    Roots that are 0 for every h are left out.
    """
    size = range(len(matrix))
    field = matrix[0][0].field
    found, product = [field.constant(1.0)], matrix
    for k in range(1, len(matrix) + 1):
        trace = field.constant(0.0)
        for i in size:
            trace = trace + product[i][i]
        found.append(-trace / float(k))
        shifted = [[x + found[-1] if i == j else x for j, x in enumerate(row)]
                   for i, row in enumerate(product)]  # fmt: skip
        columns = list(zip(*shifted, strict=True))
        product = [[_dot(row, column) for column in columns] for row in matrix]
    while len(found) > 3 and found[-1].leading is None:
        found.pop()
    return found


def _dot(row: Sequence[Laurent], column: Sequence[Laurent]) -> Laurent:
    total = row[0].field.constant(0.0)
    for a, b in zip(row, column, strict=True):
        if a.leading is not None and b.leading is not None:
            total = total + a * b
    return total


def _listed(number: Laurent, length: int) -> Series:
    """Return the coefficients from the power 0 on."""
    return [number.at(k) for k in range(length)]


def _first_two(
    matrix: Matrix, start: Vector, polynomial: list[Laurent], trace: Series, determinant: Series
) -> tuple[Series, Series]:
    """Return ``y_0`` and ``y_1``, the positions of the principal part of a solution at the first two steps.

    With the characteristic polynomial ``(x^2 - T x + D) q(x)``, q of the matrix takes a state into the plane of the
    principal roots, and a first-degree polynomial, the inverse of q modulo the quadratic, takes it to its place there.
    """
    field = matrix[0][0].field
    t, d = (Laurent(field, 0, row) for row in (trace, determinant))
    rest = by_quadratic(polynomial, t, d)[:-2]
    state = [x * rest[0] for x in start]
    for coefficient in rest[1:]:
        state = [_dot(row, state) + coefficient * x for row, x in zip(matrix, start, strict=True)]
    *_, by_x, left = by_quadratic([field.constant(0.0), *rest], t, d)
    beside = left - t * by_x
    turned = by_x * t + beside
    bottom = beside * turned + by_x * by_x * d
    images = [state]
    for _ in range(2):
        images.append([_dot(row, images[-1]) for row in matrix])
    one, two = ((turned * a[0] - by_x * b[0]) / bottom for a, b in pairwise(images))
    nought = (t * one - two) / d
    length = min(len(trace), one.end, nought.end)
    return _listed(nought, length), _listed(one, length)


def _mode(
    field: Field,
    damping: float,
    trace: Series,
    determinant: Series,
    pairs: Sequence[tuple[Series, Series]],
) -> Mode:
    """Return the mode from the quadratic with the principal roots and from ``y_0`` and ``y_1`` of both starts."""
    length = min(len(trace), *(len(row) for pair in pairs for row in pair))
    trace, determinant = trace[:length], determinant[:length]
    half = field.number(Fraction(1, 2))
    decay = series.power(determinant, -half)
    cosine = series.times([x * half for x in trace], decay)
    square = series.square_of_angle(cosine)
    sinc = _sinc(field, square)
    known = length - 2
    g = field.number(Fraction(repr(float(damping))))
    right = field.number(Fraction(1)) - g * g * field.number(Fraction(1, 4))
    slopes = []
    for nought, one in pairs:
        ahead = series.times(one[:length], decay)
        behind = series.times(nought[:length], cosine)
        turned = [a - b for a, b in zip(ahead, behind, strict=True)]
        slopes.append(series.over(turned, sinc)[1 : known + 1])
    positions = [nought[:known] for nought, _ in pairs]
    return Mode(
        field,
        [x * half for x in series.logarithm(determinant)[1 : known + 1]],
        series.power([x / right for x in square[2 : known + 2]], half),
        (positions[0], positions[1]),
        (slopes[0], slopes[1]),
    )


def _sinc(field: Field, square: Series) -> Series:
    """Return ``sin(x)/x`` of the x with a square that begins with h^2."""
    nothing = [field.zero] * len(square)
    power: Series = [field.number(Fraction(1)), *nothing[1:]]
    total = power
    for k in range(1, len(square) // 2 + 1):
        power = series.times(power, square)
        factor = field.number(Fraction((-1) ** k, math.factorial(2 * k + 1)))
        total = [a + b * factor for a, b in zip(total, power, strict=True)]
    return total
