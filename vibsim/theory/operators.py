r"""A scheme on ``u'' + w^2 u = 0`` in the operator notation of the vibration text, with velocity and without.

The characteristic polynomial is the recurrence of the positions: its coefficients are the factors of ``u^(n+1)``,
``u^n``, ``u^(n-1)``, .... At p = 0 it has the factor ``(x - 1)^2``, that is ``[D_t D_t u]``; the remaining terms say
where, and with which weights, the scheme evaluates ``w^2 u``: Forward Euler at n - 1, Backward Euler at n + 1. Squares
of ``x - 1`` and ``x + 1`` in the coefficients of powers of p are second differences and means.

A scheme without parasitic roots advances position and velocity by a matrix B. It is written with forward differences,
``B - 1`` at n, with backward differences, ``1 - B^-1`` at n + 1, and with centred differences and means,
``2 (B - 1)/(B + 1)`` at n + 1/2; the shortest form is returned.

Source: vibration text (B), equations (9)-(12), (26), (29)-(37), (42), (49)-(56), sections 5.1 and 5.2.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import reduce
from itertools import accumulate
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.schemes.base import Stepper
from vibsim.theory.arithmetic import characteristic
from vibsim.theory.laurent import HALF
from vibsim.theory.symbolic import expression, matrices, symbol

NOTATION = MappingProxyType(
    {
        "D_t": "(u^(n+1/2) - u^(n-1/2))/dt",
        "D_2t": "(u^(n+1) - u^(n-1))/(2 dt)",
        "D_t+": "(u^(n+1) - u^n)/dt",
        "D_t-": "(u^n - u^(n-1))/dt",
        "mean": "(u^(n+1/2) + u^(n-1/2))/2",
    }
)
"""Value of each operator on u at time n: B, equations (9) to (12), (26), (29) and (33)."""


POWERS = MappingProxyType(
    {"u": {"u": (2, 1), "v": (0, 0)}, "v": {"u": (2, 0), "v": (2, 1)}},
)
"""Exponents of w and dt with which u and v enter the difference equation of each."""


@dataclass(frozen=True)
class Term:
    """``factor w^i dt^k [operators of]^(n + place)``."""

    factor: Any
    """A function of p."""
    powers: tuple[int, int]
    """i and k."""
    operators: tuple[str, ...]
    """Names of `NOTATION`; the last is applied first."""
    of: str
    """``u`` or ``v``."""
    place: Fraction


Equation = tuple[Sequence[Term], Sequence[Term]]
"""The terms of both sides."""


def recurrence(stepper: Stepper) -> list[Any]:
    """Return the factors of ``u^(n+1)``, ``u^n``, ``u^(n-1)``, ... in the recurrence (sum 0): polynomials in p.

    The first factor is 1 at p = 0. Roots that are 0 are omitted: the recurrence holds after their part has vanished.
    """
    factors = _recurrence(stepper)
    first = expression(factors[0]).subs(symbol("p"), 0)
    return [(expression(factor) / first).expand() for factor in factors]


def without_velocity(stepper: Stepper) -> Equation:
    """Return the recurrence with second differences of u on the left and the other terms on the right.

    The factors of either side, ``[D_t D_t u]`` and ``w^2 u``, sum to 1 at p = 0, as for any consistent scheme.
    """
    factors = _recurrence(stepper)
    powers = sorted({power for factor in factors for (power,) in factor})
    parts = {power: [_at(factor, power) for factor in factors] for power in powers}
    read = factors[0].ring.domain.to_sympy
    left = _terms(parts.pop(0), 0, read)
    right = [term for power, part in parts.items() for term in _terms(part, power, read)]
    total = sum(term.factor for term in left)
    return (
        [replace(term, factor=term.factor / total) for term in left],
        _joined(replace(term, factor=-term.factor / total) for term in right),
    )


def at_one_time(stepper: Stepper) -> Equation:
    """Return the recurrence with every term at n: ``mass D_t D_t u + drag D_2t u + stiffness u = 0``.

    A positive drag damps, a negative one drives. Raises ValueError if the recurrence has more than three times.
    """
    factors = recurrence(stepper)
    if len(factors) != 3:
        raise ValueError(f"the recurrence has {len(factors)} times, not 3")
    following, now, previous = factors
    rows = (
        ((following + previous) / 2, (0, 0), ("D_t", "D_t")),
        (following - previous, (2, 1), ("D_2t",)),
        (following + now + previous, (2, 0), ()),
    )
    p, here = symbol("p"), Fraction(0)
    terms = (Term(_tidy(f / p ** n[0]), n, of, "u", here) for f, n, of in rows)
    return [term for term in terms if term.factor != 0], []


def with_velocity(stepper: Stepper) -> tuple[Equation, Equation]:
    """Return the equations that advance position and velocity; ValueError if the scheme carries more than these."""
    step, first, velocity = matrices(stepper)
    one = np.array([first[0], velocity @ first])
    two, three = (
        np.array([state[0], velocity @ state]) for state in (step @ first, step @ step @ first)
    )
    matrix = two @ _inverse(one)
    if np.any(matrix @ two - three):
        raise ValueError("the scheme carries more than position and velocity")
    unit = np.eye(2, dtype=int)
    half = (matrix - unit) @ _inverse(matrix + unit)
    readings: tuple[tuple[str, tuple[str, ...], Fraction, NDArray[Any]], ...] = (
        ("D_t+", (), Fraction(0), matrix - unit),
        ("D_t-", (), Fraction(1), unit - _inverse(matrix)),
        ("D_t", ("mean",), HALF, half + half),
    )

    def equation(i: int) -> Equation:
        name = "uv"[i]
        forms = []
        for operator, mean, place, rows in readings:
            right = [
                Term(_tidy(expression(value) / p ** powers[0]), powers, mean, of, place)
                for (of, powers), value in zip(POWERS[name].items(), rows[i], strict=True)
                if value
            ]
            forms.append(([Term(p**0, (0, 0), (operator,), name, place)], right))
        return min(forms, key=lambda form: _length(form[1]))

    p = symbol("p")
    return equation(0), equation(1)


def _recurrence(stepper: Stepper) -> list[Any]:
    """Return the factors of the recurrence as elements of a SymPy polynomial ring, without denominators."""
    values = [value[0] for value in characteristic(matrices(stepper)[0][None])[1:]]
    denominator = reduce(lambda a, b: a.lcm(b), (value.denom for value in values))
    whole = (value * denominator for value in values)
    factors = [denominator, *(value.numer.quo_ground(value.denom.LC) for value in whole)]
    while not factors[-1]:
        factors.pop()
    return factors


def _at(factor: Any, power: int) -> Any:
    """Return the coefficient of a power of p as an element of the domain."""
    return factor.get((power,), factor.ring.domain.zero)


def _terms(factors: Sequence[Any], power: int, read: Callable[[Any], Any]) -> list[Term]:
    """Return the terms of ``p^power/dt^2`` times a polynomial in x with these factors, the first of ``u^(n+1)``."""
    zeros = next(i for i, factor in enumerate(factors) if factor)
    quotient = list(factors[zeros:])
    while not quotient[-1]:
        quotient.pop()
    quotient, differences = _divided(quotient, 1)
    quotient, means = _divided(quotient, -1)
    operators = ("D_t",) * differences + ("mean",) * means
    place = Fraction(1 - zeros) - HALF * len(operators)
    shared, powers = symbol("p") ** 0 * 2**means, (0, differences - 2)
    if power:
        shared, powers = shared * symbol("p") ** (power - 2), (2, differences)
    return [
        Term(shared * read(factor), powers, operators, "u", place - i)
        for i, factor in enumerate(quotient)
        if factor
    ]


def _divided(factors: list[Any], root: int) -> tuple[list[Any], int]:
    """Divide a polynomial by ``(x - root)^2`` as often as possible; return the quotient and twice that number."""
    times = 0
    while len(factors) > 2:
        quotient = factors
        remainders = []
        for _ in range(2):
            quotient = list(accumulate(quotient, lambda before, factor: factor + before * root))
            remainders.append(quotient.pop())
        if any(remainders):
            break
        factors, times = quotient, times + 2
    return factors, times


def _tidy(factor: Any) -> Any:
    """Return a function of p in lowest terms, with a denominator that is 1 at p = 0."""
    numerator, denominator = factor.cancel().as_numer_denom()
    scale = denominator.subs(symbol("p"), 0)
    return (numerator / scale).expand() / (denominator / scale).expand()


def _length(terms: Sequence[Term]) -> tuple[bool, int, int]:
    """Return a sort key for the length of an equation: any with p in a denominator is longer than any without."""
    factors = [term.factor for term in terms]
    is_divided = any(factor.as_numer_denom()[1].has(symbol("p")) for factor in factors)
    operations = (min(factor.count_ops(), (-factor).count_ops()) for factor in factors)
    return is_divided, len(factors), sum(operations)


def _joined(terms: Iterable[Term]) -> list[Term]:
    """Add terms that differ only in their factors."""
    sums: dict[Any, Term] = {}
    for term in terms:
        key = term.powers, term.operators, term.place
        before = sums.get(key)
        sums[key] = replace(term, factor=term.factor + before.factor) if before else term
    return sorted(sums.values(), key=lambda term: (-term.place, term.operators))


def _inverse(matrix: NDArray[Any]) -> NDArray[Any]:
    """Return the inverse of a 2 x 2 matrix."""
    (a, b), (c, d) = matrix
    scale = a * d - b * c
    return np.array([[d / scale, -b / scale], [-c / scale, a / scale]], dtype=object)
