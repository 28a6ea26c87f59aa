r"""From the terms of ``m u'' + f(u') + s(u) = F(t)`` to a model: acceleration, energies, powers, exact solution.

Source: vibration text (B), section 8, equation (59). A model of this form gives its four terms; everything else
follows, unless the model states it itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Literal

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.formula import (
    ONE,
    ZERO,
    Binary,
    Call,
    Expression,
    Name,
    Negate,
    Number,
    derivative,
    integral,
    is_multiple,
    is_zero,
    values,
)
from vibsim.models.base import Damping, Formula, Model, Numbers, Parameter, State, by_name
from vibsim.models.shared.linear_motion import (
    exponentials,
    forced_motion,
    is_sum_of_exponentials,
    period,
)
from vibsim.models.shared.linear_scales import Powers, linear_scales, with_scaled_run
from vibsim.models.shared.scales import Scales

STATES = (State("u", "m", "displacement"), State("v", "m s-1", "velocity"))


@dataclass(frozen=True)
class Forces:
    """The terms of the equation, in the states, ``t`` and the parameters."""

    spring: Expression
    """The force s(u)."""
    damping: Expression = ZERO
    """The force f(v)."""
    force: Expression = ZERO
    """The force F(t)."""
    mass: Expression = ONE
    potential: Expression | None = None
    """Integral of the spring force from 0; None: derived from `spring`."""
    position: str = "u"
    velocity: str = "v"

    @cached_property
    def stiffness(self) -> Expression:
        """Derivative of the spring force, ds/du."""
        return derivative(self.spring, self.position)

    @cached_property
    def is_linear(self) -> bool:
        """Whether s(u) is a number times u."""
        return is_multiple(self.spring, self.stiffness, self.position)

    @property
    def is_damped(self) -> bool:
        """Whether there is a damping force."""
        return not is_zero(self.damping)

    @property
    def is_driven(self) -> bool:
        """Whether there is a driving force."""
        return not is_zero(self.force)

    @cached_property
    def known_damping(self) -> tuple[Literal["linear", "quadratic"], Expression] | None:
        """Kind and coefficient of a linear or quadratic damping force; None for any other."""
        return damping_of(self.damping, self.velocity) if self.is_damped else None

    def over_mass(self, node: Expression) -> Expression:
        """Return ``(1/m) node``, so that the quotient of parameters is evaluated once per member."""
        if self.mass == ONE or node == ZERO:
            return node
        inverse = ONE / self.mass
        if isinstance(node, Negate):
            return Negate(Binary("*", inverse, node.operand))
        return Binary("*", inverse, node)


def mechanical(
    forces: Forces,
    parameters: tuple[Parameter, ...],
    *,
    scales: Callable[[Forces], Scales | None] = linear_scales,
    output_scales: tuple[tuple[str, Formula], ...] = (),
    powers: Mapping[str, Powers] | None = None,
    **more: Any,
) -> Model:
    """Return the model with given forces.

    Parameters
    ----------
    parameters
        Every parameter, in the order of the engine.
    scales
        Function that returns the scales from the forces; by default those of a linear spring.
    output_scales
        Scales of the outputs.
    powers
        Powers of mass, position and time of parameters whose dimension does not follow from the forces.
    more
        Further fields of `Model`; they override those that follow from the forces.
    """
    velocity = Name(forces.velocity)
    base = scales(forces)
    is_free = not forces.is_driven and not forces.is_damped
    numbers = partial(by_name, parameters)

    def natural_frequency(parameters: Numbers) -> Any:
        """Return ``sqrt(s'(0)/m)`` [rad s-1]; NaN if s'(0) is not positive and finite."""
        named = numbers(parameters)
        stiffness = values(forces.stiffness, {**named, forces.position: 0.0})
        with np.errstate(invalid="ignore"):
            ratio = stiffness / values(forces.mass, named)
            w = np.sqrt(np.where((ratio > 0.0) & (ratio < np.inf), ratio, np.nan))
        # w is a scalar if no parameter enters it
        return np.broadcast_to(w, np.broadcast_shapes(*(np.shape(x) for x in named.values())))

    def exact_period(initial: Numbers, p: Numbers) -> Any:
        start = initial[forces.position], initial[forces.velocity]
        return period(natural_frequency(p), *start)

    facts: dict[str, Any] = {
        "states": STATES,
        "parameters": parameters,
        "acceleration": forces.over_mass(forces.force - forces.damping - forces.spring),
        "potential_energy": forces.potential or integral(forces.spring, forces.position),
        "kinetic_energy": Number(0.5) * forces.mass * Binary("**", velocity, Number(2.0)),
        "energy_unit": "J",
        "linear": forces.is_linear,
        "conservative": is_free,
        "natural_frequency": natural_frequency,
        "dissipation": forces.damping * velocity if forces.is_damped else None,
        "driving": forces.force * velocity if forces.is_driven else None,
        "exact": _linear_motion(forces, numbers),
        "scales": base
        and with_scaled_run(replace(base, outputs=output_scales), forces, parameters, powers or {}),
        "exact_period": exact_period if is_free and forces.is_linear else None,
    }
    if forces.known_damping is not None:
        kind, rate = forces.known_damping
        facts["damping"] = Damping(kind, forces.over_mass(rate))
    return Model(**(facts | more))


def _linear_motion(
    forces: Forces, numbers: Callable[[Numbers], dict[str, Any]]
) -> Callable[[Floats, Numbers, Numbers], dict[str, Floats]] | None:
    """Return the exact solution of linear forces (exercise 11); None unless the drive is a sum of exponentials."""
    kind, rate = forces.known_damping or ("", ZERO)
    is_solvable = forces.is_linear and is_sum_of_exponentials(forces.force)
    if not is_solvable or (forces.is_damped and kind != "linear"):
        return None

    def motion(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
        named = numbers(parameters)
        mass = values(forces.mass, named)
        half = 0.5 * values(rate, named) / mass
        stiffness = values(forces.stiffness, named) / mass
        terms = [(c / mass, s) for c, s in exponentials(forces.force, named) if np.any(c)]
        start = initial[forces.position], initial[forces.velocity]
        u, v = forced_motion(t, stiffness, half, *start, terms)
        return {forces.position: u, forces.velocity: v}

    return motion


def damping_of(
    node: Expression, velocity: str = "v"
) -> tuple[Literal["linear", "quadratic"], Expression] | None:
    """Return kind and coefficient of a linear or quadratic damping force; None for any other."""
    slope = derivative(node, velocity)
    if is_multiple(node, slope, velocity):
        return "linear", slope
    factors = list(_factors(node))
    speed, size = Name(velocity), Call("abs", (Name(velocity),))
    if factors.count(speed) != 1 or factors.count(size) != 1:
        return None
    others = [factor for factor in factors if factor not in (speed, size)]
    if any(velocity in factor.names for factor in others):
        return None
    return "quadratic", math.prod(others, start=ONE)


def _factors(node: Expression) -> list[Expression]:
    if isinstance(node, Binary) and node.operator == "*":
        return [*_factors(node.left), *_factors(node.right)]
    if isinstance(node, Binary) and node.operator == "/":
        return [*_factors(node.left), ONE / node.right]
    if isinstance(node, Negate) and node.operand != ONE:
        return [Negate(ONE), *_factors(node.operand)]
    return [node]
