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
    parse,
    times,
    to_formula,
)

Powers = tuple[int, int, int]
"""Of mass, position and time."""
FORCE: Powers = (1, 1, -2)
ALIKE = frozenset({"abs", "max", "min", "mod", "hypot"})
"""Functions whose arguments and value have one dimension."""
FREE = frozenset({"sign", "heaviside", "atan2"})
"""Functions without a dimension, whose arguments have any, but all the same one."""


class DimensionError(ValueError):
    """Terms of one sum cannot have the same dimension."""


Dimension = Mapping[str, Fraction]
"""Powers of `BASES` and of dimensions that are unknown, each by the name of a parameter."""
BASES = ("@mass", "@position", "@time")
NONE: Dimension = {}


def _product(left: Dimension, right: Dimension, power: Fraction = Fraction(1)) -> Dimension:
    """Return the dimension of a product with a power of another."""
    sums = {
        name: left.get(name, Fraction(0)) + power * right.get(name, Fraction(0))
        for name in {**left, **right}
    }
    return {name: total for name, total in sums.items() if total}


def _known(powers: Powers) -> Dimension:
    return dict(zip(BASES, map(Fraction, powers), strict=True))


@dataclass
class Equations:
    """Linear equations for unknown dimensions, kept solved: each unknown by those that are left."""

    known: dict[str, Dimension]
    """Dimensions of names that are given."""
    solved: dict[str, Dimension] = field(default_factory=dict)
    fresh: int = 0

    def reduced(self, found: Dimension) -> Dimension:
        """Return a dimension in the unknowns that are left."""
        for name, power in found.items():
            if name in self.solved:
                rest = {other: p for other, p in found.items() if other != name}
                return self.reduced(_product(rest, self.solved[name], power))
        return found

    def equal(self, left: Dimension, right: Dimension, node: Expression) -> None:
        """Demand that two dimensions are one.

        Raises
        ------
        DimensionError
            Where they cannot be.
        """
        rest = dict(self.reduced(_product(left, right, Fraction(-1))))
        name = next((name for name in rest if name not in BASES), None)
        if name is not None:
            power = rest.pop(name)
            self.solved[name] = _product(NONE, rest, -1 / power)
            for key, value in self.solved.items():
                self.solved[key] = self.reduced(value)
        elif rest:
            raise DimensionError(to_formula(node))

    def of(self, node: Expression) -> Dimension:
        """Return the dimension of a formula, and demand what it needs to have one."""
        match node:
            case Number(value):
                if value:
                    return NONE
                # the number 0 has a dimension of its own: it fits any
                self.fresh += 1
                return {f"@{self.fresh}": Fraction(1)}
            case Name(name):
                return self.known.get(name, {name: Fraction(1)})
            case Negate(operand):
                return self.of(operand)
            case Binary("*", left, right):
                return _product(self.of(left), self.of(right))
            case Binary("/", left, right):
                return _product(self.of(left), self.of(right), Fraction(-1))
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
                return _product(NONE, self.of(argument), Fraction(1, 2 if root == "sqrt" else 3))
            case Call(function, arguments) if function in ALIKE | FREE:
                found = self._alike(arguments, node)
                return found if function in ALIKE else NONE
            case Call(_, arguments):
                for argument in arguments:
                    self.equal(self.of(argument), NONE, node)
                return NONE
        raise AssertionError(node)

    def _alike(self, terms: tuple[Expression, ...], node: Expression) -> Dimension:
        first, *others = (self.of(term) for term in terms)
        for other in others:
            self.equal(first, other, node)
        return first

    def _power(self, node: Expression, base: Expression, exponent: Expression) -> Dimension:
        inner, number = self.of(base), literal(exponent)
        if number is not None:
            return _product(NONE, inner, Fraction(number))
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
    return {
        name: tuple(dimension.get(base, Fraction(0)) for base in BASES)
        for name, dimension in zip(names, found, strict=True)
    }


def over_scales(
    name: str, power: tuple[Fraction, ...], scales: tuple[Expression, ...]
) -> Expression:
    """Return a parameter over powers of the scales of mass, position and time."""
    found: Expression = Name(name)
    for scale, exponent in zip(scales, power, strict=True):
        factor, size = scale, abs(exponent)
        if size.denominator != 1:
            factor = Binary("**", scale, parse(f"{size.numerator}/{size.denominator}", ()))
        elif size != 1:
            factor = Binary("**", scale, Number(float(size)))
        if exponent:
            found = (over if exponent > 0 else times)(found, factor)
    return found
