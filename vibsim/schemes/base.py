"""Scheme: data about a time-stepping method, with the small functions that advance one step.

The functions are plain Python on floats, one member at a time. The engine compiles them for a lane, or runs the same
text uncompiled for small amounts of work; the theory runs them on exact numbers. They use only ``+ - * /`` and
comparisons, so that every lane gives the same bits.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

from vibsim.core.array_types import Floats
from vibsim.models.base import BUDGET, Model, components
from vibsim.models.events import TREATMENTS
from vibsim.schemes.orders import Beginning, Orders, depends_on_velocity, is_smooth

OptionValue = str | float | bool
Options = Mapping[str, OptionValue]

CarriedState = tuple[float, ...]
"""State that a scheme carries from step to step; the first entry is the position."""
Acceleration = Callable[[float, float, float, Any], float]
"""``acceleration(u, v, t, p)`` with the parameters p of the member."""
Slopes = Callable[[float, float, float, Any], tuple[float, float]]
"""``slopes(u, v, t, p)``: derivatives of the acceleration with respect to position and velocity."""

UNIT_ROUND_OFF = 2.0**-53


@dataclass(frozen=True)
class Option:
    """An option of a scheme with named choices; the first choice is the default."""

    name: str
    choices: tuple[str, ...]
    description: str

    @property
    def default(self) -> str:
        """The choice when the user makes none."""
        return self.choices[0]


@dataclass(frozen=True)
class NumberOption:
    """A numerical option of a scheme, from `least` to `most`, both included."""

    name: str
    default: float
    least: float
    most: float
    description: str


@dataclass(frozen=True)
class Flag:
    """An option that a user may switch on; off by default."""

    name: str
    description: str
    default: bool = False


AnyOption = Option | NumberOption | Flag

LOW_STARTS = {"first_order": "omits its dt^2 term", "backward": "has twice its dt^2 term"}
"""Choices of an option `start` that lower the order to 1, and in words what is wrong with the first step."""

EVENTS = Option(
    "events",
    TREATMENTS,
    "where the motion is not smooth: the event is found within the step and the rest of the step begins there, or it "
    "is left to the mesh and noticed at the grid point behind it",
)
"""Option of every fixed-step scheme on a model with events (`vibsim.models.events`)."""


def no_backward(state: CarriedState, dt: float) -> float:
    """Return NaN: a scheme that carries its velocity needs no one-sided difference."""
    return math.nan * dt


@dataclass(frozen=True)
class Stepper:
    """The arithmetic of a scheme: functions on the carried state of one member, with its start and its end.

    After `acceleration` a function may take parameters named `slopes` and `damping_rate`
    (`vibsim.models.base.Damping`). On models with several coordinates, positions, velocities and accelerations are
    vectors (`vibsim.engine.coordinates`).
    """

    start: Callable[..., CarriedState]
    """``start(variant, u, v, dt, p, acceleration)``: the state after the first step."""
    step: Callable[..., tuple[CarriedState, float]]
    """``step(state, t, dt, p, acceleration)``: the next state, and the velocity at the current time t."""
    backward: Callable[..., float] = no_backward
    """``backward(state, dt)``: the one-sided velocity ``(u^n - u^(n-1))/dt`` at the current time."""
    variant: int = 0
    """Variant of the start, passed to `start`."""
    end: str = "own"
    """Velocity at the last point: one of `END_RULES`."""
    own_velocity: bool = True
    """Whether the velocity differs from the centred difference ``[D_2t u]``."""
    staggered: bool = False
    """Whether velocity and position belong to different times; peaks are then located by ``[D_2t u]``."""
    scaling: Callable[[Floats], tuple[Floats, ...]] | None = None
    """Function of ``w dt`` that returns factors of the acceleration and of the initial velocity; None for 1."""
    events: str = ""
    """Treatment of events, one of the choices of `EVENTS`; empty for a smooth model."""
    carried: Callable[..., CarriedState] = lambda u, v, a, t, dt: (u(t), v(t))
    """``carried(u, v, a, t, dt)``: the state at time t along the motion with position u, velocity v and acceleration a,
    all functions of time."""
    tabulated: bool = False
    """Whether the points are already known and follow the parameters (`vibsim.simulation.adaptive`)."""

    @property
    def implicit(self) -> bool:
        """Whether a step solves an equation, for which it takes the slopes of the force."""
        return "slopes" in inspect.signature(self.step).parameters


END_RULES = ("own", "extrapolate", "backward")
"""The scheme's own velocity, the linear extrapolation of the last two velocities, or `Stepper.backward`."""

