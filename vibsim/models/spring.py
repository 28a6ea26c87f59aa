r"""The mass on a spring without damping, ``u'' + w^2 u = 0``.

Source: vibration text (B), sections 1-7, equation (1), with any initial velocity V (exercise 5). Units: w [rad s-1],
u [m], v [m s-1]; the energy is that of a unit mass, ``v^2/2 + w^2 u^2/2`` [m2 s-2], equation (45).

Scaled by ``t_c = 2 pi/w`` it is the same model with ``w = 2 pi`` and initial position 1 (section 2.3); scaled by
``t_c = 1/w`` it has ``w = 1``, initial position 1 and initial velocity ``beta = V/(I w)`` (section 10.1).
"""

from __future__ import annotations

from vibsim.models.base import Model, Parameter
from vibsim.models.shared.linear_motion import harmonic
from vibsim.models.shared.mechanical import STATES
from vibsim.models.shared.scales import Scales

SPRING = Model(
    kind="spring",
    title="Mass on a spring",
    source="vibration text, section 1.1",
    equation="u'' + w^2 u = 0",
    states=STATES,
    parameters=(Parameter("w", 1.0, "rad s-1", "angular frequency", minimum=0.0, exclusive=True),),
    acceleration="-w**2*u",
    kinetic_energy="0.5*v**2",
    potential_energy="0.5*(w*u)**2",
    energy_unit="m2 s-2",
    linear=True,
    conservative=True,
    # B, section 10.1; without an initial position the amplitude is V/w
    scales=Scales(
        time="1/w",
        position="where(u != 0, abs(u), abs(v)/w)",
        energy="(w*u_c)**2",
        numbers=(("beta", "v/(w*u)"),),
        parameters=(("w", "1"),),
    ),
    **harmonic(STATES, lambda parameters: parameters["w"]),
)
