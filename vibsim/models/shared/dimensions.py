r"""What dimensions the parameters of an equation of motion have: powers of a mass, of a position and of a time.

``m u'' + f(u') + s(u) = F(t)`` is an equation between forces, so that every sum in it has terms of one dimension, and
what a sine is taken of has none. These are linear equations for the powers that each parameter has of the scales of
mass, position and time; they are solved exactly. A parameter over these powers of the scales is the one of the scaled
equation, which has the same formulas (vibration text (B), sections 10.1 and 10.2).

A number in a formula has no dimension: where it takes the place of one, ``u + 0.1*u**3``, there is no scaled equation
until it gets a name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from vibsim.formula import (
    Binary,
    Call,
    Compare,
    Expression,
    Name,
    Negate,
    Number,
    literal,
    over,
    times,
    to_formula,
)
from vibsim.formula.parser import parse

Powers = tuple[int, int, int]
"""Of mass, position and time."""
FORCE: Powers = (1, 1, -2)
ALIKE = frozenset({"abs", "max", "min", "mod", "hypot"})
"""Functions whose arguments and value have one dimension."""
FREE = frozenset({"sign", "heaviside", "atan2"})
"""Functions without a dimension, whose arguments have any, but all the same one."""


class DimensionError(ValueError):
    """Terms of one sum cannot have the same dimension."""


@dataclass(frozen=True)
class Dimension:
    """A sum over unknown dimensions with factors, and a known one."""

    unknown: Mapping[str, Fraction] = field(default_factory=dict)
    known: tuple[Fraction, ...] = (Fraction(0),) * 3

    def plus(self, other: Dimension, factor: Fraction = Fraction(1)) -> Dimension:
        """Return the dimension of the product with a power of another."""
        names = {**self.unknown, **other.unknown}
        unknown = {
            name: total
            for name in names
            if (
                total := self.unknown.get(name, Fraction(0))
                + factor * other.unknown.get(name, Fraction(0))
            )
        }
        pairs = zip(self.known, other.known, strict=True)
        return Dimension(unknown, tuple(a + factor * b for a, b in pairs))


NONE = Dimension()


def _known(powers: Powers) -> Dimension:
    return Dimension({}, tuple(map(Fraction, powers)))


@dataclass
class Equations:
    """Linear equations for unknown dimensions, kept solved: each unknown by those that are left."""

    known: dict[str, Dimension]
    """Dimensions of names that are given."""
    solved: dict[str, Dimension] = field(default_factory=dict)
    fresh: int = 0

    def reduced(self, found: Dimension) -> Dimension:
        """Return a dimension in the unknowns that are left."""
        for name, factor in found.unknown.items():
            if name in self.solved:
                without = {other: f for other, f in found.unknown.items() if other != name}
                rest = Dimension(without, found.known).plus(self.solved[name], factor)
                return self.reduced(rest)
        return found

    def equal(self, left: Dimension, right: Dimension, node: Expression) -> None:
        """Demand that two dimensions are one.

        Raises
        ------
        DimensionError
            Where they cannot be.
        """
        rest = self.reduced(left.plus(right, Fraction(-1)))
        if not rest.unknown:
            if any(rest.known):
                raise DimensionError(to_formula(node))
            return
        name, factor = next(iter(rest.unknown.items()))
        others = Dimension({key: f for key, f in rest.unknown.items() if key != name}, rest.known)
        self.solved[name] = NONE.plus(others, -1 / factor)
        for key, value in self.solved.items():
            self.solved[key] = self.reduced(value)

    def of(self, node: Expression) -> Dimension:
        """Return the dimension of a formula, and demand what it needs to have one."""
        match node:
            case Number(value):
                return NONE if value else self.any()
            case Name(name):
                return self.known.get(name, Dimension({name: Fraction(1)}))
            case Negate(operand):
                return self.of(operand)
            case Binary("*", left, right):
                return self.of(left).plus(self.of(right))
            case Binary("/", left, right):
                return self.of(left).plus(self.of(right), Fraction(-1))
            case Binary("**", base, exponent):
                return self._power(node, base, exponent)
            case Binary(_, left, right):
                return self._alike((left, right), node)
            case Compare(_, left, right):
                self._alike((left, right), node)
                return NONE
            case Call("where", (condition, *choices)):
                self.of(condition)
                return self._alike(tuple(choices), node)
            case Call("sqrt" | "cbrt" as root, (argument,)):
                return NONE.plus(self.of(argument), Fraction(1, 2 if root == "sqrt" else 3))
            case Call(function, arguments) if function in ALIKE | FREE:
                found = self._alike(arguments, node)
                return found if function in ALIKE else NONE
            case Call(_, arguments):
                for argument in arguments:
                    self.equal(self.of(argument), NONE, node)
                return NONE
        raise AssertionError(node)

    def any(self) -> Dimension:
        """Return a dimension of its own, for the number 0: it fits any."""
        self.fresh += 1
        return Dimension({f"@{self.fresh}": Fraction(1)})

    def _alike(self, terms: tuple[Expression, ...], node: Expression) -> Dimension:
        first, *others = (self.of(term) for term in terms)
        for other in others:
            self.equal(first, other, node)
        return first

    def _power(self, node: Expression, base: Expression, exponent: Expression) -> Dimension:
        inner, number = self.of(base), literal(exponent)
        if number is not None:
            return NONE.plus(inner, Fraction(number))
        self.equal(self.of(exponent), NONE, node)
        self.equal(inner, NONE, node)
        return NONE


def powers(
    formulas: tuple[Expression, ...], known: Mapping[str, Powers], names: tuple[str, ...]
) -> dict[str, tuple[Fraction, ...]]:
    """Return the powers of the scales of mass, position and time that parameters have.

    Parameters
    ----------
    formulas
        Forces.
    known
        The powers of the states, of ``t`` and of some parameters.
    names
        The parameters that are asked for. Where the formulas leave a choice, as between the factors of a product, the
        first ones get the dimension and the others none.

    Raises
    ------
    DimensionError
        With the part of the formulas where terms of one sum cannot have the same dimension.
    """
    equations = Equations({name: _known(value) for name, value in known.items()})
    for formula in formulas:
        equations.equal(equations.of(formula), _known(FORCE), formula)
    found = (equations.reduced(equations.of(Name(name))) for name in names)
    return {name: dimension.known for name, dimension in zip(names, found, strict=True)}


def over_scales(
    name: str, power: tuple[Fraction, ...], scales: tuple[Expression, ...]
) -> Expression:
    """Return a parameter over powers of the scales of mass, position and time."""
    found: Expression = Name(name)
    for scale, exponent in zip(scales, power, strict=True):
        size = abs(exponent)
        factor = scale if size == 1 else _raised(scale, size)
        if exponent > 0:
            found = over(found, factor)
        elif exponent < 0:
            found = times(found, factor)
    return found


def _raised(scale: Expression, exponent: Fraction) -> Expression:
    if exponent.denominator == 1:
        return Binary("**", scale, Number(float(exponent)))
    return Binary("**", scale, parse(f"{exponent.numerator}/{exponent.denominator}", ()))
