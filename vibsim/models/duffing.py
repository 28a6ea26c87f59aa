r"""Duffing's oscillator, ``u'' + delta u' + alpha u + beta u^3 = gamma cos(omega t)``.

Source: I. Kovacic, M. J. Brennan (eds.), The Duffing Equation (Wiley, 2011), chapters 2 and 5. Units: u [m],
alpha [s-2], beta [m-2 s-2], delta [s-1], gamma [m s-2], omega [rad s-1], energy per mass [m2 s-2]. With beta > 0
the spring is hardening; with alpha < 0 and beta > 0 there are two wells, around ``u = +-sqrt(-alpha/beta)``; with
beta < 0 the motion escapes beyond ``sqrt(-alpha/beta)``. Without damping and force the exact motion is one of Jacobi's
functions (`vibsim.models.shared.cubic`).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from vibsim.formula import ZERO, parse
from vibsim.models.base import Model, Numbers, Parameter
from vibsim.models.shared.cubic import motion, period
from vibsim.models.shared.mechanical import Forces, mechanical
from vibsim.models.shared.scales import Scales

PARAMETERS = (
    Parameter("delta", 0.0, "s-1", "coefficient of the damping", minimum=0.0),
    Parameter("alpha", 1.0, "s-2", "linear stiffness"),
    Parameter("beta", 1.0, "m-2 s-2", "cubic stiffness"),
    Parameter("gamma", 0.0, "m s-2", "amplitude of the driving force"),
    Parameter("omega", 1.0, "rad s-1", "angular frequency of the driving force", minimum=0.0),
)
TERMS = {"delta": "delta*v", "gamma": "gamma*cos(omega*t)"}


def natural_frequency(parameters: Numbers) -> Any:
    """Return the angular frequency of small oscillations [rad s-1]: about 0, or about the bottom of a well.

    That is ``sqrt(alpha)`` or, with alpha < 0 < beta, ``sqrt(-2 alpha)``; NaN if there is none.
    """
    alpha, beta = (np.asarray(parameters[name], dtype=float) for name in ("alpha", "beta"))
    square = np.where(alpha > 0.0, alpha, np.where(beta > 0.0, -2.0 * alpha, 0.0))
    return np.sqrt(np.where(square > 0.0, square, np.nan))


def exact(t: Any, initial: Numbers, parameters: Numbers) -> dict[str, Any]:
    """Return the exact u and v without damping and force; NaN where the motion escapes."""
    u, v = motion(t, parameters["alpha"], parameters["beta"], initial["u"], initial["v"])
    return {"u": u, "v": v}


def exact_period(initial: Numbers, parameters: Numbers) -> Any:
    """Return the exact period without damping and force."""
    return period(parameters["alpha"], parameters["beta"], initial["u"], initial["v"])


@cache
def duffing(terms: frozenset[str]) -> Model:
    """Return the oscillator, with damping and force if `terms` contains ``delta`` and ``gamma``."""
    names = ("u", "v", "t", *(row.name for row in PARAMETERS))
    damping, force = (parse(text, names) if t in terms else ZERO for t, text in TERMS.items())
    more: dict[str, Any] = {} if terms else {"exact": exact, "exact_period": exact_period}
    left = "delta u' + " if "delta" in terms else ""
    right = "gamma cos(omega t)" if "gamma" in terms else "0"
    return mechanical(
        Forces(spring=parse("alpha*u + beta*u**3", names), damping=damping, force=force),
        PARAMETERS,
        energy_unit="m2 s-2",
        kind="duffing",
        title="Duffing's oscillator",
        source="Kovacic and Brennan, The Duffing Equation, chapter 2",
        equation=f"u'' + {left}alpha u + beta u^3 = {right}",
        natural_frequency=natural_frequency,
        # in these scales alpha and beta are 1 or -1
        scales=lambda _: Scales(
            time="1/sqrt(abs(alpha))",
            position="sqrt(abs(alpha/beta))",
            energy="(u_c/t_c)**2",
            numbers=(
                ("damping", "delta*t_c"),
                ("force", "gamma*t_c**2/u_c"),
                ("frequency", "omega*t_c"),
            ),
            parameters=(("alpha", "sign(alpha)"), ("beta", "sign(beta)")),
        ),
        optional=tuple(TERMS),
        variant=duffing,
        **more,
    )


DUFFING = replace(
    duffing(frozenset()), equation="u'' + delta u' + alpha u + beta u^3 = gamma cos(omega t)"
)
"""The oscillator without damping and force, shown with the equation that has them."""
