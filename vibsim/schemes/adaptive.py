"""Adaptive reference solvers of SciPy: DOP853, LSODA and Radau, each given by its name and a tolerance.

They have no levels, only a tolerance, so no order is promised. Their rows in the level files are dense output at the
points of each level (`vibsim.simulation.adaptive`).

Source: vibration text (B), exercise 4; E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations
I, section II.10 (DOP853), and II, section IV.8 (Radau IIA of order 5); A. C. Hindmarsh, ODEPACK, and L. Petzold, SIAM
J. Sci. Stat. Comput. 4 (1983) (LSODA).
"""

from __future__ import annotations

import math

from vibsim.core.errors import SimulationError
from vibsim.schemes.base import NumberOption, Options, Scheme, Stepper
from vibsim.schemes.orders import Orders, same_orders

TOLERANCE = NumberOption(
    name="tolerance",
    default=1e-10,
    least=1e-14,
    most=1e-1,
    description=(
        "error that is allowed of each step, relative to the state, and to the size of the problem where the state "
        "passes zero; below 2.2e-14, SciPy's least relative tolerance, the second alone becomes smaller"
    ),
)

_MEASURED = {
    "dop853": (10.0, 1 / 8, 2e-4),
    "lsoda": (46.0, 0.075, 3e-5),
    "radau": (150.0, 1 / 4, 3e-4),
}
"""Steps per period at tolerance 1e-8, exponent of their growth with 1/tolerance, seconds per step: measured on the
pendulum."""
START_SECONDS = 3e-3
"""Overhead of one member."""


def seconds(kind: str, tolerance: float, periods: float) -> float:
    """Return the predicted run time [s] of one member over a number of periods of small oscillations."""
    steps, power, cost = _MEASURED[kind]
    periods = periods if math.isfinite(periods) else 1.0
    return float(START_SECONDS + periods * steps * (1e-8 / tolerance) ** power * cost)


def _own_steps(options: Options) -> Stepper:
    raise SimulationError("an adaptive scheme takes its own steps, and has no step of a given size")


def _no_orders(options: Options) -> Orders:
    names = ("velocity_d2t", "energy_d2t", "energy_d2t_linear")
    return same_orders(math.nan, **dict.fromkeys(names, math.nan))


def _scheme(kind: str, title: str, source: str, family: str, force_evaluations: int) -> Scheme:
    return Scheme(
        kind=kind,
        title=title,
        source=f"vibration text, exercise 4; {source}",
        family=family,
        stepper=_own_steps,
        orders=_no_orders,
        force_evaluations=force_evaluations,
        start="none: it chooses its first step and every other one",
        options=(TOLERANCE,),
        # the error below which nothing is promised, whatever the level
        round_off=lambda options, steps: float(options["tolerance"]),
        adaptive=True,
    )


DOP853 = _scheme(
    "dop853",
    "Dormand and Prince's Runge-Kutta method of order 8, adaptive (SciPy)",
    "Hairer, Norsett and Wanner I, section II.10",
    "Runge-Kutta",
    12,
)
LSODA = _scheme(
    "lsoda",
    "Adams and BDF methods of variable order, adaptive (SciPy, ODEPACK)",
    "Petzold, SIAM J. Sci. Stat. Comput. 4 (1983)",
    "multistep",
    2,
)
RADAU = _scheme(
    "radau",
    "Radau IIA method of order 5, adaptive (SciPy)",
    "Hairer and Wanner II, section IV.8",
    "implicit Runge-Kutta",
    3,
)

ADAPTIVE = (DOP853, LSODA, RADAU)