ZERO = 0.0
"""The number 0; in a kernel for several coordinates, the vector of zeros."""

HANDED = ("acceleration", "slopes", "damping_rate")
"""Functions of the model that a scheme's function may take, by parameter name."""


def handed(
    function: Callable[..., Any],
    acceleration: Acceleration,
    slopes: Slopes,
    damping_rate: Acceleration = lambda u, v, t, p: 0.0,
) -> Callable[..., Any]:
    """Return `function`, a `Stepper`'s start or step, bound to the functions of the model that it takes."""
    available = {"acceleration": acceleration, "slopes": slopes, "damping_rate": damping_rate}
    parameters = inspect.signature(function).parameters
    return partial(function, **{name: available[name] for name in HANDED if name in parameters})


ORDER_AT_CORNERS = 2.0
"""Highest order where the slope of the force jumps within a step; also that of the work summed over such steps."""


def round_off(options: Options, steps: int) -> float:
    """Return the predicted round-off of a scheme that adds a small increment at each step: eps N^(1/2)."""
    return float(UNIT_ROUND_OFF * steps**0.5)


MOST_UNKNOWNS = 16
"""Largest number of unknowns of a step: the elimination is unrolled, n^3/3 operations that take seconds to compile."""
VECTOR = "vector "
"""Prefix of a kind of damping on models with several coordinates."""


def is_on_the_mesh(options: Options) -> bool:
    """Tell whether the options leave events to the mesh."""
    return options.get(EVENTS.name) == "mesh"


def _kind_of(model: Model) -> str:
    kind = model.damping.kind if model.damping else ""
    return f"{VECTOR}{kind}" if kind and model.coordinates > 1 else kind


