r"""The theory of a scheme as formulas in ``p = w dt``: matrix, characteristic polynomial, series, discrete solution.

Exact, for every scheme whose step is polynomial or rational on a linear problem; all of them are. SymPy is imported on
first use, and every result is one of its expressions in the symbols p, x, n, I, V and w.

Source: vibration text (B), equations (18)-(20), sections 5.6 and 7.2, exercises 7 and 17.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from vibsim.schemes.base import Stepper
from vibsim.theory import series
from vibsim.theory.exact import Exact, exact_steps

TERMS = 4
"""Terms of a series, in even powers of p, unless told."""


def symbol(name: str) -> Any:
    """Return one of the symbols of results: p, x, I, V, w real, n a whole number."""
    from sympy import Symbol

    if name == "n":
        return Symbol(name, integer=True, nonnegative=True)
    return Symbol(name, positive=True) if name in ("p", "w") else Symbol(name, real=True)


def matrix(stepper: Stepper) -> Any:
    """Return the matrix of a step: `vibsim.theory.Amplification.matrix` as a function of p."""
    from sympy import Matrix

    return Matrix([[_expression(entry) for entry in row] for row in _rows(stepper)])


def start(stepper: Stepper) -> Any:
    """Return the matrix of the start, on ``(u_0, v_0 dt)``."""
    from sympy import Matrix

    columns = exact_steps(stepper).start
    return Matrix(
        [[_expression(_element(stepper, x)) for x in row] for row in zip(*columns, strict=True)]
    )


def characteristic(stepper: Stepper) -> Any:
    """Return the characteristic polynomial in x; its roots are the amplification factors A of B, section 4.1."""
    x = symbol("x")
    coefficients = _characteristic(stepper)
    degree = len(coefficients) - 1
    return sum(_expression(value) * x ** (degree - k) for k, value in enumerate(coefficients))


def growth_series(stepper: Stepper, terms: int = TERMS) -> Any:
    """Return the growth of the amplitude per step as a polynomial in p, the first terms of its series."""
    _, determinant = _principal(stepper, terms)
    return _polynomial(stepper, series.power(determinant, _half(stepper)))


def frequency_series(stepper: Stepper, terms: int = TERMS) -> Any:
    """Return ``w~/w`` likewise: ``1 + p^2/24 + ...`` of the centred scheme, B (19)."""
    return _polynomial(stepper, _ratio(stepper, terms))


def phase_error_series(stepper: Stepper, terms: int = TERMS) -> Any:
    """Return ``(P - P~)/P = 1 - w/w~``, the part of a period by which peaks come early in each, likewise."""
    late = series.power(_ratio(stepper, terms), -_half(stepper) * 2)
    return _polynomial(stepper, [late[0] - late[0], *(-value for value in late[1:])])


def solution(stepper: Stepper) -> Any:
    """Return ``u^n`` for ``u(0) = I``, ``u'(0) = V``, of a scheme that has two roots and no parasitic one.

    ``u^n = r^n (u^0 cos(n th) + (u^1/r - u^0 cos th) sin(n th)/sin th)``, r the growth per step and th = w~ dt.

    Raises
    ------
    ValueError
        Where the scheme has parasitic roots, or a start that is no step.
    """
    from sympy import acos, cos, sin, sqrt

    coefficients, field = _characteristic(stepper), _field(stepper)
    first = exact_steps(stepper).start
    row = _rows(stepper)[0]
    columns = [[_element(stepper, x) for x in column] for column in first]
    second = [
        sum((a * b for a, b in zip(row, column, strict=True)), field.zero) for column in columns
    ]
    trace, determinant = -coefficients[1], coefficients[2]
    before = [field.one, field.zero]
    gaps = [
        two - trace * one[0] + determinant * nought
        for two, one, nought in zip(second, columns, before, strict=True)
    ]
    if any(coefficients[3:]) or any(gaps):
        raise ValueError("a scheme with parasitic roots has no solution with two terms")
    n, p = symbol("n"), symbol("p")
    r = sqrt(_expression(determinant))
    angle = acos(_expression(trace) / (2 * r))
    begin, push = symbol("I"), symbol("V") / symbol("w") * p
    one = _expression(columns[0][0]) * begin + _expression(columns[1][0]) * push
    return r**n * (
        begin * cos(n * angle) + (one / r - begin * cos(angle)) * sin(n * angle) / sin(angle)
    )


def error_fraction() -> Any:
    """Return ``E = [D_t D_t u]^n/u''(t_n)`` of ``u = exp(i w t)``, worked out from the difference (B, exercise 7)."""
    from sympy import I, exp, simplify, sin

    p = symbol("p")
    fraction = (exp(I * p) - 2 + exp(-I * p)) / -(p**2)
    wanted = (2 / p) ** 2 * sin(p / 2) ** 2
    if simplify((fraction - wanted).rewrite(exp)) != 0:
        raise ArithmeticError(f"{fraction} is not {wanted}")
    return wanted


def taylor(expression: Any, degree: int) -> Any:
    """Return the Taylor polynomial in p of an expression, up to a degree."""
    return expression.series(symbol("p"), 0, degree + 1).removeO()


def _element(stepper: Stepper, number: Any) -> Any:
    """Return the function of p that a number is; a step may write a plain 0 into its state."""
    field = _field(stepper)
    return (
        number.element
        if isinstance(number, Exact)
        else field.ground_new(field.domain.convert(int(number)))
    )


def _field(stepper: Stepper) -> Any:
    """Return the field of fractions of SymPy that the numbers of a scheme lie in."""
    return exact_steps(stepper).start[0][0].element.field


def _rows(stepper: Stepper) -> list[list[Any]]:
    columns = exact_steps(stepper).step
    return [[_element(stepper, entry) for entry in row] for row in zip(*columns, strict=True)]


def _expression(element: Any) -> Any:
    return element.as_expr(symbol("p"))


def _characteristic(stepper: Stepper) -> list[Any]:
    """Return the coefficients of the characteristic polynomial, the highest power first, by Leverrier's method."""
    rows = _rows(stepper)
    size = range(len(rows))
    field = _field(stepper)
    coefficients = [field.one]
    product = rows
    for k in range(1, len(rows) + 1):
        trace = sum((product[i][i] for i in size), field.zero)
        coefficients.append(-trace / k)
        shifted = [
            [product[i][j] + (coefficients[-1] if i == j else field.zero) for j in size]
            for i in size
        ]
        product = [
            [sum((rows[i][m] * shifted[m][j] for m in size), field.zero) for j in size]
            for i in size
        ]
    return coefficients


