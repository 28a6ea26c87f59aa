r"""The pendulum for small angles, ``theta'' = -(g/L) theta``.

Source: pendulum lecture (A), section 1.3 and the end of section 2.6. Units: g [m s-2], L [m], m [kg], theta [rad],
omega [rad s-1], energy [J]; with g = L = m = 1 all of them are dimensionless. The energy is the small-angle one:
``m (L omega)^2 / 2 + m g L theta^2 / 2``, not that of the nonlinear pendulum.
"""

from __future__ import annotations

from vibsim.models.base import Model
from vibsim.models.pendulum import PARAMETERS, SCALES, STATES, natural_frequency
from vibsim.models.shared.linear_motion import harmonic

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
    scales=SCALES,
    **harmonic(STATES, natural_frequency),
)
