r"""A washing machine on springs and dampers, ``m u'' + b u' + k u = e W^2 cos(W t)``: a rotating unbalance.

Source: vibration text (B), section 10.4 (unfinished there); the force is that of a mass m_e which turns at a distance r
with the angular speed W: ``e = m_e r`` [kg m], and m [kg] is the mass of everything that moves. Units: k [N m-1],
b [kg s-1], speed W [rad s-1], u [m]. The steady amplitude is ``e W^2/sqrt((k - m W^2)^2 + (b W)^2)``: small below
resonance, e/m far above it. The floor carries ``k u + b u'`` in addition to the weight; the machine jumps when that
pulls up more than the weight.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from vibsim.formula import parse
from vibsim.models.base import Model, Output, Parameter
from vibsim.models.shared.mechanical import Forces, mechanical

PARAMETERS = (
    Parameter("m", 1.0, "kg", "mass", minimum=0.0, exclusive=True),
    Parameter("k", 1.0, "N m-1", "stiffness of the springs", minimum=0.0, exclusive=True),
    Parameter("b", 0.0, "kg s-1", "coefficient of the dampers", minimum=0.0),
    Parameter("unbalance", 1.0, "kg m", "unbalanced mass times its distance from the axis"),
    Parameter("speed", 0.5, "rad s-1", "angular speed of the drum", minimum=0.0),
)


@cache
def washing_machine(terms: frozenset[str]) -> Model:
    """Return the machine, with dampers if `terms` contains ``b``."""
    names = ("u", "v", "t", *(row.name for row in PARAMETERS))
    damping, floor, term = ("b*v", "k*u + b*v", "b u' + ") if "b" in terms else ("0", "k*u", "")
    return mechanical(
        Forces(
            spring=parse("k*u", names),
            damping=parse(damping, names),
            force=parse("unbalance*speed**2*cos(speed*t)", names),
            mass=parse("m", names),
        ),
        PARAMETERS,
        kind="washing_machine",
        title="Washing machine with an unbalance",
        source="vibration text, section 10.4",
        equation=f"m u'' + {term}k u = unbalance speed^2 cos(speed t)",
        output_scales=(("floor_force", "k*u_c"),),
        outputs=(Output("floor_force", "N", "force on the floor beside the weight", floor),),
        optional=("b",),
        variant=washing_machine,
    )


WASHING_MACHINE = replace(
    washing_machine(frozenset()), equation="m u'' + b u' + k u = unbalance speed^2 cos(speed t)"
)
"""The machine without dampers, shown with the equation that has them."""
