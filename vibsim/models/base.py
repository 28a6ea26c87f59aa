"""Model: data about an equation of motion, with its formulas as text, or as expression trees if a user wrote them.

Formulas are not functions, so that each serves every reader: the engine compiles it for each lane, Newton's method
differentiates it, a report prints it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import (
    AMPLITUDE,
    CENTRED,
    PHASE,
    POSITION_VECTOR,
    VELOCITY_VECTOR,
)
from vibsim.formula import (
    ONE,
    Binary,
    Expression,
    Name,
    Number,
    derivative,
    parse,
    values,
)
from vibsim.models.events import Events
from vibsim.models.table import BEND, HEIGHT, Lookup

if TYPE_CHECKING:
    from vibsim.models.shared.scales import Scales
    from vibsim.models.structure import Loaded

Numbers = Mapping[str, Any]
"""Values by name: floats, or arrays that broadcast against each other."""
Formula = str | Expression

ENERGIES = ("kinetic_energy", "potential_energy", "energy", "energy_deviation")
BUDGET = ("dissipated_energy", "work_done", "energy_budget")
"""Energy taken by damping, work of driving forces, and ``E(t) - E(0)`` plus the first minus the second, which is 0."""


@dataclass(frozen=True)
class State:
    """One component of the state."""

    name: str
    unit: str
    long_name: str
    minimum: float | None = None
    """Smallest initial value that is accepted."""


@dataclass(frozen=True)
class Parameter:
    """One parameter, with its unit and its bounds."""

    name: str
    default: float
    unit: str
    description: str
    minimum: float | None = None
    exclusive: bool = False
    """Whether `minimum` itself is refused."""
    maximum: float | None = None
    neutral: float = 0.0
    """For parameters in `Model.optional`: the value at which the term drops out of the equation, 1 for a factor."""
    path: str = ""
    """Path in the section ``model`` if it is not the name: ``damping.linear``."""

    @property
    def key(self) -> str:
        """Path in the section ``model``, by which values and sweeps refer to it."""
        return self.path or self.name


@dataclass(frozen=True)
class Output:
    """A further series, computed from state and time, such as the force in a wire."""

    name: str
    unit: str
    long_name: str
    formula: Formula
    """Formula in the state names, ``t`` and the parameters."""


@dataclass(frozen=True)
class FormulaField:
    """A formula that a user may write."""

    name: str
    names: tuple[str, ...]
    """Names that it may use beside the declared parameters: states or ``t``."""
    default: str
    description: str
    terms: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Formulas with one coefficient b that may be written as ``{word: number}``."""
    term_units: Mapping[str, str] = field(default_factory=dict, hash=False)
    """The unit of b in each of these."""
    table: tuple[str, str] | None = None
    """Column names of place and value if a table may replace the formula; None otherwise."""
    tabled: bool = False
    """Whether the field is always a table; the user states under the key `AT` where it is looked up."""
    derivatives: int = 0
    """Number of times the equation differentiates it; all derivatives but the last must be continuous."""
    along: str = "t"
    """Value of its variable along the motion: a formula in ``t`` and the parameters of the model."""
    of: Literal["", "coordinate", "output", "term"] = ""
    """What has a formula each: every coordinate or output, by name, or every term of a sum, by number. Empty if the
    field is a single formula."""
    beside: str = ""
    """The field that it requires; empty if none."""
    instead_of: str = ""
    """The field that it replaces."""
    positive: bool = False
    """Whether its value must be greater than 0."""
    paired: bool = False
    """Whether it may have entries for pairs of coordinates, ``{x: {y: ...}}``: a symmetric matrix."""


@dataclass(frozen=True)
class Damping:
    """A damping force over the mass, of a kind that some schemes treat specially."""

    kind: Literal["linear", "quadratic"]
    """``rate*v`` or ``rate*abs(v)*v``."""
    rate: Formula
    """Formula in the parameters."""


