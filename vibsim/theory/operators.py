r"""A scheme on ``u'' + w^2 u = 0`` in the operator notation of the vibration text: with its velocity, and without.

The characteristic polynomial is the recurrence of the positions alone: its coefficients are the factors of ``u^(n+1)``,
``u^n``, ``u^(n-1)``, .... At p = 0 it has the factor ``(x - 1)^2``, that is ``[D_t D_t u]``; the rest says where, and
with which weights, the scheme takes ``w^2 u``: Forward Euler at n - 1, Backward Euler at n + 1. Squares of ``x - 1``
and ``x + 1`` in any part are second differences and means.

A scheme without parasitic roots advances position and velocity by a matrix B. Its rows are read as forward differences,
``B - 1`` at n, as backward ones, ``1 - B^-1`` at n + 1, and as centred ones with means, ``2 (B - 1)/(B + 1)`` at
n + 1/2; of these the shortest is taken.

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
from vibsim.theory.symbolic import expression, matrices, symbol

HALF = Fraction(1, 2)
NOTATION = MappingProxyType(
    {
        "D_t": "(u^(n+1/2) - u^(n-1/2))/dt",
        "D_2t": "(u^(n+1) - u^(n-1))/(2 dt)",
        "D_t+": "(u^(n+1) - u^n)/dt",
        "D_t-": "(u^n - u^(n-1))/dt",
        "mean": "(u^(n+1/2) + u^(n-1/2))/2",
    }
)
"""What each operator makes of u at the time n: B, equations (9) to (12), (26), (29) and (33)."""


POWERS = MappingProxyType(
    {"u": {"u": (2, 1), "v": (0, 0)}, "v": {"u": (2, 0), "v": (2, 1)}},
)
"""Powers of w and dt with which u and v enter the difference of either; p^2 is taken out with w^2."""


@dataclass(frozen=True)
class Term:
    """``factor w^i dt^k [operators of]^(n + place)``."""

    factor: Any
    """A function of p."""
    powers: tuple[int, int]
    """i and k."""
    operators: tuple[str, ...]
    """Of `NOTATION`; the last one is applied first."""
    of: str
    """``u`` or ``v``."""
    place: Fraction


Equation = tuple[Sequence[Term], Sequence[Term]]
"""The terms of both sides."""


def recurrence(stepper: Stepper) -> list[Any]:
    """Return the factors of ``u^(n+1)``, ``u^n``, ``u^(n-1)``, ..., of which the sum is 0: polynomials in p.

    The first one is 1 at p = 0. Roots that are 0 are left out: the recurrence holds as soon as they have died out.
    """
    found = _recurrence(stepper)
    first = expression(found[0]).subs(symbol("p"), 0)
    return [(expression(part) / first).expand() for part in found]


def without_velocity(stepper: Stepper) -> Equation:
    """Return the recurrence as second differences of u on one side, and what they are equal to on the other.

    The factors of either side, ``[D_t D_t u]`` and ``w^2 u``, add up to 1 at p = 0, as those of a consistent scheme do.
    """
    found = _recurrence(stepper)
    powers = sorted({power for part in found for (power,) in part})
    parts = {power: [_at(part, power) for part in found] for power in powers}
    read = found[0].ring.domain.to_sympy
    left = _terms(parts.pop(0), 0, read)
    right = [term for power, part in parts.items() for term in _terms(part, power, read)]
    total = sum(term.factor for term in left)
    return (
        [replace(term, factor=term.factor / total) for term in left],
        _joined(replace(term, factor=-term.factor / total) for term in right),
    )


def at_one_time(stepper: Stepper) -> Equation:
    """Return the recurrence with every term at n: ``mass D_t D_t u + drag D_2t u + stiffness u = 0``.

    A drag above 0 damps as one of the equation would, one below 0 drives. ValueError for more than three times.
    """
    factors = recurrence(stepper)
    if len(factors) != 3:
        raise ValueError(f"the recurrence has {len(factors)} times, not 3")
    ahead, now, behind = factors
    rows = (
        ((ahead + behind) / 2, (0, 0), ("D_t", "D_t")),
        (ahead - behind, (2, 1), ("D_2t",)),
        (ahead + now + behind, (2, 0), ()),
    )
    p, here = symbol("p"), Fraction(0)
    terms = (Term(_tidy(f / p ** n[0]), n, of, "u", here) for f, n, of in rows)
    return [term for term in terms if term.factor != 0], []


def with_velocity(stepper: Stepper) -> tuple[Equation, Equation]:
    """Return the equations that advance position and velocity; ValueError where a state has more in it."""
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
        found = []
        for operator, mean, place, rows in readings:
            right = [
                Term(_tidy(expression(value) / p ** powers[0]), powers, mean, of, place)
                for (of, powers), value in zip(POWERS[name].items(), rows[i], strict=True)
                if value
            ]
            found.append(([Term(p**0, (0, 0), (operator,), name, place)], right))
        return min(found, key=lambda reading: _length(reading[1]))

    p = symbol("p")
    return equation(0), equation(1)


def _recurrence(stepper: Stepper) -> list[Any]:
    """Return the factors of the recurrence as polynomials of a ring of SymPy, without denominators."""
    found = [value[0] for value in characteristic(matrices(stepper)[0][None])[1:]]
    bottom = reduce(lambda a, b: a.lcm(b), (value.denom for value in found))
    whole = (value * bottom for value in found)
    factors = [bottom, *(value.numer.quo_ground(value.denom.LC) for value in whole)]
    while not factors[-1]:
        factors.pop()
    return factors


def _at(factor: Any, power: int) -> Any:
    """Return the coefficient of a power of p as an element of the domain."""
    return factor.get((power,), factor.ring.domain.zero)


def _terms(factors: Sequence[Any], power: int, read: Callable[[Any], Any]) -> list[Term]:
    """Return ``p^power/dt^2`` times a polynomial in x, whose factors are elements, the first that of ``u^(n+1)``."""
    zeros = next(i for i, factor in enumerate(factors) if factor)
    rest = list(factors[zeros:])
    while not rest[-1]:
        rest.pop()
    rest, differences = _divided(rest, 1)
    rest, means = _divided(rest, -1)
    operators = ("D_t",) * differences + ("mean",) * means
    place = Fraction(1 - zeros) - HALF * len(operators)
    shared, powers = symbol("p") ** 0 * 2**means, (0, differences - 2)
    if power:
        shared, powers = shared * symbol("p") ** (power - 2), (2, differences)
    return [
        Term(shared * read(factor), powers, operators, "u", place - i)
        for i, factor in enumerate(rest)
        if factor
    ]


def _divided(factors: list[Any], root: int) -> tuple[list[Any], int]:
    """Divide a polynomial by ``(x - root)^2`` as often as it goes; return twice that number with what is left."""
    times = 0
    while len(factors) > 2:
        quotient = factors
        rests = []
        for _ in range(2):
            quotient = list(accumulate(quotient, lambda before, factor: factor + before * root))
            rests.append(quotient.pop())
        if any(rests):
            break
        factors, times = quotient, times + 2
    return factors, times


def _tidy(factor: Any) -> Any:
    """Return a function of p in lowest terms, with 1 as what is below the line at p = 0."""
    above, below = factor.cancel().as_numer_denom()
    scale = below.subs(symbol("p"), 0)
    return (above / scale).expand() / (below / scale).expand()


def _length(terms: Sequence[Term]) -> tuple[bool, int, int]:
    """Tell how long an equation is: one with p below a fraction line is longer than any without."""
    factors = [term.factor for term in terms]
    is_divided = any(factor.as_numer_denom()[1].has(symbol("p")) for factor in factors)
    operations = (min(factor.count_ops(), (-factor).count_ops()) for factor in factors)
    return is_divided, len(factors), sum(operations)


def _joined(terms: Iterable[Term]) -> list[Term]:
    """Add up terms that differ in their factors alone."""
    found: dict[Any, Term] = {}
    for term in terms:
        key = term.powers, term.operators, term.place
        before = found.get(key)
        found[key] = replace(term, factor=term.factor + before.factor) if before else term
    return sorted(found.values(), key=lambda term: (-term.place, term.operators))


def _inverse(matrix: NDArray[Any]) -> NDArray[Any]:
    """Return the inverse of two rows."""
    (a, b), (c, d) = matrix
    scale = a * d - b * c
    return np.array([[d / scale, -b / scale], [-c / scale, a / scale]], dtype=object)