def _principal(stepper: Stepper, terms: int) -> tuple[series.Series, series.Series]:
    """Return trace and determinant of the principal pair as series in p^2."""
    coefficients = _characteristic(stepper)
    while len(coefficients) > 3 and not coefficients[-1]:
        coefficients.pop()
    return series.principal([_in_squares(value, terms) for value in coefficients])


def _in_squares(element: Any, terms: int) -> series.Series:
    """Return the series of a function of p^2 at 0."""
    domain = element.field.domain

    def listed(polynomial: Any) -> series.Series:
        return [
            polynomial.coeff(polynomial.ring.gens[0] ** (2 * k)) if k else polynomial.coeff(1)
            for k in range(terms)
        ]

    above, below = (
        [domain.convert(value) for value in listed(part)] for part in (element.numer, element.denom)
    )
    return series.over(above, below)


def _ratio(stepper: Stepper, terms: int) -> series.Series:
    """Return w~/w as a series in p^2."""
    trace, determinant = _principal(stepper, terms + 1)
    half = _half(stepper)
    cosine = series.times([value * half for value in trace], series.power(determinant, -half))
    return series.power(series.square_of_angle(cosine)[1:], half)


def _half(stepper: Stepper) -> Any:
    domain = _field(stepper).domain
    return domain.one / domain.convert(2)


def _polynomial(stepper: Stepper, coefficients: Sequence[Any]) -> Any:
    domain = _field(stepper).domain
    p = symbol("p")
    return sum(domain.to_sympy(value) * p ** (2 * k) for k, value in enumerate(coefficients))
