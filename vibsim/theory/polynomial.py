r"""A scheme's own functions on a motion that is a polynomial, ``u_e = c_0 + c_1 t + ... + c_d t^d``, in exact numbers.

To the acceleration ``a(u, v, t)`` of a model the force is added that makes u_e a solution (a manufactured solution):
``u_e''(t) - a(u_e(t), u_e'(t), t)``. All numbers are series in dt (`vibsim.theory.laurent`), with a coefficient for
every c_k, every parameter of the formula and the time t, or with values for all of them.

The equation of an implicit step is solved by what Newton's method stands for: ``x = a(u + d_u x, v + d_v x, t)`` is put
into itself until x stays. The factors d_u and d_v begin with dt, so that every turn settles one more power, and the
series is the one solution near the present acceleration. Square roots are series likewise.

Source: vibration text (B), sections 2.2 and 8.5, problem 1 and exercise 9.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from fractions import Fraction
from typing import Any

from vibsim.elementary import ELEMENTARY
from vibsim.formula import Expression, names_in
from vibsim.models.base import Model, tree
from vibsim.schemes.base import Stepper, handed
from vibsim.schemes.newton import solved, solved_together
from vibsim.theory.basis import rebound
from vibsim.theory.exact import coefficients
from vibsim.theory.laurent import Field, Laurent
from vibsim.theory.rational import (
    COEFFICIENTS,
    FREQUENCY,
    in_series,
    names_of,
    restoring,
    symbol,
)


class Forces(IntEnum):
    """Which forces of a model act beside the one that makes the polynomial a solution."""

    NONE = 0
    AT_REST = 1
    """Those on a body at rest: all but damping."""
    ALL = 2


@dataclass(frozen=True, eq=False)
class Setting:
    """A field of numbers, and the elements of it that stand for names."""

    field: Field
    numbers: Mapping[str, Any]
    """Elements for those of `names_of`."""
    read: Callable[[str], Any]
    """Makes an element of the formula of a scheme's coefficient."""

    def named(self, name: str) -> Laurent:
        """Return what stands for a name."""
        return self.field.series(self.numbers[name])


@dataclass(frozen=True, eq=False)
class Course:
    """A scheme on a model, with a polynomial as its solution."""

    stepper: Stepper
    model: Model
    degree: int
    setting: Setting
    forces: Forces = Forces.ALL
    fitted: Laurent | None = None
    """What is added to the acceleration in steps, but not in the start."""

    @property
    def dt(self) -> Laurent:
        """The time step."""
        field = self.setting.field
        return field.series(field.number(Fraction(1)), 1)

    def solution(self, derivative: int, t: Any) -> Any:
        """Return a derivative of the polynomial at time t."""
        result = self.setting.field.constant(0.0)
        for k in range(self.degree, derivative - 1, -1):
            factor = 1
            for j in range(derivative):
                factor *= k - j
            result = result * t + self.setting.named(self._symbol(COEFFICIENTS, k)) * float(factor)
        return result

    def state(self, t: Any) -> tuple[Any, ...]:
        """Return the state at time t that moves along the polynomial."""
        u, v, a = (lambda time, k=k: self.solution(k, time) for k in range(3))
        return tuple(self.stepper.carried(u, v, a, t, self.dt))

    def start(self) -> tuple[Any, ...]:
        """Return the state at step 1, from the polynomial's position and velocity at t = 0."""
        zero = self.setting.field.constant(0.0)
        u, v = (self.solution(k, zero) for k in (0, 1))
        _, push = self._scaling()
        function = self._ready(self.stepper.start, None)
        return tuple(function(self.stepper.variant, u, v * push, self.dt, ()))

    def step(self, state: tuple[Any, ...], t: Any) -> tuple[Any, ...]:
        """Return the state one step after time t."""
        following, _ = self._ready(self.stepper.step, self.fitted)(state, t, self.dt, ())
        return tuple(following)

    def _ready(self, function: Callable[..., Any], more: Laurent | None) -> Callable[..., Any]:
        """Return a function of the scheme on series, handed the forces."""
        own = rebound(function, self._coefficient, SUBSTITUTES)
        force, _ = self._scaling()

        def acceleration(u: Any, v: Any, t: Any, p: Any) -> Any:
            exact = self._of_model(self.solution(0, t), self.solution(1, t), t)
            total = self._of_model(u, v, t) + (self.solution(2, t) - exact)
            return (total if more is None else total + more) * force

        def slopes(u: Any, v: Any, t: Any, p: Any) -> Any:
            raise ValueError("what solves the equation of a step by series asks for no slopes")

        def rate(u: Any, v: Any, t: Any, p: Any) -> Any:
            damping = self.model.damping
            is_damped = damping is not None and self.forces is Forces.ALL
            return self._value(tree(self.model, damping.rate), {}) if damping and is_damped else 0.0

        return handed(own, acceleration, slopes, rate)

    def _of_model(self, u: Any, v: Any, t: Any) -> Any:
        if self.forces is Forces.NONE:
            return self.setting.field.constant(0.0)
        position, velocity = (state.name for state in self.model.states)
        speed = v if self.forces is Forces.ALL else 0.0
        return self._value(restoring(self.model), {position: u, velocity: speed, "t": t})

    def _value(self, node: Expression, given: Mapping[str, Any]) -> Any:
        field = self.setting.field
        rest = {n: self.setting.named(n) for n in names_in(node) if n not in given}
        exact = {n: x if isinstance(x, Laurent) else field.constant(x) for n, x in given.items()}
        return in_series(node, {**rest, **exact}, field)

    def _coefficient(self, formula: str) -> Laurent:
        return self.setting.field.series(self.setting.read(formula))

    def _scaling(self) -> tuple[Any, Any]:
        scaling: Callable[[Any], tuple[Any, ...]] | None = self.stepper.scaling
        if scaling is None:
            return 1.0, 1.0
        force, push = scaling(self.setting.named(self._symbol(FREQUENCY, 0)) * self.dt)
        return force, push

    def _symbol(self, letter: str, k: int) -> str:
        return symbol(self.model, letter, k)


