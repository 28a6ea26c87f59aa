r"""A system of equations that a user writes: ``x'' = a(x, y, ..., x', y', ..., t)`` for each of its coordinates.

The velocity of x is named vx; in a system whose only coordinate is u, it is v. Instead of accelerations a user may
write forces and masses, ``m x'' = F``. The mass matrix may depend on positions and have off-diagonal entries; the
velocity terms that follow are added to the equations (`vibsim.models.shared.inertia`). Everything is dimensionless.

Instead of forces a user may write the motion of each coordinate (a manufactured solution; vibration text (B), section
2.2 and exercises 9 and 23): the missing forces are then added, and the initial values are those of the motion. Events
and a stop may be written as well (`vibsim.models.shared.crossings`).
"""

from __future__ import annotations

import operator
from collections.abc import Mapping
from dataclasses import replace
from functools import cache, partial, reduce
from typing import Any

from vibsim.formula import (
    ZERO,
    Expression,
    Name,
    derivative,
    is_linear,
    parse,
    replacing,
    to_formula,
)
from vibsim.formula.algebra import is_jump, terms_of
from vibsim.formula.tree import walk
from vibsim.models.base import Damping, FormulaField, Model, Output
from vibsim.models.shared.coordinates import states_of, velocities_of
from vibsim.models.shared.crossings import described
from vibsim.models.shared.inertia import MASS
from vibsim.models.shared.mechanical import damping_of
from vibsim.models.shared.written_system import INPUT, WrittenSystem
from vibsim.models.table import HEIGHT, Lookup, Table

SHOWN = 6
"""Largest number of equations that are all shown; otherwise the first ones and the last."""


ACCELERATION = "acceleration of each coordinate"
FORCE = "force on each coordinate, instead of its acceleration"
MASSES = "mass of each coordinate, or of all, beside its force; 1 when left out; of two together {x: {y: ...}}"
POTENTIAL = "potential energy, or its terms, where it cannot be found"
KINETIC = "kinetic energy, or its terms, where it is not that of the masses"
OUTPUTS = "further series, each with a name of your own"
TABLED = "series of a table, which accelerations, forces and outputs may name"
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
    own = WrittenSystem(coordinates, dict(formulas), declared, lookup)
    motion = own.manufactured
    more: dict[str, Any] = {}
    is_conservative = motion is None and own.vanishes(own.powers)
    if not is_conservative:
        more |= own.damped_and_driven
    if motion is not None:
        more |= {"exact": motion.exact, "start": motion.start}
    outputs = (key.partition(".") for key, _ in formulas)
    if len(coordinates) == 1:
        linear = is_linear(own.accelerations[0], coordinates[0], (*own.states, "t", HEIGHT))
        more |= {"linear": linear, "damping": _damping(own)}
    else:
        more |= {"linear": False, "highest_frequency": own.highest_frequency}
        more["superposed"] = is_conservative and _has_constant_slopes(own)
    if own.crossings is not None:
        more["events"] = own.crossings
        if own.crossings.act:
            is_conservative = False
            more |= {"linear": False, "superposed": False}
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


def _has_constant_slopes(own: WrittenSystem) -> bool:
    """Tell whether the accelerations are linear in all states, with constant coefficients."""
    slopes = (derivative(a, s) for a in own.accelerations for s in own.states if s in a.names)
    jumps = (part for a in own.accelerations for part in walk(a) if is_jump(part))
    return all(map(own.is_constant, (*slopes, *jumps)))


def _damping(own: WrittenSystem) -> Damping | None:
    """Return the damping of the only coordinate, where it is linear or quadratic with a constant rate."""
    (a,), (v,) = own.accelerations, own.velocities
    force = reduce(operator.sub, (term for term in terms_of(a) if v in term.names), ZERO)
    found = damping_of(force, v) if force != ZERO else None
    return Damping(*found) if found is not None and own.is_constant(found[1]) else None


def _sides(own: WrittenSystem, i: int) -> tuple[Expression, Expression]:
    """Return both sides of the equation of a coordinate."""
    accelerations = [Name(f"{name}''") for name in own.coordinates]
    if own.inertia.is_plain:
        return accelerations[i], own.own_accelerations[i]
    left = own.inertia.rest(i)
    for j, acceleration in reversed(list(enumerate(accelerations))):
        left = own.inertia.of(i, j) * acceleration + left
    return left, own.forces[i]


def _equation(own: WrittenSystem) -> str:
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
