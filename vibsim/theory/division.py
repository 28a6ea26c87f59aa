"""Division of a polynomial by a quadratic, in any of the numbers that theory works with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from vibsim.theory.doubled import Doubled
from vibsim.theory.laurent import Laurent

Number = TypeVar("Number", Doubled, Laurent)


def by_quadratic(polynomial: Sequence[Number], trace: Number, determinant: Number) -> list[Number]:
    """Divide a polynomial, the highest power first, by ``x^2 - T x + D``: the quotient, then two numbers left.

    These are ``b_k = a_k + T b_(k-1) - D b_(k-2)``. Of power series it is `vibsim.theory.series.divided`.
    """
    quotient: list[Number] = []
    for k, coefficient in enumerate(polynomial):
        value = coefficient
        if k > 0:
            value = value + trace * quotient[-1]
        if k > 1:
            value = value - determinant * quotient[-2]
        quotient.append(value)
    return quotient
