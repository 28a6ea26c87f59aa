"""What a model is: data about an equation of motion, its formulas as text, or as trees where a user wrote them.

A formula is no function, so that one statement of it serves every reader: the engine compiles it for each lane,
Newton's method differentiates it, a report prints it.
"""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.registry import hash_fault
from vibsim.core.vocabulary import AMPLITUDE, CENTRED, PHASE
from vibsim.formula import (
    CONSTANTS,
    FUNCTIONS,
    ONE,
    Binary,
    Expression,
    ExpressionError,
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
"""What damping took, what driving forces put in, and ``E(t) - E(0)`` plus the one minus the other, which is 0."""


@dataclass(frozen=True)
class State:
    """One component of the state."""

    name: str
    unit: str
    long_name: str
    minimum: float | None = None
    """Least initial value."""


@dataclass(frozen=True)
class Parameter:
    """One parameter, with its unit and its bound."""

    name: str
    default: float
    unit: str
    description: str
    minimum: float | None = None
    exclusive: bool = False
    """Whether `minimum` itself is refused."""
    maximum: float | None = None
    neutral: float = 0.0
    """Value at which its term is no part of the equation, of those in `Model.optional`: 1 of a factor."""
    path: str = ""
    """Where it stands in the section ``model``, if not under its name: ``damping.linear``."""

    @property
    def key(self) -> str:
        """Its place in the section ``model``, by which it is swept and its values are found."""
        return self.path or self.name


@dataclass(frozen=True)
class Output:
    """A quantity that follows from the state at a time, such as a force in a wire."""

    name: str
    unit: str
    long_name: str
    formula: Formula
    """In the state names, ``t`` and the parameters."""


@dataclass(frozen=True)
class FormulaField:
    """A formula that a user may write."""

    name: str
    names: tuple[str, ...]
    """What it may name beside the declared parameters: a state, or ``t``."""
    default: str
    description: str
    terms: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Formulas with one coefficient b that may be written as ``{word: number}``."""
    term_units: Mapping[str, str] = field(default_factory=dict, hash=False)
    """The unit of b in each of them."""
    table: tuple[str, str] | None = None
    """Names that the place and the value have in a table, where one may stand instead; None where not."""
    tabled: bool = False
    """Whether a table always stands there, which a user looks up at a place of his own, under the key `AT`."""
    derivatives: int = 0
    """How many times the equation differentiates it: it and all of its derivatives but the last must not jump."""
    along: str = "t"
    """What its own name is at a time: a formula in ``t`` and the parameters of the model."""
    of: Literal["", "coordinate", "output", "term"] = ""
    """What has a formula of its own, under its name: every coordinate, or every output, which a user names; or every
    term of a sum, under its number. Empty where the field is one formula."""
    beside: str = ""
    """The field beside which alone it has a meaning; empty where it needs none."""
    instead_of: str = ""
    """The field whose place it takes."""
    positive: bool = False
    """Whether its value must be greater than 0."""
    paired: bool = False
    """Whether two coordinates may have one together: ``{x: {y: ...}}``, a symmetric matrix."""


@dataclass(frozen=True)
class Damping:
    """A damping force over the mass that schemes with a treatment of their own can tell from the others."""

    kind: Literal["linear", "quadratic"]
    """``rate*v`` or ``rate*abs(v)*v``."""
    rate: Formula
    """In the parameters."""


@dataclass(frozen=True)
class Model:
    """An equation of motion ``position'' = acceleration(position, velocity, t)``, of one coordinate or of several.

    Of several coordinates, position and velocity are the first one's where a number is measured of one alone: peaks,
    periods and turns.
    """

    kind: str
    title: str
    source: str
    equation: str
    states: tuple[State, ...]
    """Position and velocity; of several coordinates all positions, then all velocities."""
    parameters: tuple[Parameter, ...]
    acceleration: Formula
    """Of the first coordinate, in the state names, ``t`` and the parameters."""
    kinetic_energy: Formula
    potential_energy: Formula
    energy_unit: str
    linear: bool
    conservative: bool
    natural_frequency: Callable[[Numbers], Any]
    """Angular frequency of small oscillations [rad per unit of time], from the parameters; of several, of a period."""
    turn: float | None = None
    """The angle after which the position repeats; None where it does not."""
    exact: Callable[[Floats, Numbers, Numbers], dict[str, Floats]] | None = None
    """Exact states at times t, shape (..., n_t), from initial values and parameters of shape (..., 1) or ()."""
    exact_period: Callable[[Numbers, Numbers], Any] | None = None
    """Exact period from initial values and parameters: of an oscillation, or of one turn."""
    dissipation: Formula | None = None
    """Power that damping takes from the energy; None where there is no damping."""
    driving: Formula | None = None
    """Power that driving forces put into the energy; None where there are none."""
    outputs: tuple[Output, ...] = ()
    """What else is stored as a series."""
    start: Callable[[Numbers], dict[str, Any]] | None = None
    """Initial values that the parameters already give, as arrays that broadcast; None where a user gives them."""
    optional: tuple[str, ...] = ()
    """Parameters with a term of their own, which is no part of the equation where they are neutral (0, or a factor 1)
    and are not swept."""
    variant: Callable[[frozenset[str]], Model] | None = None
    """The model with the terms of some of `optional`; this one has those of none, but a mass."""
    damping: Damping | None = None
    """The damping force, where it is one of two simple kinds."""
    events: Events | None = None
    """Where the motion is not smooth; None where it is smooth throughout."""
    formulas: tuple[FormulaField, ...] = ()
    """What a user writes as formulas."""
    takes_events: bool = False
    """Whether a user may write events and a stop as formulas beside them (`vibsim.models.shared.crossings`)."""
    written: Callable[..., Model] | None = None
    """The model of such formulas, by name, with declared parameters; see `vibsim.models.oscillator`. Formulas of single
    coordinates and outputs have the name of the field before their own: ``acceleration.x``. Behind them stand numbers
    of files: a `Table` in place of a formula, with `Lookup.is_met`, or a `Structure`."""
    named: Callable[[tuple[str, ...]], Model] | None = None
    """The model whose coordinates have such names; None where a user does not name them."""
    lookup: Lookup | None = None
    """The table that the formulas look up; None where there is none."""
    scales: Scales | None = None
    """Its characteristic scales, where it has any."""
    highest_frequency: Callable[[Numbers], Any] | None = None
    """The highest angular frequency of small oscillations, which a step has to resolve; None: the natural one."""
    further_accelerations: tuple[Formula, ...] = ()
    """Of the coordinates behind the first one."""
    loaded: Loaded | None = None
    """The structure that is stepped as a whole, of which the states are what is observed; None of any other model."""
    misses_potential: bool = False
    """Whether positions make forces of which no potential energy is known: energies are kinetic alone."""
    superposed: bool = False
    """Whether the motion of several coordinates is a sum of linear, conservative ones: the energy has their orders."""

    def with_formulas(
        self, formulas: Mapping[str, str], declared: tuple[str, ...], *numbers: Any
    ) -> Model:
        """Return the model of formulas by their names, with declared parameters and numbers of files: see `written`."""
        return self if self.written is None else self.written(formulas, declared, *numbers)

    def with_terms(self, names: Iterable[str]) -> Model:
        """Return the model with the terms of some of `optional`."""
        return self if self.variant is None else self.variant(frozenset(names))

    @property
    def coordinates(self) -> int:
        """Number of coordinates."""
        return len(self.states) // 2

    @property
    def is_alone(self) -> bool:
        """Whether the one coordinate is the whole motion."""
        return self.coordinates == 1 and self.loaded is None

    @property
    def dimensionless(self) -> bool:
        """Whether the states have no units, so that the time has none."""
        return all(state.unit == "1" for state in self.states)

    @property
    def accelerations(self) -> tuple[Formula, ...]:
        """The acceleration of every coordinate."""
        return (self.acceleration, *self.further_accelerations)

    @property
    def forces(self) -> tuple[Formula, ...]:
        """Formulas of what acts: the accelerations, or of a structure the loads that are no tables."""
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
    """Return a formula of a model in its states, ``t`` and its parameters."""
    if not isinstance(formula, str):
        return formula
    return parse(formula, (*(state.name for state in model.states), "t", *parameter_names(model)))


_TAKEN = ("t", "scheme", "case", "level", "status", "end")
"""Names that files and formulas have for something else."""


def fault_of(model: object) -> str:
    """Say why an object from elsewhere is no model; nothing where it is one."""
    if not isinstance(model, Model):
        return f"is no vibsim.models.Model, but of the type {type(model).__name__}"
    if not re.fullmatch("[a-z0-9_]+", model.kind):
        return "its kind must consist of a to z, 0 to 9 and _"
    if fault := hash_fault(model):
        return fault
    if not model.states or len(model.states) != 2 * len(model.accelerations):
        return "it must have a position, a velocity and an acceleration for each coordinate"
    rows: list[State | Parameter | Output] = [*model.states, *model.parameters, *model.outputs]
    names = [row.name for row in rows]
    stored = [*quantities(model, own_velocity=True), *parameter_names(model), *_TAKEN]
    for name in names:
        is_word = keyword.iskeyword(name) or name in FUNCTIONS or name in CONSTANTS
        if is_word or not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name) or stored.count(name) > 1:
            return f"'{name}' cannot be the name of a state, a parameter or an output of it, or is one twice"
    outputs = {output.name: output.formula for output in model.outputs}
    formulas = {
        "kinetic_energy": model.kinetic_energy,
        "potential_energy": model.potential_energy,
        "dissipation": model.dissipation or "0",
        "driving": model.driving or "0",
    }
    pairs = zip(model.positions, model.accelerations, strict=True)
    formulas |= {f"the acceleration of {name}": formula for name, formula in pairs}
    for name, formula in (formulas | outputs).items():
        try:
            tree(model, formula)
        except ExpressionError as error:
            return f"its formula of {name}, {error.text}: {error.rule}"
    # what stands in its place in an experiment
    made = {
        "named": model.named and model.named(model.positions),
        "variant": model.variant and model.variant(frozenset()),
        "written": model.written and model.written({}, ()),
    }
    for name, other in made.items():
        if other is not None and other.kind != model.kind:
            return f"its {name} makes a model of another kind, {other.kind}: leave it out, or write one"
    return ""


def declared_parameters(names: Iterable[str]) -> tuple[Parameter, ...]:
    """Return the parameters that a user declares for formulas."""
    return tuple(
        Parameter(name, 0.0, "1", f"declared parameter {name}", path=f"parameters.{name}")
        for name in names
    )


def speeds(
    positions: Iterable[str], velocities: Iterable[str], accelerations: Iterable[Expression]
) -> Iterator[tuple[str, Expression]]:
    """Yield everything that changes along a motion, with the formula of its rate: the time, positions, velocities."""
    named = tuple(velocities)
    yield "t", ONE
    yield from zip(positions, map(Name, named), strict=True)
    yield from zip(named, accelerations, strict=True)


def rate(
    model: Model, formula: Expression, accelerations: Sequence[Expression] | None = None
) -> Expression:
    """Return how fast a formula changes along a motion of the model, or along one with other accelerations."""
    pushes = accelerations or [tree(model, acceleration) for acceleration in model.accelerations]
    total: Expression = Number(0.0)
    for name, speed in speeds(model.positions, model.velocities, pushes):
        slope = derivative(formula, name)
        if slope != Number(0.0):
            total = Binary("+", total, Binary("*", slope, speed))
    return total


def has_solution(model: Model) -> bool:
    """Tell whether the motion is known: exactly, or to twelve digits by a reference that stops at every corner.

    Of a structure it is known by its modes alone. Of a single motion the
    reference may not exist (`vibsim.simulation.reference.solve`): its numbers are then NaN.
    """
    return model.exact is not None or (model.events is None and model.loaded is None)


def parameter_names(model: Model) -> tuple[str, ...]:
    """Name the parameters as formulas do, in the order of the engine."""
    return tuple(parameter.name for parameter in model.parameters)


def natural_end(model: Model, periods: float, parameters: Numbers) -> Any:
    """Return the time that a number of natural periods (small oscillations) takes, as a number or an array."""
    return periods * (2.0 * math.pi / model.natural_frequency(parameters))


def looked_up(
    model: Model, numbers: Mapping[str, Any], before: Floats | None = None
) -> dict[str, Floats]:
    """Return what the table of a model says, by its names in formulas, in what `numbers` say of t and the parameters.

    Nothing where the model looks none up; `before` is that of `Table.read`.
    """
    if model.lookup is None:
        return {}
    place = values(tree(model, model.lookup.place), numbers)
    return dict(zip((HEIGHT, BEND), model.lookup.table.read(place, before), strict=True))


def table_end(model: Model, parameters: Numbers) -> Any:
    """Return the time at which the last point of the table of `model` is reached, at a constant speed; see `Lookup`."""
    assert model.lookup is not None
    numbers = {row.name: parameters[row.key] for row in model.parameters}
    with np.errstate(divide="ignore"):
        speed = np.asarray(values(tree(model, model.lookup.place), {**numbers, "t": 1.0}), float)
        return model.lookup.table.last / speed


def has_budget(model: Model) -> bool:
    """Tell whether damping, driving forces, friction or impacts change the energy of a model by known amounts."""
    return model.dissipation is not None or model.driving is not None or model.events is not None


def quantities(model: Model, own_velocity: bool = False) -> tuple[str, ...]:
    """Name every quantity of `model` that is stored as a series.

    With `own_velocity` some scheme has another velocity than the centred difference, and `centred` is stored as well.
    """
    return (
        *(state.name for state in model.states),
        *ENERGIES,
        *(BUDGET if has_budget(model) else ()),
        *(output.name for output in model.outputs),
        *(centred(model) if own_velocity else ()),
    )


def has_error_parts(model: Model) -> bool:
    """Tell whether a position's error is a shift in time and a factor of the amplitude: the motion is smooth.

    Across an impact, or a corner of the force, a shift is not all there is; accelerations of a structure are not kept.
    """
    return model.events is None and model.lookup is None and model.loaded is None


def error_parts(model: Model) -> tuple[str, ...]:
    """Name these parts of every position's error, made when levels are compared; empty where there are none."""
    positions = model.positions if has_error_parts(model) else ()
    return tuple(name + end for name in positions for end in (PHASE, AMPLITUDE))


def centred(model: Model) -> tuple[str, ...]:
    """Name the centred differences of the positions, ``[D_2t u]``, the energy by these velocities, its deviation."""
    return tuple(name + CENTRED for name in (*model.velocities, "energy", "energy_deviation"))
