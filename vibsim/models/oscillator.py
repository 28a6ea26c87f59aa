r"""The general oscillator, ``m u'' + f(u') + s(u) = F(t)``, from formulas that a user writes.

Source: vibration text (B), section 8, equation (59), and exercises 1, 9 and 10.2. Units: m [kg], u [m], v [m s-1], f, s
and F [N]; energy ``m v^2/2 + V(u)`` [J] with V the integral of s from 0. With m = 1 and numbers without units all of
them are dimensionless.

The damping f is a formula in v, linear (``b v``) or quadratic (``b |v| v``, B section 8.2), whatever way it is written:
schemes that treat these two in their own way recognise them. Coulomb friction, ``{coulomb: b}``, holds the body where
``|F - s| <= b`` (`vibsim.models.events`; B, section 10.3); as a formula, ``b sign(v)``, it is a force like any other.

Instead of the force, an exact solution u_e(t) may be written: the force is then ``F = m u_e'' + f(u_e') + s(u_e)`` (a
manufactured solution; B, section 2.2 and exercise 9), and the motion starts on it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import islice
from typing import Any

import numpy as np

from vibsim.expression import (
    Binary,
    Call,
    Compare,
    Expression,
    ExpressionError,
    Name,
    Negate,
    Number,
    derivative,
    integral,
    literal,
    names_in,
    parse,
    rebuilt,
    to_formula,
    values,
    walk,
)
from vibsim.models.base import (
    Damping,
    Floats,
    FormulaField,
    Model,
    Numbers,
    Parameter,
    State,
)
from vibsim.models.dry_friction import friction_motion
from vibsim.models.events import Friction
from vibsim.models.harmonic import damped_motion, period

STATES = (State("u", "m", "displacement"), State("v", "m s-1", "velocity"))
MASS = Parameter("m", 1.0, "kg", "mass", minimum=0.0, exclusive=True)
COULOMB = "coulomb"
TERMS = {"linear": "b*v", "quadratic": "b*abs(v)*v", COULOMB: "b*sign(v)"}
UNITS = {"linear": "kg s-1", "quadratic": "kg m-1", COULOMB: "N"}
ZERO = Number(0.0)
MAX_NODES = 20_000
"""Longest force of an exact solution, in operations and names."""

FORMULAS = (
    FormulaField(
        "spring", ("u",), "u", "force s(u) of the spring [N], positive where it pulls back"
    ),
    FormulaField(
        "damping", ("v",), "0", "damping force f(v) [N], positive where it opposes v > 0", TERMS
    ),
    FormulaField("force", ("t",), "0", "driving force F(t) [N]"),
    FormulaField("exact", ("t",), "", "exact solution u(t) [m], from which the force then follows"),
    FormulaField(
        "potential",
        ("u",),
        "",
        "potential energy V(u) [J], where it cannot be found from the spring",
    ),
)


@dataclass(frozen=True)
class Written:
    """The formulas of a user, read."""

    formulas: Mapping[str, str]
    declared: tuple[str, ...]

    @property
    def is_coefficient_given(self) -> bool:
        """Whether the damping is a term with the coefficient b."""
        return self.formulas.get("damping") in TERMS.values() and "b" not in self.declared

    @property
    def has_friction(self) -> bool:
        """Whether the damping is Coulomb friction."""
        return self.is_coefficient_given and self.formulas["damping"] == TERMS[COULOMB]

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Every parameter, in the order of the engine."""
        own = [MASS]
        if self.is_coefficient_given:
            kind = next(name for name, text in TERMS.items() if text == self.formulas["damping"])
            words = f"coefficient of the {kind} damping"
            least = 0.0 if kind == COULOMB else None
            own.append(Parameter("b", 0.0, UNITS[kind], words, least, path=f"damping.{kind}"))
        more = (
            Parameter(name, 0.0, "1", f"declared parameter {name}", path=f"parameters.{name}")
            for name in self.declared
        )
        return (*own, *more)

    def read(self, name: str) -> Expression:
        """Return a formula; that of a field which was not written is its default."""
        field = next(field for field in FORMULAS if field.name == name)
        known = (*field.names, *(row.name for row in self.parameters))
        return parse(self.formulas.get(name, field.default), known)

    def numbers(self, parameters: Numbers) -> dict[str, Any]:
        """Return the values of the parameters by the names that formulas use."""
        return {row.name: parameters[row.key] for row in self.parameters}

    @cached_property
    def spring(self) -> Expression:
        """The force s(u)."""
        return self.read("spring")

    @cached_property
    def damping(self) -> Expression:
        """The force f(v)."""
        return self.read("damping")

    @cached_property
    def exact(self) -> Expression | None:
        """The exact solution u(t), where it is written."""
        return self.read("exact") if "exact" in self.formulas else None

    @cached_property
    def force(self) -> Expression:
        """The force F(t), as written or that of the exact solution."""
        if self.exact is None:
            return self.read("force")
        speed = derivative(self.exact, "t")
        self.refuse_long(speed, MAX_NODES // 10)
        inertia = _times(Name("m"), derivative(speed, "t"))
        rest = _plus(put(self.damping, "v", speed), put(self.spring, "u", self.exact))
        self.refuse_long(inertia, MAX_NODES)
        self.refuse_long(rest, MAX_NODES)
        return _plus(inertia, rest)

    def refuse_long(self, node: Expression, most: int) -> None:
        """Refuse an exact solution whose derivatives are too long to be worked with."""
        if sum(1 for _ in islice(walk(node), most + 1)) > most:
            rule = "its derivatives are too long to be written out as a force"
            raise ExpressionError(self.formulas["exact"], 0, rule, "write a simpler formula")

    @cached_property
    def stiffness(self) -> Expression:
        """Slope of the spring, ds/du."""
        return derivative(self.spring, "u")

    @property
    def is_linear(self) -> bool:
        """Whether s(u) is a number times u."""
        return is_multiple(self.spring, self.stiffness, "u")

    def is_zero(self, node: Expression) -> bool:
        """Whether a formula is the number 0."""
        return node in (ZERO, Negate(ZERO))


def put(node: Expression, name: str, what: Expression) -> Expression:
    """Return a formula with another one in the place of a name."""
    return rebuilt(node, lambda part: what if part == Name(name) else part)


def is_multiple(node: Expression, slope: Expression, name: str) -> bool:
    """Whether a formula with that derivative is a factor times `name`, whatever the parameters."""
    jumps = (part for part in walk(node) if isinstance(part, Compare) or _is_call(part, "sign"))
    # the derivative of a jump is 0
    if name in names_in(slope) or any(name in names_in(part) for part in jumps):
        return False
    return _is_zero_with(node, name)


def _is_zero_with(node: Expression, name: str) -> bool:
    """Whether a formula is seen to be 0 where `name` is."""
    match node:
        case Number(value):
            return value == 0.0
        case Name(own):
            return own == name
        case Negate(operand) | Binary("/", operand, _):
            return _is_zero_with(operand, name)
        case Binary("*", left, right):
            return _is_zero_with(left, name) or _is_zero_with(right, name)
        case Binary("+" | "-", left, right) | Call("where", (_, left, right)):
            return _is_zero_with(left, name) and _is_zero_with(right, name)
        case Binary("**", base, exponent):
            return (literal(exponent) or 0.0) > 0.0 and _is_zero_with(base, name)
        case _:
            return False


def _is_call(node: Expression, function: str) -> bool:
    return isinstance(node, Call) and node.function == function


def damping_of(node: Expression) -> tuple[str, Expression] | None:
    """Return kind and coefficient of a linear or a quadratic damping force; None for any other one."""
    slope = derivative(node, "v")
    if is_multiple(node, slope, "v"):
        return "linear", slope
    factors = list(_factors(node))
    speed, size = Name("v"), Call("abs", (Name("v"),))
    if factors.count(speed) != 1 or factors.count(size) != 1:
        return None
    rest = [factor for factor in factors if factor not in (speed, size)]
    if any("v" in names_in(factor) for factor in rest):
        return None
    rate: Expression = Number(1.0)
    for factor in rest:
        rate = _times(rate, factor)
    return "quadratic", rate


def _factors(node: Expression) -> list[Expression]:
    if isinstance(node, Binary) and node.operator == "*":
        return [*_factors(node.left), *_factors(node.right)]
    if isinstance(node, Binary) and node.operator == "/":
        return [*_factors(node.left), Binary("/", Number(1.0), node.right)]
    if isinstance(node, Negate) and node.operand != Number(1.0):
        return [Negate(Number(1.0)), *_factors(node.operand)]
    return [node]


def _times(left: Expression, right: Expression) -> Expression:
    if ZERO in (left, right):
        return ZERO
    return right if left == Number(1.0) else Binary("*", left, right)


def _plus(left: Expression, right: Expression) -> Expression:
    if left == ZERO:
        return right
    return left if right == ZERO else Binary("+", left, right)


def _minus(left: Expression, right: Expression) -> Expression:
    if right == ZERO:
        return left
    return Negate(right) if left == ZERO else Binary("-", left, right)


def _over_mass(node: Expression) -> Expression:
    """Return ``(1/m) node``: the quotient of parameters is worked out once."""
    inverse = Binary("/", Number(1.0), Name("m"))
    if isinstance(node, Negate):
        return Negate(Binary("*", inverse, node.operand))
    return ZERO if node == ZERO else Binary("*", inverse, node)


def written(formulas: Mapping[str, str], declared: tuple[str, ...]) -> Model:
    """Return the model of formulas by the names of `FORMULAS`, with declared parameters.

    Equal formulas give the same model.

    Raises
    ------
    ExpressionError
        Where a formula names something else than its field allows, or an exact solution has derivatives that are too
        long.
    """
    return _written(tuple(sorted(formulas.items())), declared)


@cache
def _written(formulas: tuple[tuple[str, str], ...], declared: tuple[str, ...]) -> Model:
    own = Written(dict(formulas), declared)
    known = None if own.has_friction else damping_of(own.damping)
    undamped = _over_mass(_minus(own.force, own.spring))
    acceleration = _over_mass(_minus(_minus(own.force, own.damping), own.spring))
    is_damped, is_driven = not own.is_zero(own.damping), not own.is_zero(own.force)
    potential = own.read("potential") if "potential" in own.formulas else integral(own.spring, "u")

    def natural_frequency(parameters: Numbers) -> Any:
        """Return ``sqrt(s'(0)/m)`` [rad s-1]; NaN where the spring does not pull back from 0."""
        numbers = own.numbers(parameters)
        stiffness = values(own.stiffness, {**numbers, "u": 0.0})
        with np.errstate(invalid="ignore"):
            ratio = stiffness / numbers["m"]
            return np.sqrt(np.where(ratio > 0.0, ratio, np.nan))

    damping = None
    if is_damped and known is not None:
        kind, rate = known
        damping = Damping(
            kind="linear" if kind == "linear" else "quadratic",
            rate=_over_mass(rate),
            undamped=undamped,
        )
    exact, start = _exact(own, natural_frequency, is_driven, is_damped, known)
    is_free = own.is_linear and not is_driven and not is_damped
    friction = Friction(drive=undamped, limit=_over_mass(Name("b"))) if own.has_friction else None
    return Model(
        kind="oscillator",
        title="Oscillator",
        source="vibration text, section 8, equation (59)",
        equation=_equation(own),
        states=STATES,
        parameters=own.parameters,
        acceleration=acceleration,
        kinetic_energy="0.5*m*v**2",
        potential_energy=potential,
        energy_unit="J",
        linear=own.is_linear and not own.has_friction,
        conservative=not is_damped and not is_driven,
        natural_frequency=natural_frequency,
        exact=exact,
        exact_period=(
            (lambda initial, p: period(natural_frequency(p), initial["u"], initial["v"]))
            if is_free
            else None
        ),
        start=start,
        damping=damping,
        events=friction,
        formulas=FORMULAS,
        written=written,
    )


def _exact(
    own: Written,
    natural_frequency: Any,
    is_driven: bool,
    is_damped: bool,
    known: tuple[str, Expression] | None,
) -> tuple[Any, Any]:
    """Return the exact solution, and the start that it demands; None where there is none."""
    if own.exact is not None:
        position, velocity = own.exact, derivative(own.exact, "t")

        def manufactured(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
            numbers = {**own.numbers(parameters), "t": t}
            shape = np.broadcast_shapes(*(np.shape(value) for value in numbers.values()))
            found = {"u": values(position, numbers), "v": values(velocity, numbers)}
            return {name: np.broadcast_to(x, shape) for name, x in found.items()}

        def start(parameters: Numbers) -> dict[str, Any]:
            return manufactured(np.asarray(0.0), {}, parameters)

        return manufactured, start
    if own.has_friction and own.is_linear and not is_driven:

        def held(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
            numbers = own.numbers(parameters)
            stiffness = values(own.stiffness, numbers)
            w = np.sqrt(stiffness / numbers["m"])
            u, v = friction_motion(t, w, numbers["b"] / stiffness, initial["u"], initial["v"])
            return {"u": u, "v": v}

        return held, None
    if is_driven or not own.is_linear or (is_damped and (known is None or known[0] != "linear")):
        return None, None
    rate = known[1] if is_damped and known is not None else ZERO

    def free(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
        numbers = own.numbers(parameters)
        half = 0.5 * values(rate, numbers) / numbers["m"]
        stiffness = values(own.stiffness, numbers) / numbers["m"]
        u, v = damped_motion(t, stiffness, half, initial["u"], initial["v"])
        return {"u": u, "v": v}

    return free, None


def _equation(own: Written) -> str:
    """Return the equation of motion as a user would write it."""
    terms = ["m u''"]
    if not own.is_zero(own.damping):
        terms.append(to_formula(own.damping).replace("v", "u'") if _is_plain(own) else "f(u')")
    terms.append(to_formula(own.spring))
    sides = " + ".join(terms).replace("+ -", "- ")
    told = f"{sides} = {to_formula(own.force)}" if own.exact is None else f"{sides} = F(t)"
    if "f(u')" in terms:
        told += f", f(v) = {to_formula(own.damping)}"
    if own.exact is not None:
        told += f", with F such that u = {to_formula(own.exact)}"
    return told


def _is_plain(own: Written) -> bool:
    """Whether no other name of the damping has a v in it."""
    return all(name == "v" or "v" not in name for name in names_in(own.damping))


OSCILLATOR = replace(written({}, ()), equation="m u'' + f(u') + s(u) = F(t)")
"""The model without formulas, under the equation of all."""