@dataclass(frozen=True)
class Model:
    """An equation of motion ``position'' = acceleration(position, velocity, t)``, of one coordinate or of several.

    Peaks, periods and turns are measured on the first coordinate.
    """

    kind: str
    title: str
    source: str
    equation: str
    states: tuple[State, ...]
    """All positions, then all velocities."""
    parameters: tuple[Parameter, ...]
    acceleration: Formula
    """Acceleration of the first coordinate, in the state names, ``t`` and the parameters."""
    kinetic_energy: Formula
    potential_energy: Formula
    energy_unit: str
    linear: bool
    """Whether there is one coordinate, whose force is linear in it with a constant coefficient."""
    conservative: bool
    """Whether the energy is constant."""
    natural_frequency: Callable[[Numbers], Any]
    """Angular frequency of small oscillations [rad per unit of time], from the parameters; the lowest if several."""
    turn: float | None = None
    """Angle after which the position repeats; None if it does not repeat."""
    exact: Callable[[Floats, Numbers, Numbers], dict[str, Floats]] | None = None
    """Exact states at times t, shape (..., n_t), from initial values and parameters of shape (..., 1) or ()."""
    exact_period: Callable[[Numbers, Numbers], Any] | None = None
    """Exact period of an oscillation or of one turn, from initial values and parameters."""
    dissipation: Formula | None = None
    """Power that damping takes from the energy; None without damping."""
    driving: Formula | None = None
    """Power that driving forces put into the energy; None without driving forces."""
    outputs: tuple[Output, ...] = ()
    """Further stored series."""
    start: Callable[[Numbers], dict[str, Any]] | None = None
    """Initial values as a function of the parameters, arrays that broadcast; None if the user gives them."""
    optional: tuple[str, ...] = ()
    """Parameters with a term that is left out of the equation if they have their neutral value and are not swept."""
    variant: Callable[[frozenset[str]], Model] | None = None
    """Function that returns the model with the terms of a subset of `optional`; this model has none of them, except a
    mass."""
    damping: Damping | None = None
    """The damping force if it is of a simple kind."""
    events: Events | None = None
    """Events, where the motion is not smooth; None if it is smooth throughout."""
    formulas: tuple[FormulaField, ...] = ()
    """Formulas that a user may write."""
    takes_events: bool = False
    """Whether a user may also write events and a stop as formulas (`vibsim.models.shared.crossings`)."""
    written: Callable[..., Model] | None = None
    """Function that returns the model with given formulas, by name, and declared parameters, as in
    `vibsim.models.oscillator`. Keys of formulas of coordinates and outputs begin with the field: ``acceleration.x``.
    Further arguments are numbers of files: a `Table` in place of a formula, with `Lookup.is_met`, or a `Structure`."""
    named: Callable[[tuple[str, ...]], Model] | None = None
    """Function that returns the model with coordinates of these names; None if a user cannot name them."""
    lookup: Lookup | None = None
    """The table that the formulas look up, if any."""
    scales: Scales | None = None
    """Characteristic scales, if any."""
    highest_frequency: Callable[[Numbers], Any] | None = None
    """The highest angular frequency of small oscillations, which steps must resolve; None: the natural frequency."""
    further_accelerations: tuple[Formula, ...] = ()
    """Accelerations of the coordinates after the first."""
    loaded: Loaded | None = None
    """The structure that is stepped as a whole; the states are then its observed displacements. None otherwise."""
    misses_potential: bool = False
    """Whether forces depend on positions but no potential energy is known: the energy is then the kinetic energy."""
    superposed: bool = False
    """Whether the motion is a sum of linear, conservative motions; the energy then has their orders."""

    @property
    def events_act(self) -> bool:
        """Whether events change the motion."""
        return self.events is not None and self.events.act

    def with_formulas(
        self, formulas: Mapping[str, str], declared: tuple[str, ...], *numbers: Any
    ) -> Model:
        """Return the model with given formulas, declared parameters and numbers of files: see `written`."""
        return self if self.written is None else self.written(formulas, declared, *numbers)

    def with_terms(self, names: Iterable[str]) -> Model:
        """Return the model with the terms of these parameters of `optional`."""
        return self if self.variant is None else self.variant(frozenset(names))

    @property
    def coordinates(self) -> int:
        """Number of coordinates."""
        return len(self.states) // 2

    @property
    def is_alone(self) -> bool:
        """Whether the model has a single degree of freedom."""
        return self.coordinates == 1 and self.loaded is None

    @property
    def dimensionless(self) -> bool:
        """Whether the states, and so the time, have no units."""
        return all(state.unit == "1" for state in self.states)

    @property
    def accelerations(self) -> tuple[Formula, ...]:
        """The acceleration of every coordinate."""
        return (self.acceleration, *self.further_accelerations)

    @property
    def forces(self) -> tuple[Formula, ...]:
        """The accelerations; of a structure, the loads that are formulas."""
        return self.accelerations if self.loaded is None else self.loaded.formulas

    @property
    def positions(self) -> tuple[str, ...]:
        """Names of the positions."""
        return tuple(state.name for state in self.states[: self.coordinates])

    @property
    def velocities(self) -> tuple[str, ...]:
        """Names of the velocities."""
        return tuple(state.name for state in self.states[self.coordinates :])

    @property
    def position(self) -> str:
        """Name of the position, of the first coordinate."""
        return self.states[0].name

    @property
    def velocity(self) -> str:
        """Name of the velocity, of the first coordinate."""
        return self.states[self.coordinates].name


@cache
def tree(model: Model, formula: Formula) -> Expression:
    """Return a formula of a model as an expression in its states, ``t`` and its parameters."""
    if not isinstance(formula, str):
        return formula
    return parse(formula, (*(state.name for state in model.states), "t", *parameter_names(model)))


def declared_parameters(names: Iterable[str]) -> tuple[Parameter, ...]:
    """Return the parameters that a user declares for formulas."""
    return tuple(
        Parameter(name, 0.0, "1", f"declared parameter {name}", path=f"parameters.{name}")
        for name in names
    )


