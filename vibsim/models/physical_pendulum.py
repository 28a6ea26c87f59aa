r"""The physical pendulum, ``I theta'' + drag abs(theta') theta' + m g L sin theta = 0``: a rigid body that swings.

Source: vibration text (B), section 10.5, equation (90), with L the distance from the pivot to the centre of mass.
Units: inertia I about the pivot [kg m2], m [kg], g [m s-2], L [m], drag (``C_D rho A L^3/2`` of (90)) [kg m2],
theta [rad], omega [rad s-1], energy [J]. Without drag it is a simple pendulum of the length ``I/(m L)``.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from vibsim.models.base import Damping, Floats, Model, Numbers, Output, Parameter
from vibsim.models.pendulum import STATES
from vibsim.models.shared.elliptic import pendulum_motion, pendulum_period
from vibsim.models.shared.scales import Scales

PARAMETERS = (
    Parameter(
        "inertia", 1.0, "kg m2", "moment of inertia about the pivot", minimum=0.0, exclusive=True
    ),
    Parameter("m", 1.0, "kg", "mass of the body", minimum=0.0, exclusive=True),
    Parameter("g", 1.0, "m s-2", "acceleration of gravity", minimum=0.0, exclusive=True),
    Parameter(
        "L", 1.0, "m", "distance of the centre of mass from the pivot", minimum=0.0, exclusive=True
    ),
    Parameter("drag", 0.0, "kg m2", "moment of the air resistance at omega = 1", minimum=0.0),
)
DRAGGED = "inertia theta'' + drag abs(theta') theta' + m g L sin(theta) = 0"
WEIGHT = "-(m*g*L/inertia)*sin(theta)"
PIVOT = Output(
    "pivot_force", "N", "force along the rod in the pivot", "m*g*cos(theta) + m*L*omega**2"
)
AIR = Output("drag_moment", "N m", "moment of the air resistance", "-drag*abs(omega)*omega")
SCALES = Scales(
    time="sqrt(inertia/(m*g*L))",
    position="1",
    energy="m*g*L",
    numbers=(("kappa", "m*L**2/inertia"),),
    parameters=(
        ("inertia", "1"),
        ("m", "m*L**2/inertia"),
        ("g", "inertia/(m*L**2)"),
        ("L", "1"),
        ("drag", "drag/inertia"),
    ),
    outputs=(("pivot_force", "m*g"), ("drag_moment", "m*g*L")),
)
"""In them inertia and L are 1, and ``m = 1/g``."""
ALPHA = ("alpha", "drag/inertia")


def natural_frequency(parameters: Numbers) -> Any:
    """Return the angular frequency of small oscillations, ``sqrt(m g L/I)`` [rad s-1]."""
    p = parameters
    return np.sqrt(p["m"] * p["g"] * p["L"] / p["inertia"])


def _as_simple(parameters: Numbers) -> dict[str, Any]:
    """Return the parameters of the simple pendulum that moves in the same way."""
    p = parameters
    return {"g": p["m"] * p["g"] * p["L"], "L": p["inertia"]}


def exact(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
    """Return the exact theta and omega of the motion without drag, by those of the simple pendulum."""
    return pendulum_motion(t, initial, _as_simple(parameters))


def exact_period(initial: Numbers, parameters: Numbers) -> Any:
    """Return the exact period without drag: of an oscillation, or of one turn."""
    return pendulum_period(initial, _as_simple(parameters))


@cache
def physical_pendulum(terms: frozenset[str]) -> Model:
    """Return the physical pendulum, with air resistance where `terms` has ``drag``."""
    free: dict[str, Any] = {
        "equation": "inertia theta'' + m g L sin(theta) = 0",
        "acceleration": WEIGHT,
        "conservative": True,
        "exact": exact,
        "exact_period": exact_period,
        "outputs": (PIVOT,),
    }
    dragged: dict[str, Any] = {
        "equation": DRAGGED,
        "acceleration": f"-(drag/inertia)*abs(omega)*omega + ({WEIGHT})",
        "conservative": False,
        "damping": Damping("quadratic", "drag/inertia"),
        "dissipation": "drag*abs(omega)*omega**2",
        "outputs": (PIVOT, AIR),
    }
    return Model(
        kind="physical_pendulum",
        title="Physical pendulum",
        source="vibration text, section 10.5, equation (90)",
        states=STATES,
        parameters=PARAMETERS,
        kinetic_energy="0.5*inertia*omega**2",
        potential_energy="2.0*m*g*L*sin(0.5*theta)**2",
        energy_unit="J",
        linear=False,
        natural_frequency=natural_frequency,
        turn=2 * math.pi,
        scales=replace(SCALES, numbers=(*SCALES.numbers, ALPHA)) if "drag" in terms else SCALES,
        optional=("drag",),
        variant=physical_pendulum,
        **(dragged if "drag" in terms else free),
    )


PHYSICAL_PENDULUM = replace(physical_pendulum(frozenset()), equation=DRAGGED)
"""The pendulum without air resistance, under the equation that has it."""
