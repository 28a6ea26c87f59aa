r"""The functions of a scheme on a polynomial motion ``u_e = c_0 + c_1 t + ... + c_d t^d``, in exact arithmetic.

The force that makes u_e a solution (a manufactured solution), ``u_e''(t) - a(u_e(t), u_e'(t), t)``, is added to the
acceleration ``a(u, v, t)`` of a model. All numbers are series in dt (`vibsim.theory.laurent`), whose coefficients
contain symbols for every c_k, every parameter of the formula and the time t, or values for all of them.

Source: vibration text (B), sections 2.2 and 8.5, problem 1 and exercise 9.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from functools import cache
from math import perm
from typing import Any

from vibsim.formula import (
    ZERO,
    Binary,
    Call,
    Expression,
    Name,
    Negate,
    Number,
    literal,
    walk,
)
from vibsim.models.base import Model, tree
from vibsim.schemes.base import Stepper, handed
from vibsim.schemes.step_numbers import counting
from vibsim.theory.basis import rebound, value_of
from vibsim.theory.laurent import SUBSTITUTES, Field, Laurent, coefficients

_COEFFICIENTS, _FREQUENCY = "c", "w"
"""Letters of the symbols c_0, c_1, ..., and of w_0, the natural frequency, which frequency correction uses."""


@cache
def restoring(model: Model) -> Expression:
    """Return the acceleration without terms that do not depend on states, which the added force cancels."""
    states = {state.name for state in model.states}

    def is_constant(node: Expression) -> bool:
        return states.isdisjoint(node.names)

    def reduced(node: Expression) -> Expression:
        match node:
            case _ if is_constant(node):
                return ZERO
            case Negate(operand):
                return Negate(reduced(operand))
            case Binary("+" | "-" as sign, left, right):
                a, b = reduced(left), reduced(right)
                return a + b if sign == "+" else a - b
            case Binary("*", left, right) if is_constant(left):
                return left * reduced(right)
            case Binary("*", left, right) if is_constant(right):
                return reduced(left) * right
            case Binary("/", left, right) if is_constant(right):
                return reduced(left) / right
        return node

    return reduced(tree(model, model.acceleration))


def is_rational(node: Expression) -> bool:
    """Tell whether a formula contains only ``+ - * /``, nonnegative integer powers and absolute values."""

    def is_known(part: Expression) -> bool:
        match part:
            case Binary("**", _, exponent):
                power = literal(exponent)
                return power is not None and power >= 0.0 and power.is_integer()
            case Number() | Name() | Negate() | Binary("+" | "-" | "*" | "/") | Call("abs"):
                return True
        return False

    return all(is_known(part) for part in walk(node))


@cache
def _symbol(model: Model, letter: str, k: int) -> str:
    """Return ``letter_k``, with the letter repeated until no name of the model begins like it: ``cc_0`` beside c_0."""
    taken = restoring(model).names
    while any(name.startswith(f"{letter}_") for name in taken):
        letter += letter[0]
    return f"{letter}_{k}"


def _names(model: Model, degree: int) -> tuple[str, ...]:
    """Return the names of everything that a residual may depend on, except dt."""
    states = {state.name for state in model.states}
    parameters = [name for name in restoring(model).names if name not in states and name != "t"]
    of_solution = (_symbol(model, _COEFFICIENTS, k) for k in range(degree + 1))
    return ("t", *of_solution, *parameters, _symbol(model, _FREQUENCY, 0))


class Forces(StrEnum):
    """The forces of a model that act beside the added one; the value is the cause of a residual that they introduce."""

    NONE = "differences"
    AT_REST = "force"
    """Forces on a body at rest: all but damping."""
    ALL = "damping"


@dataclass(frozen=True, eq=False)
class Course:
    """A scheme on a model, with a polynomial as its solution."""

    stepper: Stepper
    model: Model
    degree: int
    field: Field
    names: Mapping[str, Laurent]
    """Values of t, the coefficients of the polynomial, the parameters and the natural frequency."""
    read: Callable[[str], Laurent]
    """Function that converts the formula of a scheme's coefficient."""
    forces: Forces = Forces.ALL
    fitted: Any = 0.0
    """Acceleration that is added in steps, but not in the start."""

    @property
    def dt(self) -> Laurent:
        """The time step."""
        return self.field.series(self.field.domain.one, 1)

    def solution(self, derivative: int, t: Any) -> Any:
        """Return a derivative of the polynomial at time t."""
        result = self.field.constant(0.0)
        for k in range(self.degree, derivative - 1, -1):
            coefficient = self.names[_symbol(self.model, _COEFFICIENTS, k)]
            result = result * t + coefficient * float(perm(k, derivative))
        return result

    def state(self, t: Any) -> tuple[Any, ...]:
        """Return the state on the polynomial at time t."""
        u, v, a = (lambda time, k=k: self.solution(k, time) for k in range(3))
        return tuple(self.stepper.carried(u, v, a, t, self.dt))

    def start(self) -> tuple[Any, ...]:
        """Return the state at step 1, from the polynomial's position and velocity at t = 0."""
        zero = self.field.constant(0.0)
        u, v = (self.solution(k, zero) for k in (0, 1))
        _, push = self._scaling()
        function = self._bound(self.stepper.start, 0.0)
        return tuple(function(self.stepper.variant, u, v * push, self.dt, ()))

    def step(self, state: tuple[Any, ...], t: Any) -> tuple[Any, ...]:
        """Return the state one step after time t."""
        following, _ = self._bound(self.stepper.step, self.fitted)(state, t, self.dt, ())
        return tuple(following)

    def _bound(self, function: Callable[..., Any], more: Any) -> Callable[..., Any]:
        """Return a function of the scheme on series, bound to the forces."""
        force, _ = self._scaling()
        damping = self.model.damping if self.forces is Forces.ALL else None
        rate = self._value(tree(self.model, damping.rate), {}) if damping else 0.0

        def acceleration(u: Any, v: Any, t: Any, p: Any) -> Any:
            exact = self._of_model(self.solution(0, t), self.solution(1, t), t)
            return (self._of_model(u, v, t) + (self.solution(2, t) - exact) + more) * force

        def slopes(u: Any, v: Any, t: Any, p: Any) -> Any:
            raise ValueError("what solves the equation of a step by series asks for no slopes")

        exact_function = rebound(function, self.read, SUBSTITUTES)
        return counting(handed(exact_function, acceleration, slopes, lambda u, v, t, p: rate))

    def _of_model(self, u: Any, v: Any, t: Any) -> Any:
        if self.forces is Forces.NONE:
            return self.field.constant(0.0)
        position, velocity = (state.name for state in self.model.states)
        speed = v if self.forces is Forces.ALL else 0.0
        return self._value(restoring(self.model), {position: u, velocity: speed, "t": t})

    def _value(self, node: Expression, given: Mapping[str, Any]) -> Any:
        exact = {name: self.dt.lift(x) for name, x in given.items()}
        return value_of(node, self.field.constant, operator.pow, {**self.names, **exact})

    def _scaling(self) -> tuple[Any, Any]:
        if self.stepper.scaling is None:
            return 1.0, 1.0
        p: Any = self.names[_symbol(self.model, _FREQUENCY, 0)] * self.dt
        force, push = self.stepper.scaling(p)
        return force, push


