"""What a scheme is: data about a time-stepping method, and the small functions that step it.

The functions are plain Python on floats, one member at a time. The engine compiles them for a lane, or runs the same
text uncompiled where the work is small; the theory runs them on exact numbers. They use ``+ - * /`` and comparisons
only, so that every lane gives the same bits.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from vibsim.core.array_types import Floats
from vibsim.core.registry import hash_fault
from vibsim.models.base import BUDGET, Model
from vibsim.models.events import TREATMENTS
from vibsim.schemes.orders import Beginning, Orders, depends_on_velocity

OptionValue = str | float | bool
Options = Mapping[str, OptionValue]

CarriedState = tuple[float, ...]
"""What a scheme carries from step to step; the first entry is the position."""
Acceleration = Callable[[float, float, float, Any], float]
"""``acceleration(u, v, t, p)`` with the parameters p of the member."""
Slopes = Callable[[float, float, float, Any], tuple[float, float]]
"""``slopes(u, v, t, p)``: derivatives of the acceleration by position and by velocity."""

UNIT_ROUND_OFF = 2.0**-53


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
class NumberOption:
    """A number that a user may give a scheme, from `least` to `most`, both included."""

    name: str
    default: float
    least: float
    most: float
    description: str


@dataclass(frozen=True)
class Flag:
    """Something that a user may switch on; off by default."""

    name: str
    description: str
    default: bool = False


AnyOption = Option | NumberOption | Flag

LOW_STARTS = {"first_order": "omits its dt^2 term", "backward": "has twice its dt^2 term"}
"""Choices of an option `start` that leave order 1, and what is wrong with them in words."""

EVENTS = Option(
    "events",
    TREATMENTS,
    "where the motion is not smooth: the event is found within the step and the rest of the step begins there, or it "
    "is left to the mesh and noticed at the grid point behind it",
)
"""Option of every scheme with equal steps on a model with events (`vibsim.models.events`)."""


def no_backward(state: CarriedState, dt: float) -> float:
    """Return NaN: a scheme that carries its velocity has no use for a one-sided one."""
    return math.nan * dt


@dataclass(frozen=True)
class Stepper:
    """The arithmetic of a scheme: functions on the carried state of one member, and how it starts and ends.

    A function may ask for `slopes` or `damping_rate` (`vibsim.models.base.Damping`) behind `acceleration`, by these
    names. Of several coordinates positions, velocities and accelerations are vectors (`vibsim.engine.coordinates`).
    """

    start: Callable[..., CarriedState]
    """``start(variant, u, v, dt, p, acceleration)``: the state at the first step."""
    step: Callable[..., tuple[CarriedState, float]]
    """``step(state, t, dt, p, acceleration)``: the next state, and the velocity at the present time t."""
    backward: Callable[..., float] = no_backward
    """``backward(state, dt)``: the one-sided velocity ``(u^n - u^(n-1))/dt`` at the present time."""
    variant: int = 0
    """Which of its starts `start` is to take."""
    end: str = "own"
    """Velocity at the last point: `END_RULES`."""
    own_velocity: bool = True
    """Whether the velocity is another one than the centred difference ``[D_2t u]``."""
    staggered: bool = False
    """Whether the velocity belongs to another time than the position: peaks are then found by ``[D_2t u]``."""
    implicit: bool = False
    """Whether a step solves an equation, for which it may ask for `slopes`."""
    scaling: Callable[[Floats], tuple[Floats, ...]] | None = None
    """Factors of the acceleration and of the initial velocity that enters the start, from ``w dt``; None for 1."""
    events: str = ""
    """How it treats events, one of `EVENTS`; empty for a smooth model."""
    carried: Callable[..., CarriedState] = lambda u, v, a, t, dt: (u(t), v(t))
    """``carried(u, v, a, t, dt)``: the state at time t of a motion with that position, velocity and acceleration,
    functions of time."""
    tabulated: bool = False
    """Whether the points are known before, and stand behind the parameters (`vibsim.simulation.adaptive`)."""


END_RULES = ("own", "extrapolate", "backward")
"""The scheme's own velocity, the linear extrapolation of the last two, or `Stepper.backward`."""

