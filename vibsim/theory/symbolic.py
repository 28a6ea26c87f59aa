r"""The theory of a scheme as formulas in ``p = w dt``: matrix, series, error at a time, discrete solution.

Exact for every scheme whose step is polynomial or rational on a linear problem, as all are. SymPy is imported on first
use; results are its expressions in the symbols p, n, I, V, w and t.

Source: vibration text (B), equations (18)-(20), sections 4.4, 5.6 and 7.2, exercises 7 and 17.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.schemes.base import Stepper
from vibsim.theory.arithmetic import characteristic
from vibsim.theory.basis import LINEAR, require_formula, unit_steps
from vibsim.theory.laurent import HALF, Laurent, coefficients
from vibsim.theory.phase_amplitude import Principal, principal, principal_mode

POWERS = 9
"""Power of p at which series of errors are truncated."""
TERMS = 4
"""Default number of terms of a series, in even powers of p."""


def symbol(name: str) -> Any:
    """Return one of the symbols of results: p, x, I, V, w, t, dt real, n a nonnegative integer."""
    from sympy import Symbol

    if name == "n":
        return Symbol(name, integer=True, nonnegative=True)
    return Symbol(name, positive=True) if name in ("p", "w") else Symbol(name, real=True)


def matrix(stepper: Stepper) -> Any:
    """Return the matrix of a step, `vibsim.theory.Amplification.matrix`, as a function of p."""
    return _expressions(matrices(stepper)[0])


def start(stepper: Stepper) -> Any:
    """Return the matrix of the start, on ``(u_0, v_0 dt)``."""
    return _expressions(matrices(stepper)[1])


def growth_series(stepper: Stepper, terms: int = TERMS) -> Any:
    """Return the first terms of the series of the growth of the amplitude per step, as a polynomial in p."""
    return _polynomial(_principal(stepper, terms).determinant ** HALF, terms)


def frequency_series(stepper: Stepper, terms: int = TERMS) -> Any:
    """Return the first terms of ``w~/w``: ``1 + p^2/24 + ...`` for the centred scheme, B (19)."""
    return _polynomial(_principal(stepper, terms).square.shifted(-2) ** HALF, terms)


def phase_error_series(stepper: Stepper, terms: int = TERMS) -> Any:
    """Return the first terms of ``(P - P~)/P = 1 - w/w~``, the fraction of a period by which peaks come early."""
    return _polynomial(1.0 - _principal(stepper, terms).square.shifted(-2) ** -HALF, terms)


def error_series(stepper: Stepper) -> tuple[Any, Any]:
    """Return two terms in p of the error ``u(t) - u^n`` for ``u(0) = 1``, ``u'(0) = 0`` (B, section 4.4).

    The second result is the next power of p. With parasitic roots it is the error after these have decayed.
    """
    from sympy import cos, ring, sin

    mode, p, angle = principal_mode(stepper, 0.0), symbol("p"), symbol("w") * symbol("t")
    field = mode.rate.field
    formulas, turned = ring("turned", field.domain)

    def row(series: Laurent) -> NDArray[Any]:
        """Return the coefficients of the powers of p as polynomials in w t."""
        constants = [formulas.ground_new(series.at(k)) for k in range(POWERS)]
        return np.array(constants, dtype=object)

    def product(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
        return np.array([sum(a[: k + 1] * b[k::-1]) for k in range(POWERS)], dtype=object)

    # the motion is the real part of B exp(i w t) exp(z), where z vanishes with p
    factors = row(mode.rate) * turned, row(mode.frequency - 1.0) * turned
    power = total = row(mode.position[0]), -row(mode.slope[0] / mode.frequency)
    for k in range(1, POWERS):
        (a, b), (c, d) = power, factors
        power = (product(a, c) - product(b, d)) / k, (product(a, d) + product(b, c)) / k
        total = total[0] + power[0], total[1] + power[1]
    along, beside = total[0] * -1, total[1]
    along[0] += 1

    def formula(polynomial: Any) -> Any:
        terms = zip(polynomial.monoms(), field.cleaned(polynomial.coeffs()), strict=True)
        return formulas.from_dict({power: c for power, c in terms if c}).as_expr(angle)

    parts = (
        formula(one) * cos(angle) + formula(other) * sin(angle)
        for one, other in zip(along, beside, strict=True)
    )
    terms = [(p**k, part) for k, part in enumerate(parts) if part != 0]
    following = [power for power, _ in terms[2:]]
    return sum(factor * power for power, factor in terms[:2]), (*following, p**POWERS)[0]


@dataclass(frozen=True)
class TwoRoots:
    """The parts of the solution of a scheme without parasitic roots, in the symbols of this module.

    ``u^n = r^n (u^0 cos(n th) + (u^1/r - u^0 cos(th)) sin(n th)/sin(th))``, ``u^0 = I``.
    """

    growth: Any
    """r, the growth of the amplitude per step."""
    cosine: Any
    """cos(th), th = w~ dt."""
    first: tuple[Any, Any]
    """Coefficients of I and ``V dt`` in ``u^1``, for ``u(0) = I``, ``u'(0) = V``."""


