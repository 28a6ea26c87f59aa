r"""The nonlinear pendulum, ``theta'' = -(g/L) sin theta``, optionally with quadratic air resistance.

Source: pendulum lecture (A), sections 1 and 2; vibration text (B), section 10.5, equations (87)-(94). Units: g [m s-2],
L [m], m [kg], theta [rad], omega [rad s-1], energy [J]; with g = L = m = 1 all of them are dimensionless, and the
forces are in units of the weight. The angle is not wrapped: a pendulum that goes over the top keeps counting (A,
section 1.2).

With `drag`, the number alpha of (91), the drag force is ``-m L alpha |omega| omega``, so that
``theta'' = -alpha abs(theta') theta' - (g/L) sin theta``; alpha has no dimension.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from vibsim.models.base import Damping, Model, Numbers, Output, Parameter, State
from vibsim.models.shared.elliptic import pendulum_motion, pendulum_period
from vibsim.models.shared.scales import Scales

STATES = (
    State("theta", "rad", "angle from the downward vertical"),
    State("omega", "rad s-1", "angular velocity"),
)

PARAMETERS = (
    Parameter("g", 1.0, "m s-2", "acceleration of gravity", minimum=0.0, exclusive=True),
    Parameter("L", 1.0, "m", "length of the rod", minimum=0.0, exclusive=True),
    Parameter("m", 1.0, "kg", "mass of the bob", minimum=0.0, exclusive=True),
)
DRAG = Parameter(
    "drag", 0.0, "1", "drag number alpha, the air resistance over that of omega = 1", minimum=0.0
)

DRAGGED = "theta'' = -drag abs(theta') theta' - (g/L) sin(theta)"
WEIGHT = "-(g/L)*sin(theta)"
WIRE = Output("wire_force", "N", "force in the wire", "m*g*cos(theta) + m*L*omega**2")
AIR = Output("drag_force", "N", "drag force on the bob", "-m*L*drag*abs(omega)*omega")

SCALES = Scales(
    time="sqrt(L/g)", position="1", energy="m*g*L", parameters=(("g", "1"), ("L", "1"), ("m", "1"))
)
"""Scales in which g = L = m = 1 (A, section 1.2); they leave the drag number unchanged."""


def natural_frequency(parameters: Numbers) -> Any:
    """Return the angular frequency of small oscillations, ``sqrt(g/L)`` [rad s-1] (A, section 1.3)."""
    return np.sqrt(parameters["g"] / parameters["L"])


@cache
def pendulum(terms: frozenset[str]) -> Model:
    """Return the pendulum, with air resistance if `terms` contains ``drag``."""
    is_dragged = "drag" in terms
    return Model(
        kind="pendulum",
        title="Nonlinear pendulum",
        source="pendulum lecture, sections 1-2; vibration text, section 10.5",
        equation=DRAGGED if is_dragged else "theta'' = -(g/L) sin(theta)",
        states=STATES,
        parameters=(*PARAMETERS, DRAG),
        acceleration=f"-drag*abs(omega)*omega + ({WEIGHT})" if is_dragged else WEIGHT,
        kinetic_energy="0.5*m*(L*omega)**2",
        # 1 - cos(theta) = 2 sin^2(theta/2), without the cancellation at small angles
        potential_energy="2.0*m*g*L*sin(0.5*theta)**2",
        energy_unit="J",
        linear=False,
        conservative=not is_dragged,
        natural_frequency=natural_frequency,
        turn=2 * np.pi,
        scales=replace(
            SCALES,
            numbers=(("alpha", "drag"),) if is_dragged else (),
            parameters=(*(SCALES.parameters or ()), ("drag", "drag")),
            outputs=((WIRE.name, "m*g"), (AIR.name, "m*g")),
        ),
        optional=("drag",),
        variant=pendulum,
        exact=None if is_dragged else pendulum_motion,
        exact_period=None if is_dragged else pendulum_period,
        damping=Damping("quadratic", "drag") if is_dragged else None,
        dissipation="m*L**2*drag*abs(omega)*omega**2" if is_dragged else None,
        outputs=(WIRE, AIR) if is_dragged else (WIRE,),
    )


PENDULUM = replace(pendulum(frozenset()), equation=DRAGGED)
"""The pendulum without air resistance, shown with the equation that has it."""