def _solved(
    x: Any, u: Any, d_u: Any, v: Any, d_v: Any, t: Any, p: Any, acceleration: Any, slopes: Any
) -> Any:
    """Return what `vibsim.schemes.newton.solved` does, as a series."""
    while True:
        before, x = x, acceleration(u + d_u * x, v + d_v * x, t, p)
        if (x - before).leading is None:
            return x


def _solved_together(
    x: Any,
    y: Any,
    u: Any,
    d_u: Any,
    v: Any,
    d_v: Any,
    t: Any,
    p: Any,
    acceleration: Any,
    slopes: Any,
) -> Any:
    """Return what `vibsim.schemes.newton.solved_together` does, as series."""
    while True:
        before = x, y
        places = (
            (
                u[i] + (d_u[2 * i] * x + d_u[2 * i + 1] * y),
                v[i] + (d_v[2 * i] * x + d_v[2 * i + 1] * y),
            )
            for i in range(2)
        )
        x, y = (acceleration(*place, time, p) for place, time in zip(places, t, strict=True))
        if all((a - b).leading is None for a, b in zip(before, (x, y), strict=True)):
            return x, y


SUBSTITUTES: Mapping[Callable[..., Any], Callable[..., Any]] = {
    solved: _solved,
    solved_together: _solved_together,
    ELEMENTARY["sqrt"].full: Laurent.root,
}
"""What runs on series in place of functions that only run on floats."""


def sample(names: Iterable[str]) -> dict[str, Fraction]:
    """Return a positive value for each name, none of them a simple ratio of the others."""
    primes = (7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89, 97)
    return {
        name: Fraction(primes[i % 22], primes[(i + 5) % 22] + i // 22)
        for i, name in enumerate(names)
    }


def numbers(stepper: Stepper, model: Model, degree: int, known: int) -> Setting:
    """Return a setting in which every name has a value (`sample`)."""
    domain, elements = coefficients(stepper)

    def number(fraction: Fraction) -> Any:
        return domain.convert(fraction.numerator) / domain.convert(fraction.denominator)

    field = Field(number, lambda x: float(domain.to_sympy(x)), known)
    values = {name: number(x) for name, x in sample(names_of(model, degree)).items()}
    return Setting(field, values, elements.__getitem__)


def symbols(stepper: Stepper, model: Model, degree: int, known: int) -> Setting:
    """Return a setting in which every name is a symbol; signs are those of `numbers`."""
    from sympy import field as fractions_of

    domain, elements = coefficients(stepper)
    names = names_of(model, degree)
    fractions, *generators = fractions_of(names, domain)

    def number(fraction: Fraction) -> Any:
        return fractions.ground_new(
            domain.convert(fraction.numerator) / domain.convert(fraction.denominator)
        )

    values = list(zip(fractions.ring.gens, sample(names).values(), strict=True))

    def value(element: Any) -> float:
        parts = (part.evaluate(values) for part in (element.numer, element.denom))
        above, below = (float(domain.to_sympy(domain.convert(part))) for part in parts)
        return above / below

    field = Field(number, value, known)
    named = dict(zip(names, generators, strict=True))
    return Setting(field, named, lambda formula: fractions.ground_new(elements[formula]))
