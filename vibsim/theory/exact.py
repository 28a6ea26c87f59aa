r"""Exact functions of ``p = w dt`` as numbers that the step of a scheme can run on.

They are quotients of polynomials in p with coefficients in the rational numbers and the roots that the scheme's
formulas name, such as sqrt(3). A comparison is decided at one value of p, which is enough for what schemes compare:
whether a correction is nothing. SymPy is imported on first use.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from vibsim.schemes.base import Stepper
from vibsim.theory.basis import UnitSteps, exact, reads, unit_steps

_AT = 0.40625
"""The value of p, not small and below every limit of stability."""


@dataclass(frozen=True, eq=False, slots=True)
class Exact:
    """A function of p, with its value at one p beside it."""

    element: Any
    """Of a field of fractions of SymPy."""
    near: float

    def __add__(self, other: Any) -> Exact:
        return self._with(other, lambda a, b: a + b)

    def __sub__(self, other: Any) -> Exact:
        return self._with(other, lambda a, b: a - b)

    def __rsub__(self, other: Any) -> Exact:
        return self._with(other, lambda a, b: b - a)

    def __mul__(self, other: Any) -> Exact:
        return self._with(other, lambda a, b: a * b)

    def __truediv__(self, other: Any) -> Exact:
        return self._with(other, lambda a, b: a / b)

    def __rtruediv__(self, other: Any) -> Exact:
        return self._with(other, lambda a, b: b / a)

    __radd__ = __add__
    __rmul__ = __mul__

    def __neg__(self) -> Exact:
        return Exact(-self.element, -self.near)

    def __abs__(self) -> Exact:
        return -self if self.near < 0 else self

    def __gt__(self, other: Any) -> bool:
        return self.near > _near(other)

    def __ge__(self, other: Any) -> bool:
        return self.near >= _near(other)

    def __lt__(self, other: Any) -> bool:
        return self.near < _near(other)

    def __le__(self, other: Any) -> bool:
        return self.near <= _near(other)

    def _with(self, other: Any, operation: Callable[[Any, Any], Any]) -> Exact:
        field = self.element.field
        element = operation(
            self.element, other.element if isinstance(other, Exact) else _rational(field, other)
        )
        return Exact(element, operation(self.near, _near(other)) if element else 0.0)


def _near(other: Any) -> float:
    return other.near if isinstance(other, Exact) else float(other)


def _rational(field: Any, number: Any) -> Any:
    """Return a float of a step's text as the decimal that it was written as."""
    fraction = Fraction(repr(float(number)))
    domain = field.domain
    return field.ground_new(
        domain.convert(fraction.numerator) / domain.convert(fraction.denominator)
    )


@lru_cache(maxsize=64)
def exact_steps(stepper: Stepper) -> UnitSteps:
    """Return what a step and the start make of unit vectors, in numbers that are `Exact`.

    Raises
    ------
    ValueError
        Where a coefficient is not algebraic.
    """
    from sympy import field

    domain, elements = coefficients(stepper)
    fractions, p = field("p", domain)
    numbers = {
        formula: Exact(fractions.ground_new(element), float(domain.to_sympy(element)))
        for formula, element in elements.items()
    }
    zero = Exact(fractions.zero, 0.0)
    return unit_steps(stepper, Exact(p, _AT), zero, numbers.__getitem__)


@lru_cache(maxsize=64)
def coefficients(stepper: Stepper) -> tuple[Any, Mapping[str, Any]]:
    """Return the least field with all coefficients of a scheme, and the element of it that each formula is.

    Raises
    ------
    ValueError
        Where a coefficient is not algebraic.
    """
    from sympy import QQ, Pow, Rational

    expressions = {
        formula: exact(formula, lambda x: Rational(x.numerator, x.denominator), lambda x, y: x**y)
        for formula in reads(stepper)
    }
    roots = sorted({power for value in expressions.values() for power in value.atoms(Pow)}, key=str)
    domain = QQ.algebraic_field(*roots) if roots else QQ
    return domain, {
        formula: domain.from_sympy(value.expand()) for formula, value in expressions.items()
    }
