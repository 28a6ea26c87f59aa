r"""A box that slides on a flat surface, held by a spring: ``m u'' + mu m g sign(u') + s(u) = 0``.

The spring is ``s(u) = (k/alpha) tanh(alpha u)``, and ``k u`` where alpha = 0 (exercise 19). A box that comes to rest
where ``|s(u)| <= mu m g`` stays there for ever: static and sliding friction have the same coefficient.

Source: vibration text (B), section 10.3, equation (86), and exercise 19. Units: m [kg], k [N m-1], alpha [m-1], mu [1],
g [m s-2], u [m], v [m s-1]; energy ``m v^2/2 + (k/alpha^2) log cosh(alpha u)`` [J]. Scaled by the initial position I
and by ``sqrt(m/k)`` (exercise 19 b) it has m = k = 1, u(0) = 1, alpha I for alpha, and mu m g/(k I) for mu g.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.models.base import Model, Numbers, Parameter
from vibsim.models.events import Friction
from vibsim.models.shared.linear_motion import friction_motion
from vibsim.models.shared.mechanical import STATES
from vibsim.models.shared.scales import Scales

_PULL = "where(alpha == 0, (k/m)*u, (k/m)/alpha*tanh(alpha*u))"
_X = "(alpha*u)"
# log cosh x without cancellation: for |x| < 1/16 its series; then, with y = sinh^2 x and w = 1 + y rounded,
# log(1 + y)/2 = log(w)/2 (y/(w - 1)); beyond 20, |x| - log 2 to round-off
_SERIES = (
    f"0.5*k*u**2*(1 - {_X}**2/6*(1 - {_X}**2*4/15*(1 - {_X}**2*17/56"
    f"*(1 - {_X}**2*496/1530*(1 - {_X}**2*691/2046)))))"
)
_SQUARE = f"sinh({_X})**2"
_MIDDLE = f"0.5*k/alpha**2*log(1 + {_SQUARE})*({_SQUARE}/(1 + {_SQUARE} - 1))"
_FAR = f"k/alpha**2*(abs({_X}) - log(2))"


def natural_frequency(parameters: Numbers) -> Any:
    """Return ``sqrt(k/m)`` [rad s-1], of small oscillations without friction."""
    return np.sqrt(parameters["k"] / parameters["m"])


def exact(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
    """Return u and v at times `t` for the linear spring (alpha = 0); NaN for any other."""
    p = parameters
    # the largest distance at which friction holds the box
    hold = np.where(p["alpha"] == 0, p["mu"] * p["m"] * p["g"] / p["k"], np.nan)
    states = friction_motion(t, natural_frequency(p), hold, initial["u"], initial["v"])
    u, v = (np.where(np.isnan(hold), np.nan, x) for x in states)
    return {"u": u, "v": v}


SLIDING_BOX = Model(
    kind="sliding_box",
    title="Sliding box on a spring",
    source="vibration text, section 10.3 and exercise 19",
    equation="m u'' + mu m g sign(u') + s(u) = 0, s(u) = (k/alpha) tanh(alpha u)",
    states=STATES,
    parameters=(
        Parameter("m", 1.0, "kg", "mass", minimum=0.0, exclusive=True),
        Parameter("k", 1.0, "N m-1", "stiffness of the spring at u = 0", 0.0, exclusive=True),
        Parameter("alpha", 0.0, "m-1", "how early the spring yields; 0: linear", minimum=0.0),
        Parameter("mu", 0.1, "1", "friction coefficient", minimum=0.0),
        Parameter("g", 1.0, "m s-2", "acceleration of gravity", minimum=0.0, exclusive=True),
    ),
    acceleration=f"-{_PULL} - mu*g*sign(v)",
    kinetic_energy="0.5*m*v**2",
    potential_energy=(
        f"where(abs({_X}) < 0.0625, {_SERIES}, where(abs({_X}) < 20, {_MIDDLE}, {_FAR}))"
    ),
    energy_unit="J",
    linear=False,
    conservative=False,
    natural_frequency=natural_frequency,
    exact=exact,
    # exercise 19 b; without an initial position the amplitude is V sqrt(m/k)
    scales=Scales(
        time="sqrt(m/k)",
        position="where(u != 0, abs(u), abs(v)*sqrt(m/k))",
        energy="k*u_c**2",
        numbers=(("friction", "mu*m*g/(k*u_c)"), ("yield", "alpha*u_c")),
        parameters=(
            ("m", "1"),
            ("k", "1"),
            ("alpha", "alpha*u_c"),
            ("mu", "mu*m*g/(k*u_c)"),
            ("g", "1"),
        ),
    ),
    events=Friction(drive=f"-{_PULL}", limit="mu*g", cost="mu*m*g"),
)
