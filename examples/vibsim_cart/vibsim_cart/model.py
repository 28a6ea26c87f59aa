r"""A pendulum that hangs from a cart, which rolls without friction; the centre of mass of both does not move sideways.

The position of the cart then follows from the angle, ``x = -m L sin(theta)/(M + m)``, and one coordinate is left:

    theta'' = -((M + m) g sin(theta) + m L theta'^2 sin(theta) cos(theta))/(L (M + m sin(theta)^2)),

with the energy ``m L^2 theta'^2/2 (M + m sin(theta)^2)/(M + m) + m g L (1 - cos(theta))``, which is conserved. Its
acceleration is no sum of a force of theta and one of theta', so that no formulas of `kind: oscillator` express it.

Source: L. D. Landau and E. M. Lifshitz, Mechanics, section 5, problem 2, without a sideways momentum.
Units: theta [rad], g [m s-2], L [m], m and M [kg], energy [J].
"""

from __future__ import annotations

import math

import numpy as np

from vibsim.models import Model, Output, Parameter, State


def natural_frequency(parameters):
    """Return the angular frequency of small oscillations [rad s-1]; parameters are numbers or arrays."""
    g, L, m, M = (parameters[name] for name in ("g", "L", "m", "M"))
    return np.sqrt(g * (M + m) / (L * M))


CART_PENDULUM = Model(
    kind="cart_pendulum",
    title="Pendulum on a cart",
    source="Landau and Lifshitz, Mechanics, section 5, problem 2",
    equation="theta'' = -((M + m) g sin(theta) + m L theta'^2 sin(theta) cos(theta))/(L (M + m sin(theta)^2))",
    states=(State("theta", "rad", "angle"), State("omega", "rad s-1", "angular velocity")),
    parameters=(
        Parameter("g", 9.81, "m s-2", "acceleration of gravity", minimum=0.0, exclusive=True),
        Parameter("L", 1.0, "m", "length of the pendulum", minimum=0.0, exclusive=True),
        Parameter("m", 1.0, "kg", "mass of the pendulum", minimum=0.0, exclusive=True),
        Parameter("M", 2.0, "kg", "mass of the cart", minimum=0.0, exclusive=True),
    ),
    acceleration=(
        "-((M + m)*g*sin(theta) + m*L*omega**2*sin(theta)*cos(theta))/(L*(M + m*sin(theta)**2))"
    ),
    kinetic_energy="m*L**2*omega**2/2*(M + m*sin(theta)**2)/(M + m)",
    potential_energy="m*g*L*(1 - cos(theta))",
    energy_unit="J",
    linear=False,
    conservative=True,
    natural_frequency=natural_frequency,
    turn=2.0 * math.pi,
    outputs=(Output("x", "m", "position of the cart", "-m*L*sin(theta)/(M + m)"),),
)
