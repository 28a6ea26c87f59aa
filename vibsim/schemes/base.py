"""What a scheme is: data about a time-stepping method, and the small functions that step it.

The functions are plain Python on floats, one member at a time. The engine compiles them for a lane, or runs the same
text uncompiled where the work is small; they use ``+ - * /`` and comparisons only, so that every lane gives the same
bits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from vibsim.models.base import Model

Options = Mapping[str, str]

CarriedState = tuple[float, ...]
"""What a scheme carries from step to step; the first entry is the position."""
Acceleration = Callable[[float, float, float, Any], float]
"""``acceleration(u, v, t, p)`` with the parameters p of the member."""


@dataclass(frozen=True)
class Option:
    """A choice that a user may make within a scheme; the first choice is the default."""

    name: str
    choices: tuple[str, ...]
    description: str

    @property
    def default(self) -> str:
        """The choice taken when the user makes none."""
        return self.choices[0]


@dataclass(frozen=True)
class Stepper:
    """The arithmetic of a scheme: three functions on the carried state of one member, and how it starts and ends."""

    start: Callable[..., CarriedState]
    """``start(variant, u, v, dt, p, acceleration)``: the state at the first step."""
    step: Callable[..., tuple[CarriedState, float]]
    """``step(state, t, dt, p, acceleration)``: the next state, and the velocity at the present time t."""
    backward: Callable[..., float]
    """``backward(state, dt)``: the one-sided velocity ``(u^n - u^(n-1))/dt`` at the present time."""
    variant: int = 0
    """Which of its starts `start` is to take."""
    end: str = "own"
    """Velocity at the last point: `END_RULES`."""


END_RULES = ("own", "extrapolate", "backward")
"""The scheme's own velocity, the linear extrapolation of the last two, or `Stepper.backward`."""


@dataclass(frozen=True)
class Scheme:
    """A time-stepping method."""

    kind: str
    title: str
    source: str
    options: tuple[Option, ...]
    stepper: Callable[[Options], Stepper]
    """The arithmetic that the options ask for."""
    formal_order: Callable[[str, Model, Options], int]
    """Order that the scheme promises for a quantity of a model when its options are sound."""
    round_off: Callable[[Options, int], float]
    """Predicted round-off after a number of steps, relative to the solution (order of magnitude)."""
    even_powers: Callable[[str, Model, Options], bool]
    """Whether the error of a quantity expands in h^p, h^(p+2), ... rather than h^p, h^(p+1), ..."""
    stability_limit: float | None
    """Largest stable ``w dt`` on ``u'' + w^2 u = 0``; None where there is no limit."""
    force_evaluations: int
    """Evaluations of the acceleration per step."""
    velocity_forces: bool
    """Whether the acceleration may depend on the velocity."""

    def defaults(self) -> dict[str, str]:
        """Return every option with its default."""
        return {option.name: option.default for option in self.options}
