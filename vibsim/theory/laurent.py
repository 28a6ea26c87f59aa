r"""Truncated series in the time step with exact coefficients, on which the step of a scheme can run.

``c_k h^k + c_(k+1) h^(k+1) + ...`` from any integer k, also negative, with coefficients in a SymPy domain: rational
numbers, algebraic numbers, or rational functions of symbols. A series carries its truncation order, and operations
propagate it. Comparisons only need the sign of the leading coefficient, which `Field.value` evaluates at one point.
SymPy is imported on first use.

The coefficients of a scheme may be decimals of 16 digits. They satisfy the conditions of its order to rounding, and
exact numbers would show what is left as an error of a lower order. For them the domain is the real numbers
(`in_reals`), where a coefficient below `ROUNDED` is 0.

The equation of an implicit step, ``x = a(u + d_u x, v + d_v x, t)``, is solved by fixed-point iteration until x no
longer changes. The factors d_u and d_v, or the force, begin with h, so every iteration adds a correct power, and the
series is the unique solution near the current acceleration.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from vibsim.elementary import ELEMENTARY
from vibsim.schemes.base import Stepper
from vibsim.schemes.newton import solved, solved_together
from vibsim.schemes.step_numbers import Arithmetic
from vibsim.theory.basis import exact, fraction_of, reads

HALF = Fraction(1, 2)
ROUNDED = 1e-13
"""Largest coefficient that is taken for the rounding of decimals of 16 digits."""
_BITS = 128
"""Precision of real coefficients."""


@dataclass(frozen=True, eq=False)
class Field:
    """Domain of the coefficients, with the truncation order."""

    domain: Any
    """SymPy domain."""
    known: int
    """Power of h at which every series is truncated."""
    at_point: Callable[[Any], float] | None = None
    """Function that evaluates an element with symbols at one point; None without symbols."""

    def cleaned(self, coefficients: Sequence[Any]) -> Sequence[Any]:
        """Return coefficients without those that are rounding."""
        if self.domain.is_Exact:
            return coefficients
        return [c if abs(c) > ROUNDED else self.domain.zero for c in coefficients]

    def number(self, fraction: Fraction) -> Any:
        """Convert a fraction to an element."""
        return self.domain.convert(fraction.numerator) / self.domain.convert(fraction.denominator)

    def value(self, element: Any) -> float:
        """Return the value of an element, with symbols at one point."""
        return (
            float(self.domain.to_sympy(element))
            if self.at_point is None
            else self.at_point(element)
        )

    def series(self, element: Any, power: int = 0) -> Laurent:
        """Return ``element h^power``, truncated at `known`."""
        return Laurent(self, power, [element, *[self.domain.zero] * (self.known - power - 1)])

    def constant(self, number: float | Fraction) -> Laurent:
        """Convert a constant of a step; a float stands for the fraction or decimal that it was written as."""
        fraction = number if isinstance(number, Fraction) else fraction_of(float(number))
        return self.series(self.number(fraction))


@dataclass(frozen=True, eq=False, slots=True)
class Laurent(Arithmetic):
    """A truncated series; the number of coefficients determines the truncation order."""

    field: Field
    first: int
    """Power of h of the first coefficient."""
    coefficients: Sequence[Any]

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficients", self.field.cleaned(self.coefficients))

    @property
    def end(self) -> int:
        """The first unknown power."""
        return self.first + len(self.coefficients)

    @property
    def leading(self) -> tuple[int, Any] | None:
        """Power and coefficient of the leading term; None if all known coefficients are 0."""
        terms = ((self.first + k, c) for k, c in enumerate(self.coefficients) if c)
        return next(terms, None)

    @property
    def vanishes(self) -> bool:
        """Whether the series tends to 0 with h."""
        return self.leading is None or self.leading[0] > 0

    @property
    def nearest(self) -> float:
        """A number with the sign of the series for small h."""
        return 0.0 if self.leading is None else self.field.value(self.leading[1])

    def at(self, power: int) -> Any:
        """Return the coefficient of a known power."""
        index = power - self.first
        return self.coefficients[index] if index >= 0 else self.field.domain.zero

    def lift(self, other: Any) -> Laurent:
        """Convert a number to a series."""
        return other if isinstance(other, Laurent) else self.field.constant(other)

    def shifted(self, power: int) -> Laurent:
        """Return the series times a power of h."""
        return Laurent(self.field, self.first + power, self.coefficients)

    def __add__(self, other: Any) -> Laurent:
        b = self.lift(other)
        first, end = min(self.first, b.first), min(self.end, b.end)
        return Laurent(self.field, first, [self.at(k) + b.at(k) for k in range(first, end)])

    def __neg__(self) -> Laurent:
        return Laurent(self.field, self.first, [-c for c in self.coefficients])

    def __mul__(self, other: Any) -> Laurent:
        factor = self.lift(other)
        first = self.first + factor.first
        length = min(len(self.coefficients), len(factor.coefficients), self.field.known - first)
        product = [self.field.domain.zero] * length
        for i, a in enumerate(self.coefficients[:length]):
            for j, b in enumerate(factor.coefficients[: length - i] if a else ()):
                if b:
                    product[i + j] = product[i + j] + a * b
        return Laurent(self.field, first, product)

    def __truediv__(self, other: Any) -> Laurent:
        divisor = self.lift(other)
        if divisor.leading is None:
            raise ZeroDivisionError("a series divided by one of which no term is known")
        power, zero = divisor.leading[0], self.field.domain.zero
        b = [divisor.at(k) for k in range(power, divisor.end)]
        inverse = [self.field.domain.one / b[0]]
        for k in range(1, len(b)):
            known = sum((inverse[i] * b[k - i] for i in range(k) if b[k - i]), zero)
            inverse.append(-known / b[0])
        return self * Laurent(self.field, -power, inverse)

    def __pow__(self, exponent: int | Fraction) -> Laurent:
        """Return a nonnegative integer power, or by Miller's recurrence any power of a series that begins with 1.

        A series of reals may begin with any positive number.
        """
        if exponent >= 0 and exponent == int(exponent):
            return math.prod([self] * int(exponent), start=self.lift(1.0))
        domain = self.field.domain
        power, begin = self.leading or (0, domain.zero)
        if power != 0 or (begin != domain.one if domain.is_Exact else not begin > 0):
            raise ValueError("the root of a series is taken where it begins with 1")
        a, e = [self.at(k) for k in range(self.end)], self.field.number(Fraction(exponent))
        result = [begin if domain.is_Exact else begin**e]
        for k in range(1, len(a)):
            terms = (
                (e * j - domain.one * (k - j)) * a[j] * result[k - j]
                for j in range(1, k + 1)
                if a[j]
            )
            result.append(sum(terms, domain.zero) / (begin * k))
        return Laurent(self.field, 0, result)

    def __abs__(self) -> Laurent:
        return -self if self.nearest < 0.0 else self

    def logarithm(self) -> Laurent:
        """Return the logarithm of a series that begins with 1, from ``a L' = a'``."""
        slope = Laurent(self.field, 0, [self.at(k) * k for k in range(1, self.end)]) / self
        return Laurent(self.field, 1, [c / k for k, c in enumerate(slope.coefficients, 1)])

    def square_of_angle(self) -> Laurent:
        """Return the square of the angle with this cosine (1 at h = 0): ``sum 2 (2 - 2 cos)^k/(k^2 C(2k, k))``."""
        y: Laurent = 1.0 - self
        power, total, k = y, y * 2.0, 1
        while power.leading is not None:
            k, power = k + 1, power * y
            total = total + power * Fraction(2 ** (k + 1), k * k * math.comb(2 * k, k))
        return total


@lru_cache(maxsize=64)
def coefficients(stepper: Stepper) -> tuple[Any, Mapping[str, Any]]:
    """Return the smallest domain with all coefficients of a scheme, and the element of each formula.

    Raises ValueError if a coefficient is not algebraic.
    """
    from sympy import QQ, Pow, Rational

    def power(base: Any, exponent: Fraction) -> Any:
        return base ** Rational(exponent)

    expressions = {formula: exact(formula, Rational, power) for formula in reads(stepper)}
    roots = sorted({power for value in expressions.values() for power in value.atoms(Pow)}, key=str)
    domain = QQ.algebraic_field(*roots) if roots else QQ
    return domain, {
        formula: domain.from_sympy(value.expand()) for formula, value in expressions.items()
    }


def in_reals(domain: Any, elements: Mapping[str, Any]) -> tuple[Any, Mapping[str, Any]]:
    """Return the real numbers, and the `coefficients` of a scheme among them."""
    from sympy import RealField

    reals = RealField(_BITS)
    exact = {formula: domain.to_sympy(element) for formula, element in elements.items()}
    return reals, {formula: reals.from_sympy(value.evalf(40)) for formula, value in exact.items()}


def _solved(
    x: Any, u: Any, d_u: Any, v: Any, d_v: Any, t: Any, p: Any, acceleration: Any, slopes: Any
) -> Any:
    """Solve the equation of `vibsim.schemes.newton.solved` as a series."""
    while True:
        before, x = x, acceleration(u + d_u * x, v + d_v * x, t, p)
        if (x - before).leading is None:
            return x


def _solved_together(
    x: Any, y: Any, u: Any, d_u: Any, v: Any, d_v: Any, t: Any, p: Any, acceleration: Any, slopes: Any
) -> Any:  # fmt: skip
    """Solve the equations of `vibsim.schemes.newton.solved_together` as series."""
    while True:
        before = x, y
        u_1, u_2 = u[0] + (d_u[0] * x + d_u[1] * y), u[1] + (d_u[2] * x + d_u[3] * y)
        v_1, v_2 = v[0] + (d_v[0] * x + d_v[1] * y), v[1] + (d_v[2] * x + d_v[3] * y)
        x, y = acceleration(u_1, v_1, t[0], p), acceleration(u_2, v_2, t[1], p)
        if all((a - b).leading is None for a, b in zip(before, (x, y), strict=True)):
            return x, y


SUBSTITUTES: Mapping[Callable[..., Any], Callable[..., Any]] = {
    solved: _solved,
    solved_together: _solved_together,
    ELEMENTARY["sqrt"].full: lambda x: x**HALF,
}
"""Replacements on series for functions that only run on floats."""