@dataclass(frozen=True)
class Weights:
    """Parameters of the Newmark family (`vibsim.schemes.newmark`), to which every scheme for structures belongs."""

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
    """For example ``Runge-Kutta``, ``multistep`` or ``symplectic``."""
    stepper: Callable[[Options], Stepper]
    """The arithmetic for given options; equal options give the same function objects."""
    orders: Callable[[Options], Orders]
    """The formal orders for given options."""
    force_evaluations: int | None = None
    """Evaluations of the acceleration per iteration of an implicit scheme, 1 if None; of an explicit one per step,
    counted if None."""
    start: str = "none: a one-step method"
    """How the first step is made, in words."""
    symplectic: bool = False
    symmetric: bool = False
    """Whether a step with -dt undoes a step with dt, up to round-off."""
    velocity_forces: bool = True
    """Whether the acceleration may depend on the velocity in any way."""
    damped: tuple[tuple[str, Callable[[Options], Stepper]], ...] = ()
    """Kinds of damping (`vibsim.models.base.Damping`) with a special treatment, each with its arithmetic."""
    options: tuple[AnyOption, ...] = ()
    even_powers: bool | Callable[[str, Model, Options], bool] = False
    """Whether the error of a quantity expands in h^p, h^(p+2), ... rather than h^p, h^(p+1), ..., if the force is
    smooth: true of every quantity if the scheme, its start and its velocity are symmetric. If it is true but not said,
    bounds hold and are wide; if it is said but not true, they do not hold, so `fault_of` tries it."""
    round_off: Callable[[Options, int], float] = round_off
    """Predicted round-off after a number of steps, relative to the solution (order of magnitude)."""
    adaptive: bool = False
    """Whether the scheme chooses its own steps, outside the ladder (`vibsim.schemes.adaptive`)."""
    weights: Callable[[Options], Weights] | None = None
    """Newmark parameters of the step on a linear structure; None if the scheme cannot step structures."""
    weighed: tuple[str, ...] = ()
    """Names of the options that apply to structures."""

    @property
    def explicit(self) -> bool:
        """Whether no step of a scheme with equal steps solves an equation."""
        return not self.stepper(self.defaults()).implicit

    @property
    def evaluations(self) -> int:
        """Evaluations of the acceleration per step; per iteration if the scheme is implicit."""
        if self.force_evaluations is None:
            return _evaluations(self.stepper(self.defaults())) if self.explicit else 1
        return self.force_evaluations

    def defaults(self) -> dict[str, OptionValue]:
        """Return every option with its default."""
        return {option.name: option.default for option in self.options}

    @property
    def words(self) -> tuple[Option, ...]:
        """The options with named choices."""
        return tuple(option for option in self.options if isinstance(option, Option))

    def options_on(self, model: Model | None) -> tuple[AnyOption, ...]:
        """Return the options that apply to a model."""
        if model is not None and model.loaded is not None:
            return tuple(option for option in self.options if option.name in self.weighed)
        has_events = model is not None and model.events is not None and not self.adaptive
        return (*self.options, EVENTS) if has_events else self.options

    def treats(self, model: Model) -> bool:
        """Tell whether the scheme can handle the forces and events of a model."""
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
        """Return the number of unknowns of an implicit step on a model: the accelerations at all stages."""
        is_solved = not (self.adaptive or self.explicit) and model.coordinates > 1
        return model.coordinates * self.evaluations if is_solved else 1

    def stepper_for(self, model: Model, options: Options) -> Stepper:
        """Return the arithmetic for a model, with the special treatment of its damping if there is one.

        Across an event the centred difference ``[D_2t u]`` is no velocity, so it is not gathered.
        """
        stepper = dict(self.damped).get(_kind_of(model), self.stepper)(options)
        if model.events is None:
            return stepper
        treatment = str(options.get(EVENTS.name, EVENTS.default))
        return replace(stepper, events=treatment, own_velocity=False, staggered=False)

    def has_own_end(self, model: Model, options: Options) -> bool:
        """Tell whether the velocity at the last point is computed like all others."""
        is_table = self.adaptive or model.loaded is not None
        return is_table or self.stepper_for(model, options).end == "own"

    def formal_order(
        self,
        quantity: str,
        model: Model,
        options: Options,
        beginning: Beginning = "any",
        *,
        meets_events: bool = True,
    ) -> float:
        """Return the formal order of a quantity of a model; infinite if the quantity is exact.

        An event left to the mesh is noticed up to a step late, which limits the order to 1. A corner of the force
        inside a step limits it to 2 (`ORDER_AT_CORNERS`). A motion that meets no event is smooth.
        """
        quantity, orders = components(model, quantity)[0], self.orders(options)
        if not (model.events_act and meets_events):
            order = orders.of(quantity, model, beginning)
            # the power of the force has corners, wherever steps end; the power of damping has none
            is_kept = self._resolves_corners(model) and quantity not in BUDGET[1:]
            return order if model.lookup is None or is_kept else min(order, ORDER_AT_CORNERS)
        order = orders.between_events(model)
        return min(order, 1.0) if is_on_the_mesh(options) else order

    def special_order(self, options: Options) -> float:
        """Return the highest order of any state or energy in any special case of motion, model or numerical option.

        An error term that vanishes in a special case is small near it, and so is everything that it drives.
        """
        defaults = {o.name: o.default for o in self.options if isinstance(o, NumberOption)}
        return max(self.orders(case).highest for case in (options, {**options, **defaults}))

    def has_even_powers(self, quantity: str, model: Model, options: Options) -> bool:
        """Tell whether the error of a quantity expands in h^p, h^(p+2), ...

        It does not if an event or a corner of the force may lie inside a step.
        """
        if model.events is not None or not self._resolves_corners(model) or not is_smooth(model):
            return False
        even = self.even_powers
        return (
            even if isinstance(even, bool) else even(components(model, quantity)[0], model, options)
        )

    def _resolves_corners(self, model: Model) -> bool:
        """Tell whether the force is smooth in every step: steps end at the corners and do not look back across them."""
        is_multistep = self.family == "multistep"
        return model.lookup is None or (model.lookup.is_met and not is_multistep)


@cache
def _evaluations(stepper: Stepper) -> int:
    """Return how often an explicit step evaluates the acceleration."""
    places = []

    def acceleration(u: float, v: float, t: float, p: Any) -> float:
        places.append(u)
        return -u

    start, step = (
        handed(f, acceleration, lambda u, v, t, p: (-1.0, 0.0))
        for f in (stepper.start, stepper.step)
    )
    state = start(stepper.variant, 1.0, 0.5, 0.1, ())
    places.clear()
    step(state, 0.1, 0.1, ())
    return len(places)
