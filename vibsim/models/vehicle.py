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
    put,
    to_formula,
)
from vibsim.models.base import FormulaField, Model, Output, Parameter, declared_parameters
from vibsim.models.shared.linear_scales import linear_scales
from vibsim.models.shared.mechanical import Forces, mechanical
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
"""Place of the vehicle on the road."""


def written(
    formulas: Mapping[str, str],
    declared: tuple[str, ...],
    table: Table | None = None,
    is_met: bool = False,
) -> Model:
    """Return the vehicle with a user's spring and road (formula or table), without its damper.

    Raises ExpressionError if a formula uses a name that its field does not allow.
    """
    texts = tuple(formulas.get(field.name, field.default) for field in FORMULAS)
    lookup = None if table is None else Lookup(table, PLACE, is_met)
    return vehicle(texts, declared, frozenset(), lookup)


@cache
def vehicle(
    texts: tuple[str, ...],
    declared: tuple[str, ...],
    terms: frozenset[str],
    lookup: Lookup | None = None,
) -> Model:
    """Return the vehicle, with a damper if `terms` contains ``b``, and on the road of the table if there is one."""
    parameters = (*PARAMETERS, *declared_parameters(declared))
    known = tuple(row.name for row in parameters)
    spring, road = parse(texts[0], ("u", *known)), parse(texts[1], ("x", *known))
    bend: Expression = put(derivative(derivative(road, "x"), "x"), "x", PLACE)
    height: Expression = put(road, "x", PLACE)
    road_text, more = f"h(x) = {to_formula(road)}", dict[str, Any]()
    if lookup is not None:
        bend, height, table = Name(BEND), Name(HEIGHT), lookup.table
        road_text = f"h(x) from a table of {table.points} points, {table.spacing:g} m apart"
        more = {"lookup": lookup, "exact": None}
    push = Number(-1.0) * (Name("m") * bend * parse("speed**2", known))
    damping = parse("b*v", ("v", *known)) if "b" in terms else ZERO
    damper = "b u' + " if "b" in terms else ""

    return mechanical(
        Forces(spring, damping, push, mass=Name("m")),
        parameters,
        kind="vehicle",
        title="Vehicle on a bumpy road",
        source="vibration text, section 10.8, equation (114)",
        equation=f"m u'' + {damper}{to_formula(spring)} = -m h''(speed t) speed^2, {road_text}",
        outputs=(
            Output("road_height", "m", "height of the road under the wheel", height),
            Output("absolute_position", "m", "height of the body", Name("u") + height),
        ),
        formulas=FORMULAS,
        written=written,
        # a table has numbers with units: there is no scaled equation with the same table
        scales=(lambda _: None) if lookup else linear_scales,
        output_scales=(("road_height", "u_c"), ("absolute_position", "u_c")),
        powers={"speed": (0, 1, -1)},
        optional=("b",),
        variant=lambda names: vehicle(texts, declared, names, lookup),
        **more,
    )


VEHICLE = replace(written({}, ()), equation="m u'' + b u' + s(u) = -m h''(speed t) speed^2")
"""The vehicle without formulas, shown with the general equation."""
