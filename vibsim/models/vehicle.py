r"""A vehicle on a bumpy road, ``m u'' + b u' + s(u) = -m h''(speed t) speed^2``: one wheel, a spring and a damper.

Source: vibration text (B), section 10.8, equation (114). The position u [m] is that of the body relative to the road,
whose height h [m] is a formula in the place x [m], or a table of measured heights (`vibsim.models.table`); the vehicle
moves with the constant `speed` [m s-1] from x = 0.
Units: m [kg], b [kg s-1], s [N]. Gravity is left out: it is a static shift of u, ``m g/k`` for a linear spring. The
energy is that of the relative motion; the absolute motion ``u + h`` is an output.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

from vibsim.formula import (
    ZERO,
    Binary,
    Expression,
    Name,
    Number,
    derivative,
    parse,
    plus,
    put,
    times,
    to_formula,
)
from vibsim.models.base import FormulaField, Model, Output, Parameter, declared_parameters
from vibsim.models.shared.linear_scales import linear_scales
from vibsim.models.shared.mechanical import Forces, mechanical
from vibsim.models.shared.scales import Scales
from vibsim.models.table import BEND, HEIGHT, Lookup, Table

PARAMETERS = (
    Parameter("m", 1.0, "kg", "mass of the body", minimum=0.0, exclusive=True),
    Parameter("b", 0.0, "kg s-1", "coefficient of the damper", minimum=0.0),
    Parameter("speed", 1.0, "m s-1", "speed of the vehicle", minimum=0.0),
)
FORMULAS = (
    FormulaField(
        "spring", ("u",), "u", "force s(u) of the spring [N], positive where it pulls back"
    ),
    FormulaField(
        "road",
        ("x",),
        "0",
        "height h(x) of the road [m]",
        table=("x", "h"),
        derivatives=2,
        along="speed*t",
    ),
)
PLACE = Binary("*", Name("speed"), Name("t"))
"""Where the vehicle is."""


def written(formulas: Mapping[str, str], declared: tuple[str, ...]) -> Model:
    """Return the vehicle with the spring and the road of a user, without its damper.

    Raises
    ------
    ExpressionError
        Where a formula names something else than its field allows.
    """
    texts = tuple(formulas.get(field.name, field.default) for field in FORMULAS)
    return vehicle(texts, declared, frozenset())


@cache
def vehicle(
    texts: tuple[str, ...],
    declared: tuple[str, ...],
    terms: frozenset[str],
    lookup: Lookup | None = None,
) -> Model:
    """Return the vehicle, with a damper where `terms` has ``b``, and on the road of a table where there is one."""
    parameters = (*PARAMETERS, *declared_parameters(declared))
    known = tuple(row.name for row in parameters)
    spring = parse(texts[0], ("u", *known))
    road = parse(texts[1], ("x", *known))
    bend, height = _of_table() if lookup else _of_formula(road)
    push = times(Number(-1.0), times(times(Name("m"), bend), parse("speed**2", known)))
    forces = Forces(
        spring=spring,
        damping=parse("b*v", ("v", *known)) if "b" in terms else ZERO,
        force=push,
        mass=Name("m"),
    )
    of_table: dict[str, Any] = {"lookup": lookup, "exact": None}
    damper = "b u' + " if "b" in terms else ""
    told = f"h(x) = {to_formula(road)}" if lookup is None else _told(lookup.table)
    return mechanical(
        forces,
        parameters,
        kind="vehicle",
        title="Vehicle on a bumpy road",
        source="vibration text, section 10.8, equation (114)",
        equation=f"m u'' + {damper}{to_formula(spring)} = -m h''(speed t) speed^2, {told}",
        outputs=(
            Output("road_height", "m", "height of the road under the wheel", height),
            Output("absolute_position", "m", "height of the body", plus(Name("u"), height)),
        ),
        formulas=FORMULAS,
        written=written,
        scales=_no_scales if lookup else _scales,
        powers={"speed": (0, 1, -1)},
        optional=("b",),
        variant=lambda names: vehicle(texts, declared, names, lookup),
        with_table=lambda table, is_met: vehicle(
            texts, declared, terms, Lookup(table, PLACE, is_met)
        ),
        **(of_table if lookup else {}),
    )


def _of_formula(road: Expression) -> tuple[Expression, Expression]:
    """Return second derivative and height of a road where the vehicle is."""
    return put(derivative(derivative(road, "x"), "x"), "x", PLACE), put(road, "x", PLACE)


def _of_table() -> tuple[Expression, Expression]:
    return Name(BEND), Name(HEIGHT)


def _told(table: Table) -> str:
    return f"h(x) from a table of {table.points} points, {table.spacing:g} m apart"


def _scales(forces: Forces) -> Scales | None:
    found = linear_scales(forces)
    return found and replace(found, outputs=(("road_height", "u_c"), ("absolute_position", "u_c")))


def _no_scales(_: Forces) -> None:
    """A table has numbers with units: there is no scaled equation with the same table."""


VEHICLE = replace(written({}, ()), equation="m u'' + b u' + s(u) = -m h''(speed t) speed^2")
"""The vehicle without formulas, under the equation of all."""