def speeds(
    positions: Iterable[str], velocities: Iterable[str], accelerations: Iterable[Expression]
) -> Iterator[tuple[str, Expression]]:
    """Yield time, positions and velocities, each with the formula of its time derivative along a motion."""
    names = tuple(velocities)
    yield "t", ONE
    yield from zip(positions, map(Name, names), strict=True)
    yield from zip(names, accelerations, strict=True)


def rate(
    model: Model, formula: Expression, accelerations: Sequence[Expression] | None = None
) -> Expression:
    """Return the time derivative of a formula along a motion of the model, or along one with other accelerations."""
    pushes = accelerations or [tree(model, acceleration) for acceleration in model.accelerations]
    total: Expression = Number(0.0)
    for name, speed in speeds(model.positions, model.velocities, pushes):
        slope = derivative(formula, name)
        if slope != Number(0.0):
            total = Binary("+", total, Binary("*", slope, speed))
    return total


def has_solution(model: Model) -> bool:
    """Tell whether the motion is known: exactly, or to twelve digits by a reference solution.

    The motion of a structure is known only by its modes. The reference solution of a single member may fail
    (`vibsim.simulation.reference.solve`): its values are then NaN.
    """
    return model.exact is not None or not (model.events_act or model.loaded is not None)


def varies_in_time(model: Model) -> bool:
    """Tell whether the force of a model depends on time, other than by a table."""
    return any("t" in tree(model, row).names for row in model.forces)


def parameter_names(model: Model) -> tuple[str, ...]:
    """Return the names of the parameters in formulas, in the order of the engine."""
    return tuple(parameter.name for parameter in model.parameters)


def by_name(parameters: Iterable[Parameter], numbers: Numbers) -> dict[str, Any]:
    """Return the values of parameters by their names in formulas, from `numbers` by their keys."""
    return {row.name: numbers[row.key] for row in parameters}


def natural_end(model: Model, periods: float, parameters: Numbers) -> Any:
    """Return the duration of a number of natural periods (small oscillations), as a number or an array."""
    return periods * (2.0 * math.pi / model.natural_frequency(parameters))


def looked_up(
    model: Model, numbers: Mapping[str, Any], before: Floats | None = None
) -> dict[str, Floats]:
    """Return height and second derivative from the table of a model, by their names in formulas; empty without a table.

    `numbers` gives t and the parameters by name, `before` is that of `Table.read`.
    """
    if model.lookup is None:
        return {}
    place = values(tree(model, model.lookup.place), numbers)
    return dict(zip((HEIGHT, BEND), model.lookup.table.read(place, before), strict=True))


def table_end(model: Model, parameters: Numbers) -> Any:
    """Return the time at which a motion reaches the last point of the table, at the speed of `Lookup.place`."""
    assert model.lookup is not None
    numbers = {**by_name(model.parameters, parameters), "t": 1.0}
    with np.errstate(divide="ignore"):
        speed = np.asarray(values(tree(model, model.lookup.place), numbers), float)
        return model.lookup.table.last / speed


def has_budget(model: Model) -> bool:
    """Tell whether the energy changes by a known amount, due to damping, driving forces, friction or impacts."""
    return model.dissipation is not None or model.driving is not None or model.events is not None


def quantities(model: Model, own_velocity: bool = False) -> tuple[str, ...]:
    """Return the name of every quantity of `model` that is stored as a series.

    `own_velocity` says that the velocity of some scheme is not the centred difference: `centred` is then stored too.
    """
    return (
        *(state.name for state in model.states),
        *ENERGIES,
        *(BUDGET if has_budget(model) else ()),
        *(output.name for output in model.outputs),
        *(centred(model) if own_velocity else ()),
    )


def components(model: Model, quantity: str) -> tuple[str, ...]:
    """Return the states that a vector of all coordinates consists of; any other quantity unchanged."""
    vectors = {POSITION_VECTOR: model.positions, VELOCITY_VECTOR: model.velocities}
    return vectors.get(quantity, (quantity,))


def has_error_parts(model: Model) -> bool:
    """Tell whether the error of a position can be split into a shift in time and a factor of the amplitude.

    That requires a smooth motion, and its accelerations, which are not kept for a structure.
    """
    return not model.events_act and model.lookup is None and model.loaded is None


def error_parts(model: Model) -> tuple[str, ...]:
    """Return the names of these parts for every position; they are computed when levels are compared."""
    positions = model.positions if has_error_parts(model) else ()
    return tuple(name + end for name in positions for end in (PHASE, AMPLITUDE))


def centred(model: Model) -> tuple[str, ...]:
    """Return the names of the centred differences ``[D_2t u]``, of the energy with these velocities, its deviation."""
    return tuple(name + CENTRED for name in (*model.velocities, "energy", "energy_deviation"))
