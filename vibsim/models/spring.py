r"""The mass on a spring without damping, ``u'' + w^2 u = 0``.

Source: vibration text (B), sections 1-7, equation (1), with any initial velocity V (exercise 5). Units: w [rad s-1],
u [m], v [m s-1]; the energy is that of a unit mass, ``v^2/2 + w^2 u^2/2`` [m2 s-2], equation (45).

Scaled by ``t_c = 2 pi/w`` it is the same model with ``w = 2 pi`` and initial position 1 (section 2.3); scaled by
``t_c = 1/w`` it has ``w = 1``, initial position 1 and initial velocity ``beta = V/(I w)`` (section 10.1).
"""

from __future__ import annotations

from typing import Any

from vibsim.models.base import Floats, Model, Numbers, Parameter, State
from vibsim.models.shared.harmonic import motion, period
from vibsim.models.shared.scales import Scales


def natural_frequency(parameters: Numbers) -> Any:
    """Return w [rad s-1]."""
    return parameters["w"]


def exact(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
    """Return u and v at times `t`: B, equation (2), with V sin(w t)/w added for an initial velocity V."""
    u, v = motion(t, parameters["w"], initial["u"], initial["v"])
    return {"u": u, "v": v}


def exact_period(initial: Numbers, parameters: Numbers) -> Any:
    """Return ``2 pi/w``; NaN at rest."""
    return period(parameters["w"], initial["u"], initial["v"])


SPRING = Model(
    kind="spring",
    title="Mass on a spring",
    source="vibration text, section 1.1",
    equation="u'' + w^2 u = 0",
    states=(State("u", "m", "displacement"), State("v", "m s-1", "velocity")),
    parameters=(Parameter("w", 1.0, "rad s-1", "angular frequency", minimum=0.0, exclusive=True),),
    acceleration="-w**2*u",
    kinetic_energy="0.5*v**2",
    potential_energy="0.5*(w*u)**2",
    energy_unit="m2 s-2",
    linear=True,
    conservative=True,
    natural_frequency=natural_frequency,
    exact=exact,
    exact_period=exact_period,
    # B, section 10.1; without an initial position the amplitude is V/w
    scales=Scales(
        time="1/w",
        position="where(u != 0, abs(u), abs(v)/w)",
        energy="(w*u_c)**2",
        numbers=(("beta", "v/(w*u)"),),
        parameters=(("w", "1"),),
    ),
)