def _samples(model: Model, degree: int) -> dict[str, Fraction]:
    """Return a positive value for each name; no value is a simple ratio of others."""
    primes = (7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89, 97)
    return {
        name: Fraction(primes[i % 22], primes[(i + 5) % 22] + i // 22)
        for i, name in enumerate(_names(model, degree))
    }


def with_numbers(stepper: Stepper, model: Model, degree: int, known: int) -> Course:
    """Return a course in which every name has a value, with series truncated at the power `known` of dt."""
    domain, elements = coefficients(stepper)
    field = Field(domain, known)
    names = {name: field.constant(x) for name, x in _samples(model, degree).items()}
    return Course(stepper, model, degree, field, names, lambda f: field.series(elements[f]))


def with_symbols(stepper: Stepper, model: Model, degree: int, known: int) -> Course:
    """Return a course in which every name is a symbol; signs are those of `with_numbers`."""
    from sympy import field as fractions_of

    domain, elements = coefficients(stepper)
    samples = _samples(model, degree)
    fractions, *generators = fractions_of(tuple(samples), domain)
    values = list(zip(fractions.ring.gens, samples.values(), strict=True))

    def at_samples(element: Any) -> float:
        parts = (part.evaluate(values) for part in (element.numer, element.denom))
        numerator, denominator = (float(domain.to_sympy(domain.convert(part))) for part in parts)
        return numerator / denominator

    field = Field(fractions.to_domain(), known, at_samples)
    names = {name: field.series(x) for name, x in zip(samples, generators, strict=True)}

    def read(formula: str) -> Laurent:
        return field.series(fractions.ground_new(elements[formula]))

    return Course(stepper, model, degree, field, names, read)
