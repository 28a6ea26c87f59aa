r"""Characteristic scales of ``m u'' + f(u') + s(u) = F(t)``, and the dimensions of its parameters.

With ``k = s'(0)`` (vibration text (B), section 10.2) ``t_c = sqrt(m/k)``; ``u_c = A/k`` under a force
``A sin(phi t)``, else the initial amplitude; ``E_c = k u_c^2``. With them ``u'' + 2 beta |u'| u' + u = sin(gamma t)``,
equation (85): ``beta = b u_c/(2 m) = A b/(2 m k)`` and ``gamma = phi t_c``; of linear damping, ``u'' + 2 beta u' + u``,
it is ``beta = b t_c/(2 m) = b/(2 sqrt(m k))``.

The equation is a sum of forces, all terms of a sum have the same dimension, and the argument of a sine has none. These
are linear equations for the exponents of mass, position and time in the dimension of each parameter; they are solved
exactly. A parameter divided by these powers of the scales is the parameter of the scaled equation, which has the same
formulas (sections 10.1 and 10.2). A number in a formula is dimensionless: if it stands for a quantity with a dimension,
as in ``u + 0.1*u**3``, there is no scaled equation until it becomes a parameter.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import TYPE_CHECKING

from vibsim.formula import (
    ONE,
    ZERO,
    Binary,
    Call,
    Compare,
    Expression,
    ExpressionError,
    Name,
    Negate,
    Number,
    derivative,
    is_zero,
    literal,
    parse,
    put,
    tidied,
    to_formula,
)
from vibsim.models.base import Formula, Parameter
from vibsim.models.shared.scales import T_C, X_C, Scales

if TYPE_CHECKING:
    from vibsim.models.shared.mechanical import Forces

TWO = Number(2.0)
Powers = tuple[int, int, int]
"""Exponents of mass, position and time."""
FORCE: Powers = (1, 1, -2)
SAME_DIMENSION = frozenset({"abs", "max", "min", "mod", "hypot"})
"""Functions whose arguments and value share one dimension."""
FREE = frozenset({"sign", "heaviside", "atan2"})
"""Functions with a dimensionless value, whose arguments share any dimension."""


def linear_scales(forces: Forces) -> Scales | None:
    """Return the scales of an oscillator; None if its spring has no stiffness at rest."""
    m, k = forces.mass, stiffness_at_rest(forces)
    if k is None:
        return None
    driven = amplitude_and_frequency(forces.force)
    if driven is None:
        # without an initial position the amplitude is V t_c
        u, v = Name(forces.position), Name(forces.velocity)
        size: Expression = Call("where", (Compare("!=", u, ZERO), _size(u), _size(v) * T_C))
    else:
        size = _size(driven[0]) / k
    numbers: dict[str, Formula] = {}
    if forces.known_damping is not None:
        kind, b = forces.known_damping
        numbers["beta"] = b * (T_C if kind == "linear" else X_C) / (TWO * m)
    if driven is not None:
        numbers["gamma"] = driven[1] * T_C
    energy = k * Binary("**", X_C, TWO)
    return Scales(_time_scale(m, k), size, energy, tuple(numbers.items()))


def _time_scale(mass: Expression, stiffness: Expression) -> Expression:
    return Call("sqrt", (mass / stiffness,))


def stiffness_at_rest(forces: Forces) -> Expression | None:
    """Return the stiffness at u = 0, a formula in the parameters; None if it is 0 or undefined."""
    try:
        slope = tidied(put(forces.stiffness, forces.position, ZERO))
    except ExpressionError:
        return None
    return None if is_zero(slope) else slope


def with_scaled_run(
    scales: Scales, forces: Forces, parameters: tuple[Parameter, ...], stated: Mapping[str, Powers]
) -> Scales:
    """Return the scales with the parameters of the scaled equation, or with the reason why there are none.

    Scaled parameters that `scales` already has are kept. `stated` gives the exponents of mass, position and time of
    some parameters; those of the others follow from the forces.
    """
    known = {forces.position: (0, 1, 0), forces.velocity: (0, 1, -1), "t": (0, 0, 1), **stated}
    known |= dict.fromkeys(forces.mass.names, (1, 0, 0))
    terms = tuple(
        term for term in (forces.spring, forces.damping, forces.force) if not is_zero(term)
    )
    try:
        exponents = powers(terms, known, tuple(row.name for row in parameters))
    except DimensionError as error:
        rule = (
            f"{error} has a number in the place of a parameter: its terms cannot have one dimension"
        )
        return replace(scales, refusal=rule)
    units = forces.mass, X_C, T_C
    exactly = _exactly(forces, scales) | dict(scales.parameters or ())
    scaled = (
        (row.key, exactly.get(row.name) or over_scales(row.name, exponents[row.name], units))
        for row in parameters
    )
    return replace(scales, parameters=tuple(scaled))


def _exactly(forces: Forces, scales: Scales) -> dict[str, Formula]:
    """Return scaled parameters that are 1 or -1 by definition, so that no quotient rounds them."""
    exact: dict[str, Formula] = dict.fromkeys(forces.mass.names, ONE)
    stiffness = stiffness_at_rest(forces)
    if stiffness is None or scales.time != _time_scale(forces.mass, stiffness):
        return exact
    match stiffness:
        case Name(name) | Binary("/", Number(1.0), Name(name)):
            exact[name] = ONE
    driven = amplitude_and_frequency(forces.force)
    if driven is not None and isinstance(driven[0], Name):
        exact[driven[0].name] = Call("sign", (driven[0],))
    return exact


def amplitude_and_frequency(force: Expression) -> tuple[Expression, Expression] | None:
    """Return A and phi of a force ``A sin(phi t)`` or ``A cos(phi t)``; None for any other force."""
    amplitude = ONE
    frequency: Expression | None = None
    parts = [force]
    while parts:
        part = parts.pop(0)
        match part:
            case Binary("*", left, right):
                parts[:0] = [left, right]
            case Negate(operand):
                parts[:0] = [operand]
            case _ if "t" not in part.names:
                amplitude *= part
            case Call("sin" | "cos", (argument,)) if frequency is None:
                frequency = derivative(argument, "t")
            case _:
                return None
    return None if frequency is None or "t" in frequency.names else (amplitude, frequency)


def _size(node: Expression) -> Expression:
    number = literal(node)
    return Call("abs", (node,)) if number is None else Number(abs(number))


class DimensionError(ValueError):
    """Terms of one sum cannot have the same dimension."""


Dimension = Mapping[str, Fraction]
"""Exponents of `BASES` and of unknown dimensions, which have the names of their parameters."""
BASES = ("@mass", "@position", "@time")
NONE: Dimension = {}


def _product(left: Dimension, right: Dimension, power: Fraction = Fraction(1)) -> Dimension:
    """Return the dimension of `left` times a power of `right`."""
    sums = {
        name: left.get(name, Fraction(0)) + power * right.get(name, Fraction(0))
        for name in {**left, **right}
    }
    return {name: total for name, total in sums.items() if total}


def _known(powers: Powers) -> Dimension:
    return dict(zip(BASES, map(Fraction, powers), strict=True))


@dataclass
class Equations:
    """Linear equations for unknown dimensions, solved one by one as they are added."""

    known: dict[str, Dimension]
    """Dimensions that are given, by name."""
    solved: dict[str, Dimension] = field(default_factory=dict)
    """Solved unknowns, each in terms of the unsolved ones."""
    fresh: int = 0
    """Number of unknown dimensions of the number 0."""

    def reduced(self, dimension: Dimension) -> Dimension:
        """Return a dimension in terms of the unsolved unknowns."""
        for name, power in dimension.items():
            if name in self.solved:
                others = {other: p for other, p in dimension.items() if other != name}
                return self.reduced(_product(others, self.solved[name], power))
        return dimension

    def equal(self, left: Dimension, right: Dimension, node: Expression) -> None:
        """Require that two dimensions are equal; raise DimensionError with `node` if they cannot be."""
        quotient = dict(self.reduced(_product(left, right, Fraction(-1))))
        name = next((name for name in quotient if name not in BASES), None)
        if name is not None:
            power = quotient.pop(name)
            self.solved[name] = _product(NONE, quotient, -1 / power)
            for key, value in self.solved.items():
                self.solved[key] = self.reduced(value)
        elif quotient:
            raise DimensionError(to_formula(node))

    def of(self, node: Expression) -> Dimension:
        """Return the dimension of a formula, and add the equations that it implies."""
        match node:
            case Number(value):
                if value:
                    return NONE
                # the number 0 fits any dimension: an unknown of its own
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
            case Call(function, arguments) if function in SAME_DIMENSION | FREE:
                dimension = self._alike(arguments, node)
                return dimension if function in SAME_DIMENSION else NONE
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
    """Return the exponents of mass, position and time in the dimensions of parameters, from formulas of forces.

    Raises DimensionError with the subexpression whose terms cannot have the same dimension.

    Parameters
    ----------
    known
        Exponents for the states, ``t`` and some parameters.
    names
        The parameters. If the formulas do not determine all dimensions, as those of two factors of a product, the first
        parameters have dimensions and the others are dimensionless.
    """
    equations = Equations({name: _known(value) for name, value in known.items()})
    for formula in formulas:
        equations.equal(equations.of(formula), _known(FORCE), formula)
    dimensions = (equations.reduced(equations.of(Name(name))) for name in names)
    return {
        name: tuple(dimension.get(base, Fraction(0)) for base in BASES)
        for name, dimension in zip(names, dimensions, strict=True)
    }


def over_scales(
    name: str, power: tuple[Fraction, ...], scales: tuple[Expression, ...]
) -> Expression:
    """Return a parameter divided by powers of the scales of mass, position and time."""
    scaled: Expression = Name(name)
    for scale, exponent in zip(scales, power, strict=True):
        factor, size = scale, abs(exponent)
        if size.denominator != 1:
            factor = Binary("**", scale, parse(f"{size.numerator}/{size.denominator}", ()))
        elif size != 1:
            factor = Binary("**", scale, Number(float(size)))
        if exponent:
            scaled = scaled / factor if exponent > 0 else scaled * factor
    return scaled
