r"""The nonlinear pendulum, ``theta'' = -(g/L) sin theta``.

Source: pendulum lecture (A), sections 1 and 2; vibration text (B), section 10.5. Units: g [m s-2], L [m], m [kg],
theta [rad], omega [rad s-1], energy [J]; with g = L = m = 1 all of them are dimensionless. The angle is not
wrapped: a pendulum that goes over the top keeps counting (A, section 1.2).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibsim.models.base import Model, Numbers, Parameter, State
from vibsim.models.elliptic import pendulum_motion, pendulum_period
from vibsim.models.scales import Scales

STATES = (
    State("theta", "rad", "angle from the downward vertical"),
    State("omega", "rad s-1", "angular velocity"),
)

PARAMETERS = (
    Parameter("g", 1.0, "m s-2", "acceleration of gravity", minimum=0.0, exclusive=True),
    Parameter("L", 1.0, "m", "length of the rod", minimum=0.0, exclusive=True),
    Parameter("m", 1.0, "kg", "mass of the bob", minimum=0.0, exclusive=True),
)

SCALES = Scales(
    time="sqrt(L/g)",
    position="1",
    energy="m*g*L",
    parameters=(("g", "1"), ("L", "1"), ("m", "1")),
)
"""Those in which g = L = m = 1 (A, section 1.2)."""


def natural_frequency(parameters: Numbers) -> Any:
    """Return the angular frequency of small oscillations, ``sqrt(g/L)`` [rad s-1] (A, section 1.3)."""
    return np.sqrt(parameters["g"] / parameters["L"])


PENDULUM = Model(
    kind="pendulum",
    title="Nonlinear pendulum",
    source="pendulum lecture, sections 1-2",
    equation="theta'' = -(g/L) sin(theta)",
    states=STATES,
    parameters=PARAMETERS,
    acceleration="-(g/L)*sin(theta)",
    kinetic_energy="0.5*m*(L*omega)**2",
    # 1 - cos(theta) = 2 sin^2(theta/2), without the cancellation at small angles
    potential_energy="2.0*m*g*L*sin(0.5*theta)**2",
    energy_unit="J",
    linear=False,
    conservative=True,
    natural_frequency=natural_frequency,
    turn=2 * math.pi,
    exact=pendulum_motion,
    exact_period=pendulum_period,
    scales=SCALES,
)
