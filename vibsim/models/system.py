r"""A system of equations that a user writes: ``x'' = a(x, y, ..., x', y', ..., t)`` for each of its coordinates.

The velocity of x is named vx; in a system whose only coordinate is u, it is v. Instead of accelerations a user may
write forces and masses, ``m x'' = F``. The mass matrix may depend on positions and have off-diagonal entries; the
velocity terms that follow are added to the equations (`vibsim.models.shared.inertia`). Everything is dimensionless.

Energy: kinetic ``sum M_ij v_i v_j/2`` and a potential V, unless a user writes them. V is minus the work, from the
origin, of the terms of the forces that depend on positions alone,
``-sum_i int_0^(x_i) F_i(x_1, ..., x_(i-1), s, 0, ..., 0) ds``, if rules can integrate it and its gradient gives these
terms; otherwise V is 0. The power of everything else follows from the equations, ``P = dE/dt``, and a system is
conservative if P vanishes. Terms of forces that contain the time drive; the rest of P is dissipated. Both conditions
are tested numerically at random states and parameters, because equal functions may have different formulas.

Frequencies are those of small oscillations about the origin, ``w^2`` the positive eigenvalues of ``-da/dx`` at t = 0.

Instead of forces a user may write the motion of each coordinate (a manufactured solution; vibration text (B), section
2.2 and exercises 9 and 23): the missing forces are then added, and the initial values are those of the motion. Events
and a stop may be written as well (`vibsim.models.shared.crossings`).
"""

from __future__ import annotations

import keyword
import operator
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial, reduce
from typing import Any

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.formula import (
    CONSTANTS,
    FUNCTIONS,
    ZERO,
    Binary,
    Call,
    Expression,
    Name,
    Negate,
    derivative,
    has_rule,
    integral,
    parse,
    put,
    replacing,
    to_formula,
    values_of,
)
from vibsim.formula.algebra import is_jump
from vibsim.formula.tree import paired, walk
from vibsim.models.base import (
    BUDGET,
    ENERGIES,
    Damping,
    FormulaField,
    Model,
    Numbers,
    Output,
    Parameter,
    State,
    declared_parameters,
    speeds,
    tree,
)
from vibsim.models.events import Crossings
from vibsim.models.shared.crossings import crossings, described
from vibsim.models.shared.inertia import MASS, Inertia, inertia
from vibsim.models.shared.manufactured import Manufactured
from vibsim.models.shared.mechanical import damping_of
from vibsim.models.table import HEIGHT, Lookup, Table

MOST = 64
"""Largest number of coordinates."""
NUMBERS = (
    *("period", "amplitude", "frequency", "growth_per_period", "relative_energy_error"),
    *("peak", "trough", "scalar", "theory", "measured", "work", "energy_drift", "check"),
)
"""Prefixes of names of variables in results, beside the energies."""
SECTIONS = ("initial", "model", "schemes", "time")
"""Prefixes of names of swept values."""
TAKEN = frozenset(
    """
    t scheme case decay_rate level pair triple norm norm_seconds check steps dt end index extremum size_over
    first_peak last_peak status last_step failure_time natural_frequency omega_dt
    highest_omega_dt stability_limit size_over_exact force_evaluations_total accepted_steps
    exact_period
    """.split()  # noqa: SIM905
)
"""Other reserved names: variables of results, and names that would make one together with a suffix of results."""
TESTS = 24
"""Number of random points at which formulas are compared."""
AGREE = 1e-9
"""Largest difference of equal formulas, relative to the size of their terms."""
SHOWN = 6
"""Largest number of equations that are all shown; otherwise the first ones and the last."""