def two_roots(stepper: Stepper) -> TwoRoots:
    """Return the parts of the solution; ValueError if there are parasitic roots, or the start is not a step."""
    from sympy import sqrt

    step, first, _ = matrices(stepper)
    polynomial = [value[0] for value in characteristic(step[None])]
    trace, determinant = -polynomial[1], polynomial[2]
    # u^2 - T u^1 + D u^0 for u_0 = 1 and for v_0 dt = 1
    gaps = (step @ first)[0] - first[0] * trace + np.array([1, 0], dtype=object) * determinant
    if any(polynomial[3:]) or any(gaps):
        raise ValueError(
            "the scheme has parasitic roots, so that its solution has more than two terms"
        )
    r = sqrt(expression(determinant))
    one, other = map(expression, first[0])
    return TwoRoots(r, expression(trace) / (2 * r), (one, other))


def solution(stepper: Stepper) -> Any:
    """Return the formula of ``u^n`` for ``u(0) = I``, ``u'(0) = V``; ValueError as for `two_roots`."""
    from sympy import acos, cos, sin

    parts, n, begin = two_roots(stepper), symbol("n"), symbol("I")
    angle = acos(parts.cosine)
    first = parts.first[0] * begin + parts.first[1] * symbol("V") / symbol("w") * symbol("p")
    swing = (first / parts.growth - begin * cos(angle)) * sin(n * angle) / sin(angle)
    return parts.growth**n * (begin * cos(n * angle) + swing)


@lru_cache(maxsize=64)
def matrices(stepper: Stepper) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return step, start and velocity of `vibsim.theory.Amplification` in a field of fractions of SymPy.

    Raises `NoSeriesError` if the step compares numbers.
    """
    from sympy import field

    require_formula(stepper)
    domain, elements = coefficients(stepper)
    fractions, p = field("p", domain)
    units = unit_steps(
        stepper,
        p,
        fractions.zero,
        lambda formula: fractions.ground_new(elements[formula]),
        substitutes=LINEAR,
    )
    step, first, velocity = (
        (np.array(columns, dtype=object) * fractions.one).T
        for columns in (units.step, units.start, units.velocity)
    )
    return step, first, velocity


def expression(element: Any) -> Any:
    """Return an element of a field of fractions, or of a ring, as a SymPy expression in p."""
    return element.as_expr(symbol("p"))


def _expressions(entries: NDArray[Any]) -> Any:
    from sympy import Matrix

    return Matrix([[expression(entry) for entry in row] for row in entries])


def _principal(stepper: Stepper, terms: int) -> Principal:
    return principal(stepper, 0.0, 2 * terms + 2)


def _polynomial(series: Laurent, terms: int) -> Any:
    p, read = symbol("p"), series.field.domain.to_sympy
    return sum(read(series.at(2 * k)) * p ** (2 * k) for k in range(terms))
