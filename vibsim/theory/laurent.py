r"""Series in the time step dt with exact coefficients, as numbers that the step of a scheme can run on.

``c_k dt^k + c_(k+1) dt^(k+1) + ...`` from any whole k, also below 0, with coefficients in a field of SymPy: rational
numbers, those with roots, or quotients of polynomials in symbols. A series knows how far it is known, and no operation
claims more. Of a comparison only a sign is asked, for which `Field.value` gives the first coefficient at one point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

from vibsim.theory import series


@dataclass(frozen=True, eq=False)
class Field:
    """Where coefficients lie."""

    number: Callable[[Fraction], Any]
    """Makes an element of a fraction."""
    value: Callable[[Any], float]
    """The value of an element, of one with symbols at one point."""
    known: int
    """Power of dt from which on every series is cut off."""

    @cached_property
    def zero(self) -> Any:
        """The element 0."""
        return self.number(Fraction(0))

    def series(self, element: Any, power: int = 0) -> Laurent:
        """Return ``element dt^power``, known as far as series are."""
        zeros = [self.zero] * (self.known - power - 1)
        return Laurent(self, power, [element, *zeros])

    def constant(self, number: Any) -> Laurent:
        """Return a number of a step's text; a float is the decimal that it was written as."""
        return self.series(self.number(Fraction(repr(float(number)))))


@dataclass(frozen=True, eq=False, slots=True)
class Laurent:
    """A series; the number of its coefficients says how far it is known."""

    field: Field
    first: int
    """Power of dt that the first coefficient belongs to."""
    coefficients: Sequence[Any]

    @property
    def end(self) -> int:
        """The first power that is not known."""
        return self.first + len(self.coefficients)

    @property
    def leading(self) -> tuple[int, Any] | None:
        """Power and coefficient of the first term; None where all that is known is 0."""
        found = ((self.first + k, c) for k, c in enumerate(self.coefficients) if c)
        return next(found, None)

    def at(self, power: int) -> Any:
        """Return the coefficient of a known power."""
        index = power - self.first
        return self.coefficients[index] if index >= 0 else self.field.zero

    def __add__(self, other: Any) -> Laurent:
        given = self._same(other)
        first, end = min(self.first, given.first), min(self.end, given.end)
        return Laurent(self.field, first, [self.at(k) + given.at(k) for k in range(first, end)])

    def __neg__(self) -> Laurent:
        return Laurent(self.field, self.first, [-c for c in self.coefficients])

    def __sub__(self, other: Any) -> Laurent:
        return self + -self._same(other)

    def __rsub__(self, other: Any) -> Laurent:
        return self._same(other) - self

    def __mul__(self, other: Any) -> Laurent:
        given = self._same(other)
        first = self.first + given.first
        length = min(len(self.coefficients), len(given.coefficients), self.field.known - first)
        product = [self.field.zero] * length
        for i, a in enumerate(self.coefficients[:length]):
            for j, b in enumerate(given.coefficients[: length - i] if a else ()):
                if b:
                    product[i + j] = product[i + j] + a * b
        return Laurent(self.field, first, product)

    def __truediv__(self, other: Any) -> Laurent:
        return self * self._same(other)._inverse()

    def __rtruediv__(self, other: Any) -> Laurent:
        return self._same(other) / self

    __radd__ = __add__
    __rmul__ = __mul__

    def __pow__(self, exponent: int) -> Laurent:
        result = self._same(1.0)
        for _ in range(exponent):
            result = result * self
        return result

    def __abs__(self) -> Laurent:
        return -self if self._sign() < 0.0 else self

    def root(self) -> Laurent:
        """Return the square root of a series that begins with 1.

        Raises
        ------
        ValueError
            Where it begins with something else.
        """
        one = self.field.number(Fraction(1))
        if self.leading != (0, one):
            raise ValueError("the root of a series is taken where it begins with 1")
        known = [self.at(k) for k in range(self.end)]
        half = self.field.number(Fraction(1, 2))
        return Laurent(self.field, 0, series.power(known, half))

    def _sign(self) -> float:
        leading = self.leading
        return 0.0 if leading is None else self.field.value(leading[1])

    def _same(self, other: Any) -> Laurent:
        return other if isinstance(other, Laurent) else self.field.constant(other)

    def _inverse(self) -> Laurent:
        leading = self.leading
        if leading is None:
            raise ZeroDivisionError("a series divided by one of which no term is known")
        power, length = leading[0], self.end - leading[0]
        divisor = [self.at(power + k) for k in range(length)]
        one = [self.field.number(Fraction(1)), *[self.field.zero] * (length - 1)]
        return Laurent(self.field, -power, series.over(one, divisor))
