r"""The pendulum for small angles, ``theta'' = -(g/L) theta``.

Source: pendulum lecture (A), section 1.3 and the end of section 2.6. Units: g [m s-2], L [m], m [kg], theta [rad],
omega [rad s-1], energy [J]; with g = L = m = 1 all of them are dimensionless. The energy is the small-angle one:
``m (L omega)^2 / 2 + m g L theta^2 / 2``, not that of the nonlinear pendulum.
"""

from __future__ import annotations

from typing import Any

from vibsim.models.base import Floats, Model, Numbers
from vibsim.models.pendulum import PARAMETERS, SCALES, STATES, natural_frequency
from vibsim.models.shared.harmonic import motion, period


def exact(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
    """Return theta and omega of the harmonic oscillation at times `t` (A, section 1.3)."""
    w = natural_frequency(parameters)
    theta, omega = motion(t, w, initial["theta"], initial["omega"])
    return {"theta": theta, "omega": omega}


def exact_period(initial: Numbers, parameters: Numbers) -> Any:
    """Return ``2 pi sqrt(L/g)``, whatever the amplitude; NaN at rest."""
    return period(natural_frequency(parameters), initial["theta"], initial["omega"])


LINEAR_PENDULUM = Model(
    kind="linear_pendulum",
    title="Linear pendulum",
    source="pendulum lecture, sections 1.3 and 2.6",
    equation="theta'' = -(g/L) theta",
    states=STATES,
    parameters=PARAMETERS,
    acceleration="-(g/L)*theta",
    kinetic_energy="0.5*m*(L*omega)**2",
    potential_energy="0.5*m*g*L*theta**2",
    energy_unit="J",
    linear=True,
    conservative=True,
    natural_frequency=natural_frequency,
    exact=exact,
    exact_period=exact_period,
    scales=SCALES,
)