def velocities_of(coordinates: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the velocities."""
    return ("v",) if coordinates == ("u",) else tuple(f"v{name}" for name in coordinates)


def states_of(coordinates: tuple[str, ...], word: str) -> tuple[State, ...]:
    """Return the states of coordinates without units; `word` says what they are."""
    positions = (State(name, "1", word) for name in coordinates)
    return (*positions, *(State(name, "1", "velocity") for name in velocities_of(coordinates)))


def name_fault(name: str, others: tuple[str, ...] = ()) -> str:
    """Return why a name cannot name a coordinate, a velocity or an output beside `others`; empty if it can."""
    if not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name):
        return "must consist of letters, digits and _, and begin with a letter"
    if keyword.iskeyword(name):
        return f"'{name}' is a word of the grammar of formulas and cannot be a name"
    if name in FUNCTIONS or name in CONSTANTS:
        return f"'{name}' is a {'function' if name in FUNCTIONS else 'constant'} of formulas"
    stored = (*ENERGIES, *BUDGET, *NUMBERS)
    if name in TAKEN or name in stored or name in others:
        return f"'{name}' has another meaning already, in formulas or in results"
    pairs = [*((name, of) for of in (*stored, *SECTIONS, *others)), *((of, name) for of in others)]
    for longer, shorter in pairs:
        if longer.startswith(f"{shorter}_"):
            return f"'{longer}' is what results may call something of '{shorter}'"
    return ""


def coordinate_faults(coordinates: Sequence[str]) -> Iterator[str]:
    """Yield for each name why it cannot name a coordinate beside those before it; empty if it can."""
    before: list[str] = []
    for name in coordinates:
        velocity = velocities_of(tuple(coordinates) if len(coordinates) == 1 else (name, ""))[0]
        fault = name_fault(name, tuple(before))
        yield fault or name_fault(velocity, (*before, name))
        before += [name, velocity]


ACCELERATION = "acceleration of each coordinate"
FORCE = "force on each coordinate, instead of its acceleration"
MASSES = "mass of each coordinate, or of all, beside its force; 1 when left out; of two together {x: {y: ...}}"
POTENTIAL = "potential energy, or its terms, where it cannot be found"
KINETIC = "kinetic energy, or its terms, where it is not that of the masses"
OUTPUTS = "further series, each with a name of your own"
TABLED = "series of a table, which accelerations, forces and outputs may name"
INPUT = "input"
"""Name of the table's current value in formulas."""
EXACT = "exact solution of each coordinate, for which forces are then added"


def fields(coordinates: tuple[str, ...]) -> tuple[FormulaField, ...]:
    """Return the formulas that a user may write for a system with these coordinates."""
    velocities = velocities_of(coordinates)
    states, known = (*coordinates, *velocities), (*coordinates, *velocities, "t")
    of_each: dict[str, Any] = {"of": "coordinate"}
    return (
        FormulaField("acceleration", known, f"-{coordinates[0]}", ACCELERATION, **of_each),
        FormulaField("force", known, "", FORCE, instead_of="acceleration", **of_each),
        FormulaField(
            MASS, coordinates, "", MASSES, beside="force", positive=True, paired=True, **of_each
        ),
        FormulaField("potential", states, "", POTENTIAL, of="term"),
        FormulaField("kinetic", states, "", KINETIC, of="term"),
        FormulaField("outputs", known, "", OUTPUTS, of="output"),
        FormulaField(INPUT, ("t",), "", TABLED, table=("x", "h"), tabled=True),
        FormulaField("exact", ("t",), "", EXACT, derivatives=2, **of_each),
    )


@dataclass(frozen=True)
class Written:
    """The parsed formulas of a user."""

    coordinates: tuple[str, ...]
    formulas: Mapping[str, str]
    declared: tuple[str, ...]
    lookup: Lookup | None = None

    @cached_property
    def velocities(self) -> tuple[str, ...]:
        """Names of the velocities."""
        return velocities_of(self.coordinates)

    @cached_property
    def states(self) -> tuple[str, ...]:
        """All positions, then all velocities."""
        return (*self.coordinates, *self.velocities)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """The declared parameters."""
        return declared_parameters(self.declared)

    def read(self, key: str, default: str = "") -> Expression:
        """Return a formula by its key, or `default` if the user wrote none."""
        known = (*self.states, "t", *self.declared)
        if self.lookup is None:
            return parse(self.formulas.get(key, default), known)
        return put(parse(self.formulas.get(key, default), (*known, INPUT)), INPUT, Name(HEIGHT))

    def terms(self, name: str) -> list[Expression]:
        """Return the terms of a sum in their order; empty if the user wrote none."""
        keys = [key for key in self.formulas if key.partition(".")[0] == name]
        return [self.read(key) for key in sorted(keys, key=lambda key: int(key.partition(".")[2]))]

    @cached_property
    def inertia(self) -> Inertia:
        """The mass matrix; the mass is 1 if accelerations are written."""
        return inertia(self.formulas, self.coordinates, self.velocities, self.declared)

    @cached_property
    def forces(self) -> tuple[Expression, ...]:
        """The forces, or the accelerations if these are written."""
        field = "force" if f"force.{self.coordinates[0]}" in self.formulas else "acceleration"
        return tuple(self.read(f"{field}.{name}", f"-{name}") for name in self.coordinates)

    @cached_property
    def own_accelerations(self) -> tuple[Expression, ...]:
        """The accelerations without the additional forces of a manufactured solution."""
        return self.inertia.accelerations(self.forces)

    @cached_property
    def crossings(self) -> Crossings | None:
        """The events, if any are written."""
        return crossings(self.formulas, (*self.states, "t", *self.declared))

    @cached_property
    def manufactured(self) -> Manufactured | None:
        """The manufactured solution, if it is written."""
        keys = [f"exact.{name}" for name in self.coordinates]
        if keys[0] not in self.formulas:
            return None
        texts = tuple(self.formulas[key] for key in keys)
        return Manufactured(tuple(map(self.read, keys)), texts, self.states, self.parameters)

    @cached_property
    def accelerations(self) -> tuple[Expression, ...]:
        """The accelerations."""
        own, motion = self.own_accelerations, self.manufactured
        if motion is None:
            return own
        return tuple(a + push for a, push in zip(own, motion.forces(own), strict=True))

    @cached_property
    def kinetic(self) -> Expression:
        """The kinetic energy."""
        if terms := self.terms("kinetic"):
            return paired(terms, operator.add)
        return self.inertia.kinetic

    @cached_property
    def position_forces(self) -> list[Expression]:
        """The sum of the terms of every force that depend on neither velocities nor time."""
        moving = {*self.velocities, "t", HEIGHT}
        return [
            sum((term for term in terms_of(whole) if moving.isdisjoint(term.names)), ZERO)
            for whole in self.forces
        ]

    @property
    def misses_potential(self) -> bool:
        """Tell whether there are forces that depend on positions alone, but no potential energy is known."""
        acts = any(not force.names.isdisjoint(self.coordinates) for force in self.position_forces)
        return acts and self.potential == ZERO and not self.terms("potential")

    @cached_property
    def potential(self) -> Expression:
        """The potential energy; 0 if none is known."""
        if terms := self.terms("potential"):
            return paired(terms, operator.add)
        total, forces = [], self.position_forces
        for i, (name, force) in enumerate(zip(self.coordinates, forces, strict=True)):
            for later in self.coordinates[i + 1 :]:
                if later in force.names:
                    force = put(force, later, ZERO)
            if not has_rule(force, name):
                return ZERO
            work = integral(force, name)
            total.append(-work)
        found: Expression = paired(total, operator.add)
        slopes = (derivative(found, name) for name in self.coordinates)
        sums = ([slope, force] for slope, force in zip(slopes, forces, strict=True))
        return found if all(map(self.vanishes, sums)) else ZERO

    @cached_property
    def powers(self) -> tuple[Expression, ...]:
        """The terms of the power ``dE/dt``."""
        return self._powers(self.accelerations)

    def _powers(self, accelerations: tuple[Expression, ...]) -> tuple[Expression, ...]:
        found = (
            derivative(energy, name) * speed
            for name, speed in speeds(self.coordinates, self.velocities, accelerations)
            for energy in (self.kinetic, self.potential)
        )
        return tuple(term for term in found if term != ZERO)

    @cached_property
    def damped_and_driven(self) -> dict[str, Expression]:
        """The power that is lost, and that of the terms of the forces that name the time or the table.

        Beside an exact solution, and for a kinetic energy that is written, all is one power.
        """
        power, moving = paired(self.powers, operator.add), {"t", HEIGHT}
        if moving.isdisjoint(power.names):
            return {"dissipation": -power}
        if self.manufactured is not None or self.terms("kinetic"):
            return {"driving": power}
        driving, rest = ZERO, []
        for force, velocity in zip(self.forces, self.velocities, strict=True):
            terms = list(terms_of(force))
            pushes = [term for term in terms if not moving.isdisjoint(term.names)]
            driving += sum(pushes, ZERO) * Name(velocity)
            rest.append(sum((term for term in terms if moving.isdisjoint(term.names)), ZERO))
        left = self._powers(self.inertia.accelerations(rest))
        lost = {} if self.vanishes(left) else {"dissipation": -paired(left, operator.add)}
        return {"driving": driving, **lost}

    def is_constant(self, node: Expression) -> bool:
        """Tell whether a formula depends on parameters alone."""
        return {*self.states, "t", HEIGHT}.isdisjoint(node.names)

    def vanishes(self, terms: Any) -> bool:
        """Tell whether a sum is 0 at all random test points where it is finite, and finite at one at least."""
        rng = np.random.default_rng(21)
        numbers = {name: rng.uniform(-1.0, 1.0, TESTS) for name in self.states}
        numbers |= {name: rng.uniform(0.3, 1.7, TESTS) for name in ("t", HEIGHT, *self.declared)}
        found = [np.broadcast_to(value, TESTS) for value in values_of(list(terms), numbers)]
        if not found:
            return True
        total, size = np.sum(found, axis=0), np.sum(np.abs(found), axis=0)
        known = np.isfinite(total)
        return bool(known.any() and np.all(np.abs(total[known]) <= AGREE * size[known]))

    @cached_property
    def stiffness(self) -> dict[tuple[int, int], Expression]:
        """Entries of ``-da/dx`` that are not 0, by row and column."""
        return self.minus_jacobian(self.coordinates)

    @cached_property
    def couplings(self) -> dict[tuple[int, int], Expression]:
        """Entries of ``-da/dv`` that are not 0, by row and column."""
        return self.minus_jacobian(self.velocities)

    def minus_jacobian(self, states: Sequence[str]) -> dict[tuple[int, int], Expression]:
        """Return the nonzero entries of minus the Jacobian of the accelerations with respect to `states`."""
        found = {
            (i, j): -derivative(a, name)
            for i, a in enumerate(self.own_accelerations)
            for j, name in enumerate(states)
        }
        return {place: entry for place, entry in found.items() if entry != ZERO}

    def frequencies(self, parameters: Numbers) -> Floats:
        """Return the angular frequencies of small oscillations, increasing, padded with NaN, shape (..., n).

        Gyroscopic coupling of velocities (with opposite signs, as in a magnetic field or a rotating frame) is included;
        damping is not.
        """
        numbers = {row.name: np.asarray(parameters[row.key], float) for row in self.parameters}
        shape = np.broadcast_shapes(*(number.shape for number in numbers.values()))
        at_origin = dict.fromkeys((*self.states, "t", HEIGHT), np.zeros(()))
        count = len(self.coordinates)
        stiffness, coupling = np.zeros((2, *shape, count, count))
        for matrix, formulas in ((stiffness, self.stiffness), (coupling, self.couplings)):
            entries = values_of(list(formulas.values()), numbers | at_origin)
            for (i, j), entry in zip(formulas, entries, strict=True):
                matrix[..., i, j] = entry
        # NaN for matrices that are not finite
        is_known = np.isfinite(stiffness).all(axis=(-2, -1), keepdims=True)
        squares = np.linalg.eigvals(np.where(is_known, stiffness, 0.0))
        largest = np.max(np.abs(squares), axis=-1, keepdims=True)
        is_one = (squares.real > 1e-12 * largest) & (np.abs(squares.imag) <= 1e-9 * largest)
        found = np.sort(np.sqrt(np.where(is_one, squares.real, np.nan)), axis=-1)
        # gyroscopic terms have opposite signs; damping, also on the diagonal, has equal signs
        turning = np.where(coupling * np.swapaxes(coupling, -1, -2) < 0.0, coupling, 0.0)
        is_known = is_known[..., 0, 0] & np.isfinite(turning).all(axis=(-2, -1))
        turns = (is_known & np.any(turning, axis=(-2, -1)))[..., None]
        if not turns.any():
            return found
        return np.where(turns, _of_first_order(stiffness, turning, turns), found)

    def natural_frequency(self, parameters: Numbers) -> Any:
        """Return the lowest frequency; NaN if there is none."""
        return self.frequencies(parameters)[..., 0]

    def highest_frequency(self, parameters: Numbers) -> Any:
        """Return the highest frequency; NaN if there is none."""
        return np.fmax.reduce(self.frequencies(parameters), axis=-1)


def _of_first_order(stiffness: Floats, turning: Floats, known: Flags) -> Floats:
    """Return the frequencies of ``x'' + G x' + K x = 0``, increasing, padded with NaN, shape (..., n)."""
    still = np.zeros_like(stiffness)
    rows = [[still, still + np.eye(stiffness.shape[-1])], [-stiffness, -turning]]
    matrix = np.where(known[..., None], np.block(rows), 0.0)
    rates = np.linalg.eigvals(matrix)
    largest = np.max(np.abs(rates), axis=-1, keepdims=True)
    is_one = (rates.imag > 1e-6 * largest) & (np.abs(rates.real) <= 1e-9 * largest)
    found = np.sort(np.where(is_one, rates.imag, np.nan), axis=-1)
    return np.asarray(found[..., : stiffness.shape[-1]])


def angles(model: Model) -> Iterator[str]:
    """Yield the coordinates whose sine or cosine, or that of a sum of two, is in the equation: angles."""
    for formula in model.accelerations:
        for node in walk(tree(model, formula)):
            if isinstance(node, Call) and node.function in ("sin", "cos"):
                (angle,) = node.arguments
                is_sum = isinstance(angle, Binary) and angle.operator in "+-"
                sides = angle.operands if is_sum else (angle,)
                yield from (side.name for side in sides if isinstance(side, Name))


def terms_of(node: Expression) -> Iterator[Expression]:
    """Yield the terms of a sum, with factors and divisors of sums multiplied out."""
    match node:
        case Binary("+", left, right):
            yield from terms_of(left)
            yield from terms_of(right)
        case Binary("-", left, right):
            yield from terms_of(left)
            yield from (Negate(term) for term in terms_of(right))
        case Negate(operand):
            yield from (Negate(term) for term in terms_of(operand))
        case Binary("/", left, right):
            yield from (term / right for term in terms_of(left))
        case Binary("*", left, right) if len(_sum := list(terms_of(right))) > 1:
            yield from (left * term for term in _sum)
        case Binary("*", left, right) if len(_sum := list(terms_of(left))) > 1:
            yield from (term * right for term in _sum)
        case _:
            yield node


def named(coordinates: tuple[str, ...]) -> Model:
    """Return the system with these coordinates and no formulas."""
    return written(coordinates, {}, ())


def written(
    coordinates: tuple[str, ...],
    formulas: Mapping[str, str],
    declared: tuple[str, ...],
    table: Table | None = None,
    is_met: bool = False,
) -> Model:
    """Return the system with given formulas and declared parameters.

    Raises ExpressionError if a formula uses a name that its field does not allow.

    Parameters
    ----------
    formulas
        By the names of `fields`; those of coordinates and outputs as ``acceleration.x``.
    """
    lookup = None
    if table is not None:
        lookup = Lookup(table, parse(formulas[INPUT], ("t", *declared)), is_met)
    return system(coordinates, tuple(sorted(formulas.items())), declared, lookup)


@cache
def system(
    coordinates: tuple[str, ...],
    formulas: tuple[tuple[str, str], ...],
    declared: tuple[str, ...],
    lookup: Lookup | None = None,
) -> Model:
    """Return the system with given formulas; see `written`."""
    own = Written(coordinates, dict(formulas), declared, lookup)
    motion = own.manufactured
    more: dict[str, Any] = {}
    is_conservative = motion is None and own.vanishes(own.powers)
    if not is_conservative:
        more |= own.damped_and_driven
    if motion is not None:
        more |= {"exact": motion.exact, "start": motion.start}
    outputs = (key.partition(".") for key, _ in formulas)
    if len(coordinates) == 1:
        more |= {"linear": _is_linear(own), "damping": _damping(own)}
    else:
        more |= {"linear": False, "highest_frequency": own.highest_frequency}
        more["superposed"] = is_conservative and _has_constant_slopes(own)
    if own.crossings is not None:
        is_conservative = False
        more |= {"linear": False, "superposed": False, "events": own.crossings}
    first, *rest = own.accelerations
    return Model(
        kind="system",
        title="System of equations",
        source="the experiment file",
        equation=_equation(own),
        states=states_of(coordinates, "position"),
        parameters=own.parameters,
        acceleration=first,
        further_accelerations=tuple(rest),
        kinetic_energy=own.kinetic,
        potential_energy=own.potential,
        misses_potential=own.misses_potential,
        energy_unit="1",
        conservative=is_conservative,
        natural_frequency=own.natural_frequency,
        outputs=tuple(
            Output(name, "1", name, own.read(f"outputs.{name}"))
            for field, _, name in outputs
            if field == "outputs"
        ),
        formulas=fields(coordinates),
        takes_events=True,
        written=partial(written, coordinates),
        lookup=lookup,
        named=named,
        **more,
    )


def _is_linear(own: Written) -> bool:
    """Tell whether the acceleration of the only coordinate is linear in it, with a constant coefficient."""
    (a,), (u,) = own.accelerations, own.coordinates
    jumps = (part for part in walk(a) if is_jump(part) and u in part.names)
    return not any(jumps) and own.is_constant(derivative(a, u))


def _has_constant_slopes(own: Written) -> bool:
    """Tell whether the accelerations are linear in all states, with constant coefficients."""
    slopes = (derivative(a, s) for a in own.accelerations for s in own.states if s in a.names)
    jumps = (part for a in own.accelerations for part in walk(a) if is_jump(part))
    return all(map(own.is_constant, (*slopes, *jumps)))


def _damping(own: Written) -> Damping | None:
    """Return the damping of the only coordinate, where it is linear or quadratic with a constant rate."""
    (a,), (v,) = own.accelerations, own.velocities
    force = reduce(operator.sub, (term for term in terms_of(a) if v in term.names), ZERO)
    found = damping_of(force, v) if force != ZERO else None
    return Damping(*found) if found is not None and own.is_constant(found[1]) else None


def _sides(own: Written, i: int) -> tuple[Expression, Expression]:
    """Return both sides of the equation of a coordinate."""
    accelerations = [Name(f"{name}''") for name in own.coordinates]
    if own.inertia.is_plain:
        return accelerations[i], own.own_accelerations[i]
    left = own.inertia.rest(i)
    for j, acceleration in reversed(list(enumerate(accelerations))):
        left = own.inertia.of(i, j) * acceleration + left
    return left, own.forces[i]


def _equation(own: Written) -> str:
    """Return the equations of motion as a user would write them."""
    speeds = zip(own.velocities, own.coordinates, strict=True)
    shown = replacing({**{v: Name(f"{x}'") for v, x in speeds}, HEIGHT: Name(INPUT)})
    places = list(range(len(own.coordinates)))
    is_long = len(places) > SHOWN
    if is_long:
        places = [*places[: SHOWN // 2], places[-1]]
    lines = [" = ".join(to_formula(shown(side)) for side in _sides(own, i)) for i in places]
    if is_long:
        lines.insert(-1, "...")
    equations = ", ".join(lines)
    if own.lookup is not None:
        table, place = own.lookup.table, own.formulas[INPUT]
        equations += (
            f", {INPUT} from a table of {table.points} points, {table.spacing:g} apart, at {place}"
        )
    if own.crossings is not None:
        equations += described(own.crossings, own.formulas)
    if own.manufactured is None:
        return equations
    motion = (
        f"{name} = {text}"
        for name, text in zip(own.coordinates, own.manufactured.texts, strict=True)
    )
    return f"{equations}, with forces added such that {', '.join(motion)}"


SYSTEM = replace(named(("u",)), equation="x'' = a(x, y, ..., x', y', ..., t) for each coordinate x")
"""The system of one coordinate without formulas, shown with the general equation."""