ZERO = 0.0
"""The number 0; in a kernel for several coordinates, the vector of zeros."""

HANDED = ("acceleration", "slopes", "damping_rate")
"""Functions of the model that a function of a scheme is handed, by these names."""


def handed(
    function: Callable[..., Any],
    acceleration: Acceleration,
    slopes: Slopes,
    damping_rate: Acceleration = lambda u, v, t, p: 0.0,
) -> Callable[..., Any]:
    """Return `function`, a `Stepper`'s start or step, with those functions of the model that it asks for."""
    known = {"acceleration": acceleration, "slopes": slopes, "damping_rate": damping_rate}
    parameters = inspect.signature(function).parameters
    return partial(function, **{name: known[name] for name in HANDED if name in parameters})


ORDER_AT_CORNERS = 2.0
"""Order that is left where the slope of the force jumps within a step, and of a sum of its power over such steps."""


def round_off(options: Options, steps: int) -> float:
    """Return the predicted round-off of a scheme that adds a small increment at each step: eps N^(1/2)."""
    return float(UNIT_ROUND_OFF * steps**0.5)


MOST_UNKNOWNS = 16
"""Unknowns of a step, at most: their elimination is written out, n^3/3 operations, which takes seconds to compile."""
VECTOR = "vector "
"""Before a kind of damping: that of a model with several coordinates."""


def is_on_the_mesh(options: Options) -> bool:
    """Tell whether the options leave events to the mesh."""
    return options.get(EVENTS.name) == "mesh"


def _kind_of(model: Model) -> str:
    kind = model.damping.kind if model.damping else ""
    return f"{VECTOR}{kind}" if kind and model.coordinates > 1 else kind


@dataclass(frozen=True)
class Weights:
    """The family of Newmark's scheme (`vibsim.schemes.newmark`), in which all steps of structures are."""

    beta: float
    gamma: float
    alpha_m: float = 0.0
    alpha_f: float = 0.0


