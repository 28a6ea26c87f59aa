r"""The current of an electric circuit, ``L i'' + R i' + i/C = V'(t)``: coil, resistor and capacitor in series.

Source: vibration text (B), section 10.10, equation (118) with the right-hand side V'/L (Kirchhoff). Units: L [H],
R [ohm], C [F], i [A], di_dt [A s-1], V [V]; energy ``L i^2/2 + C v_C^2/2`` [J] of coil and capacitor, whose voltage is
``v_C = V - L di_dt - R i``. The resistor takes ``R i^2``, the source gives ``V i``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache, partial

from vibsim.formula import (
    ZERO,
    Expression,
    Name,
    derivative,
    is_zero,
    parse,
    put,
    to_formula,
)
from vibsim.models.base import FormulaField, Model, Output, Parameter, State, declared_parameters
from vibsim.models.shared.linear_scales import linear_scales
from vibsim.models.shared.mechanical import Forces, mechanical
from vibsim.models.shared.scales import Scales

STATES = (State("i", "A", "current"), State("di_dt", "A s-1", "rate of change of the current"))
PARAMETERS = (
    Parameter("L", 1.0, "H", "inductance", minimum=0.0, exclusive=True),
    Parameter("R", 0.0, "ohm", "resistance", minimum=0.0),
    Parameter("C", 1.0, "F", "capacitance", minimum=0.0, exclusive=True),
)
FORMULAS = (FormulaField("voltage", ("t",), "0", "voltage V(t) of the source [V]", derivatives=1),)


def written(formulas: Mapping[str, str], declared: tuple[str, ...]) -> Model:
    """Return the circuit with a user's voltage, without its resistor.

    Raises ExpressionError if the voltage uses other names than t and parameters.
    """
    return circuit(formulas.get("voltage", "0"), declared, frozenset())


@cache
def circuit(voltage: str, declared: tuple[str, ...], terms: frozenset[str]) -> Model:
    """Return the circuit, with a resistor if `terms` contains ``R``."""
    parameters = (*PARAMETERS, *declared_parameters(declared))
    known = tuple(row.name for row in parameters)

    def read(text: str) -> Expression:
        return parse(text, ("i", "di_dt", "t", *known))

    source = parse(voltage, ("t", *known))
    is_driven, has_resistor = not is_zero(source), "R" in terms
    capacitor = source - read("L*di_dt + R*i" if has_resistor else "L*di_dt")
    forces = Forces(
        spring=read("1/C*i"),
        damping=read("R*di_dt") if has_resistor else ZERO,
        force=derivative(source, "t"),
        mass=Name("L"),
        position="i",
        velocity="di_dt",
    )
    left = "L i'' + R i' + i/C" if has_resistor else "L i'' + i/C"
    right = f"V'(t), V = {to_formula(source)}" if is_driven else "0"
    return mechanical(
        forces,
        parameters,
        states=STATES,
        kind="circuit",
        title="Electric circuit of coil, resistor and capacitor",
        source="vibration text, section 10.10, equation (118)",
        equation=f"{left} = {right}",
        kinetic_energy="0.5*L*i**2",
        potential_energy=put(read("0.5*C*di_dt**2"), "di_dt", capacitor),
        dissipation="R*i**2" if has_resistor else None,
        driving=source * Name("i") if is_driven else None,
        conservative=not is_driven and not has_resistor,
        outputs=(
            Output("capacitor_voltage", "V", "voltage of the capacitor", capacitor),
            Output("source_voltage", "V", "voltage of the source", source),
        ),
        formulas=FORMULAS,
        written=written,
        scales=_scales,
        output_scales=(("capacitor_voltage", "L*i_c/t_c"), ("source_voltage", "L*i_c/t_c")),
        optional=("R",),
        variant=partial(circuit, voltage, declared),
    )


def _scales(forces: Forces) -> Scales | None:
    """Return the scales of the current, with the energy of the coil in place of that of a spring."""
    scales = linear_scales(forces)
    return scales and replace(scales, energy="L*i_c**2")


CIRCUIT = replace(written({}, ()), equation="L i'' + R i' + i/C = V'(t)")
"""The circuit without a voltage, shown with the general equation."""
