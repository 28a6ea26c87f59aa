r"""The physical pendulum, ``I theta'' + drag abs(theta') theta' + m g L sin theta = 0``: a rigid body that swings.

Source: vibration text (B), section 10.5, equation (90), with L the distance from the pivot to the centre of mass.
Units: inertia I about the pivot [kg m2], m [kg], g [m s-2], L [m], drag (``C_D rho A L^3/2`` of (90)) [kg m2],
theta [rad], omega [rad s-1], energy [J]. Without drag it is a simple pendulum of the length ``I/(m L)``.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.models.base import Damping, Model, Numbers, Output, Parameter
from vibsim.models.pendulum import STATES
from vibsim.models.shared.elliptic import pendulum_motion, pendulum_period
from vibsim.models.shared.scales import Scales

POSITIVE: dict[str, Any] = {"minimum": 0.0, "exclusive": True}
PARAMETERS = (
    Parameter("inertia", 1.0, "kg m2", "moment of inertia about the pivot", **POSITIVE),
    Parameter("m", 1.0, "kg", "mass of the body", **POSITIVE),
    Parameter("g", 1.0, "m s-2", "acceleration of gravity", **POSITIVE),
    Parameter("L", 1.0, "m", "distance of the centre of mass from the pivot", **POSITIVE),
    Parameter("drag", 0.0, "kg m2", "moment of the air resistance at omega = 1", minimum=0.0),
)
DRAGGED = "inertia theta'' + drag abs(theta') theta' + m g L sin(theta) = 0"
WEIGHT = "-(m*g*L/inertia)*sin(theta)"
FORCE = "m*g*cos(theta) + m*L*omega**2"
PIVOT = Output("pivot_force", "N", "force along the rod in the pivot", FORCE)
AIR = Output("drag_moment", "N m", "moment of the air resistance", "-drag*abs(omega)*omega")


def _as_simple(p: Numbers) -> dict[str, Any]:
    """Return the parameters of the simple pendulum that moves in the same way without drag."""
    return {"g": p["m"] * p["g"] * p["L"], "L": p["inertia"]}


def exact(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
    """Return the exact theta and omega without drag."""
    return pendulum_motion(t, initial, _as_simple(parameters))


def exact_period(initial: Numbers, parameters: Numbers) -> Any:
    """Return the exact period without drag."""
    return pendulum_period(initial, _as_simple(parameters))


@cache
def physical_pendulum(terms: frozenset[str]) -> Model:
    """Return the physical pendulum, with air resistance if `terms` contains ``drag``."""
    is_dragged = "drag" in terms
    kappa, alpha = ("kappa", "m*L**2/inertia"), ("alpha", "drag/inertia")
    return Model(
        kind="physical_pendulum",
        title="Physical pendulum",
        source="vibration text, section 10.5, equation (90)",
        equation=DRAGGED if is_dragged else "inertia theta'' + m g L sin(theta) = 0",
        states=STATES,
        parameters=PARAMETERS,
        acceleration=f"-(drag/inertia)*abs(omega)*omega + ({WEIGHT})" if is_dragged else WEIGHT,
        kinetic_energy="0.5*inertia*omega**2",
        potential_energy="2.0*m*g*L*sin(0.5*theta)**2",
        energy_unit="J",
        linear=False,
        conservative=not is_dragged,
        natural_frequency=lambda p: np.sqrt(p["m"] * p["g"] * p["L"] / p["inertia"]),
        turn=2 * np.pi,
        # in these scales inertia = L = 1 and m = 1/g
        scales=Scales(
            time="sqrt(inertia/(m*g*L))",
            position="1",
            energy="m*g*L",
            numbers=(kappa, alpha) if is_dragged else (kappa,),
            parameters=(
                ("inertia", "1"),
                ("m", "m*L**2/inertia"),
                ("g", "inertia/(m*L**2)"),
                ("L", "1"),
                ("drag", "drag/inertia"),
            ),
            outputs=(("pivot_force", "m*g"), ("drag_moment", "m*g*L")),
        ),
        optional=("drag",),
        variant=physical_pendulum,
        exact=None if is_dragged else exact,
        exact_period=None if is_dragged else exact_period,
        damping=Damping("quadratic", "drag/inertia") if is_dragged else None,
        dissipation="drag*abs(omega)*omega**2" if is_dragged else None,
        outputs=(PIVOT, AIR) if is_dragged else (PIVOT,),
    )


PHYSICAL_PENDULUM = replace(physical_pendulum(frozenset()), equation=DRAGGED)
"""The pendulum without air resistance, shown with the equation that has it."""