@dataclass(frozen=True)
class Scheme:
    """A time-stepping method."""

    kind: str
    title: str
    source: str
    family: str
    """Such as ``Runge-Kutta``, ``multistep``, ``symplectic``."""
    stepper: Callable[[Options], Stepper]
    """The arithmetic that the options ask for; the same functions for the same options."""
    orders: Callable[[Options], Orders]
    """Orders that the scheme promises with these options."""
    force_evaluations: int = 1
    """Evaluations of the acceleration per step; of an implicit scheme, per iteration."""
    start: str = "none: a one-step method"
    """What is needed for the first step, in words."""
    explicit: bool = True
    symplectic: bool = False
    symmetric: bool = False
    """Whether a step with -dt takes a step back, up to round-off."""
    velocity_forces: bool = True
    """Whether the acceleration may depend on the velocity, however it does."""
    damped: tuple[tuple[str, Callable[[Options], Stepper]], ...] = ()
    """Kinds of damping (`vibsim.models.base.Damping`) that it has a treatment of its own for, and the arithmetic."""
    options: tuple[AnyOption, ...] = ()
    even_powers: bool | Callable[[str, Model, Options], bool] = False
    """Whether the error of a quantity expands in h^p, h^(p+2), ... rather than h^p, h^(p+1), ...: of every quantity
    where the scheme, its start and its velocity are symmetric."""
    round_off: Callable[[Options, int], float] = round_off
    """Predicted round-off after a number of steps, relative to the solution (order of magnitude)."""
    adaptive: bool = False
    """Whether it chooses its own steps, outside the ladder (`vibsim.schemes.adaptive`)."""
    weights: Callable[[Options], Weights] | None = None
    """Its step on a linear structure, which is stepped as a whole; None of a scheme that cannot do that."""
    weighed: tuple[str, ...] = ()
    """Options that count on a structure."""

    def defaults(self) -> dict[str, OptionValue]:
        """Return every option with its default."""
        return {option.name: option.default for option in self.options}

    @property
    def words(self) -> tuple[Option, ...]:
        """The options that are a choice of words."""
        return tuple(option for option in self.options if isinstance(option, Option))

    def options_on(self, model: Model | None) -> tuple[AnyOption, ...]:
        """Return every option that has a meaning on a model."""
        if model is not None and model.loaded is not None:
            return tuple(option for option in self.options if option.name in self.weighed)
        has_events = model is not None and model.events is not None and not self.adaptive
        return (*self.options, EVENTS) if has_events else self.options

    def treats(self, model: Model) -> bool:
        """Tell whether the scheme can treat the forces of a model, and its events."""
        if model.loaded is not None:
            return self.weights is not None
        if (self.adaptive and model.events is not None) or self.unknowns(model) > MOST_UNKNOWNS:
            return False
        return (
            self.velocity_forces
            or not depends_on_velocity(model)
            or _kind_of(model) in dict(self.damped)
        )

    def unknowns(self, model: Model) -> int:
        """Return how many unknowns a step eliminates on a model: the accelerations at all of its stages."""
        is_solved = not (self.explicit or self.adaptive) and model.coordinates > 1
        return model.coordinates * self.force_evaluations if is_solved else 1

    def stepper_for(self, model: Model, options: Options) -> Stepper:
        """Return the arithmetic that the options ask for, with its treatment of the model's damping if it has one.

        Across an event the centred difference ``[D_2t u]`` is no velocity, and none is gathered.
        """
        stepper = dict(self.damped).get(_kind_of(model), self.stepper)(options)
        if model.events is None:
            return stepper
        treatment = str(options.get(EVENTS.name, EVENTS.default))
        return replace(stepper, events=treatment, own_velocity=False, staggered=False)

    def formal_order(
        self,
        quantity: str,
        model: Model,
        options: Options,
        beginning: Beginning = "any",
        *,
        meets_events: bool = True,
    ) -> float:
        """Return the order that is promised for a quantity of a model; infinite for what is exact.

        An event that is left to the mesh is noticed up to a step late: no order above 1 is left. A corner of the force
        that a step does not see leaves 2 (`ORDER_AT_CORNERS`). A motion that meets no event is smooth.
        """
        orders = self.orders(options)
        if model.events is None or not meets_events:
            order = orders.of(quantity, model, beginning)
            # the power of the force has its corners, whatever the steps do; that of damping has none
            is_kept = self._sees_corners(model) and quantity not in BUDGET[1:]
            return order if model.lookup is None or is_kept else min(order, ORDER_AT_CORNERS)
        order = orders.between_events(model)
        return min(order, 1.0) if is_on_the_mesh(options) else order

    def special_order(self, options: Options) -> float:
        """Return the highest order of any state or energy in a special case of motion, model or numbers of options.

        What vanishes there alone is small near by, also in what it drives: the swing of a wrong energy.
        """
        usual = {o.name: o.default for o in self.options if isinstance(o, NumberOption)}
        return max(self.orders(near).highest for near in (options, {**options, **usual}))

    def has_even_powers(self, quantity: str, model: Model, options: Options) -> bool:
        """Tell whether the error of a quantity expands in h^p, h^(p+2), ...

        It does not where an event divides a step, or a corner of the force.
        """
        if model.events is not None or not self._sees_corners(model):
            return False
        even = self.even_powers
        return even if isinstance(even, bool) else even(quantity, model, options)

    def _sees_corners(self, model: Model) -> bool:
        """Tell whether every step has a smooth force: between two corners, and without a look back across one."""
        is_multistep = self.family == "multistep"
        return model.lookup is None or (model.lookup.is_met and not is_multistep)


def fault_of(scheme: object) -> str:
    """Say why an object from elsewhere is no scheme that can be added; nothing where it is one."""
    if not isinstance(scheme, Scheme):
        return f"is no vibsim.schemes.Scheme, but of the type {type(scheme).__name__}"
    if not re.fullmatch("[a-z0-9_]+", scheme.kind):
        return "its kind must consist of a to z, 0 to 9 and _"
    if fault := hash_fault(scheme):
        return fault
    if scheme.adaptive:
        return "a scheme that chooses its own steps cannot be added"
    options = scheme.defaults()
    if not isinstance(scheme.stepper(options), Stepper):
        return "its stepper must return a vibsim.schemes.Stepper"
    if not isinstance(scheme.orders(options), Orders):
        return "its orders must return a vibsim.schemes.orders.Orders"
    return ""
