r"""Newmark's scheme and its variants with dissipation at high frequencies: HHT-alpha and generalized-alpha.

With ``f^n = a(u^n, v^n, t^n)`` the force per unit mass, all three are

``u^(n+1) = u^n + dt v^n + dt^2 ((1/2 - beta) a^n + beta a^(n+1))``,
``v^(n+1) = v^n + dt ((1 - gamma) a^n + gamma a^(n+1))``,
``(1 - alpha_m) a^(n+1) + alpha_m a^n = (1 - alpha_f) f^(n+1) + alpha_f f^n``,

with a^0 = f^0. The state carries (u, v, a). Forces, external ones included, are averaged rather than evaluated at an
averaged point. On a linear structure the two differ only in the time of the load, and both are of order 2.

On a linear structure, ``M u'' + C u' + K u = p(t)``, the force is ``f = M^-1 (p - C v - K u)``, and a step solves

``S a^(n+1) = (1 - alpha_f) (p^(n+1) - C v~ - K u~) + alpha_f (p^n - C v^n - K u^n) - alpha_m M a^n``,
``S = (1 - alpha_m) M + (1 - alpha_f) (gamma dt C + beta dt^2 K)``,

with u~ and v~ the first two lines without a^(n+1). Centred differences with centred damping are the case beta = 0,
gamma = 1/2.

- ``newmark``: alpha_m = alpha_f = 0, any beta and gamma. Order 2 for gamma = 1/2 only; a larger gamma damps the
  amplitude, a smaller one makes it grow. beta = 1/4 is the trapezoidal rule (Crank-Nicolson), 1/6 the linear
  acceleration method, 1/12 Fox-Goodwin, 0 velocity Verlet, which is explicit.
- ``hht``: alpha_m = 0, alpha_f = -alpha, with alpha from -1/3 (most damping) to 0, beta = (1 - alpha)^2/4 and
  gamma = (1 - 2 alpha)/2.
- ``generalized_alpha``: by rho_inf, the spectral radius at infinite frequency, from 0 to 1 (no damping):
  alpha_m = (2 rho_inf - 1)/(rho_inf + 1), alpha_f = rho_inf/(rho_inf + 1), beta = (1 - alpha_m + alpha_f)^2/4 and
  gamma = 1/2 - alpha_m + alpha_f.

Source: N. M. Newmark, A method of computation for structural dynamics, J. Eng. Mech. 85 (1959); H. M. Hilber,
T. J. R. Hughes and R. L. Taylor, Improved numerical dissipation for time integration algorithms in structural
dynamics, Earthq. Eng. Struct. Dyn. 5 (1977); J. Chung and G. M. Hulbert, A time integration algorithm for structural
dynamics with improved numerical dissipation: the generalized-alpha method, J. Appl. Mech. 60 (1993).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

from vibsim.formula import constant
from vibsim.schemes.base import NumberOption, Options, Scheme, Stepper, Weights
from vibsim.schemes.code_generation import self_starting, written
from vibsim.schemes.newton import solved
from vibsim.schemes.orders import Orders, same_orders

_STEP = """\
def step_newmark(state, t, dt, p, acceleration, slopes):
    u, v, a = state
    {rest}
    push = v + dt * (LATE * a + GAMMA * rest)
    reach = u + dt * (v + dt * (NEAR * a + BETA * rest))
    force = solved({guess}, reach, FAR * dt * dt, push, FAST * dt, t + dt, p, acceleration, slopes)
    ahead = rest + SHARE * force
    drift = dt * (v + dt * (NEAR * a + BETA * ahead))
    return (u + drift, v + dt * (LATE * a + GAMMA * ahead), ahead), v
"""
"""Solved for the force at the next point, with ``a^(n+1) = rest + SHARE f^(n+1)``."""

_ALONE = {"rest": "rest = ZERO", "guess": "a"}
_AVERAGED = {
    "rest": "now = acceleration(u, v, t, p)\n    rest = OLD_FORCE * now - OLD * a",
    "guess": "now",
}


@cache
def _stepper(beta: str, gamma: str, alpha_m: str = "0", alpha_f: str = "0") -> Stepper:
    """Return the arithmetic for these parameters (formulas)."""
    is_averaged = (alpha_m, alpha_f) != ("0", "0")
    new, share = f"(1 - ({alpha_m}))", f"(1 - ({alpha_f}))/(1 - ({alpha_m}))"
    formulas = {
        "ZERO": "0",
        "SHARE": share,
        "NEAR": f"1/2 - ({beta})",
        "BETA": beta,
        "FAR": f"({beta})*{share}",
        "LATE": f"1 - ({gamma})",
        "GAMMA": gamma,
        "FAST": f"({gamma})*{share}",
    }
    if is_averaged:
        formulas |= {"OLD_FORCE": f"({alpha_f})/{new}", "OLD": f"({alpha_m})/{new}"}
    text = _STEP.format(**(_AVERAGED if is_averaged else _ALONE))
    step = written(text, formulas, {"solved": solved})
    return self_starting(step, carries_acceleration=True)


def _newmark(options: Options) -> tuple[str, ...]:
    return repr(options["beta"]), repr(options["gamma"])


def _hht(options: Options) -> tuple[str, ...]:
    alpha = f"({options['alpha']!r})"
    return f"(1 - {alpha})**2/4", f"(1 - 2*{alpha})/2", "0", f"-{alpha}"


def _generalized_alpha(options: Options) -> tuple[str, ...]:
    rho = repr(options["rho_inf"])
    alpha_m, alpha_f = f"(2*{rho} - 1)/({rho} + 1)", f"{rho}/({rho} + 1)"
    difference = f"({alpha_f} - {alpha_m})"
    return f"(1 + {difference})**2/4", f"1/2 + {difference}", alpha_m, alpha_f


@dataclass(frozen=True)
class _Family:
    """The arithmetic of a scheme, from its parameters as formulas."""

    parameters: Callable[[Options], tuple[str, ...]]

    def stepper(self, options: Options) -> Stepper:
        """Return the arithmetic on a model with formulas."""
        return _stepper(*self.parameters(options))

    def weights(self, options: Options) -> Weights:
        """Return the parameters of the step on a linear structure."""
        return Weights(*map(constant, self.parameters(options)))


NUMEROV = 1 / 12
"""The beta of Numerov's method, also named after Fox and Goodwin: its frequency is of fourth order."""


def _is_centred(options: Options) -> bool:
    """Tell whether the velocity of `newmark` is advanced by the trapezoidal rule."""
    return options["gamma"] == 0.5


def _newmark_orders(options: Options) -> Orders:
    if not _is_centred(options):
        return same_orders(1)
    orders = _second_order(math.inf if options["beta"] == 0.25 else 2.0)
    if options["beta"] == NUMEROV:
        # the error of the velocity does not affect a motion that begins at rest
        return replace(orders, from_rest=replace(orders, position_linear=4.0))
    return orders


def _damps(options: Options) -> bool:
    """Tell whether high frequencies are damped: with alpha = 0 or rho_inf = 1 the scheme is the trapezoidal rule."""
    return options.get("alpha", 1.0) != 0.0 and options.get("rho_inf", 0.0) != 1.0


def _averaged_orders(options: Options) -> Orders:
    return _second_order(2.0 if _damps(options) else math.inf)


def _second_order(energy_linear: float) -> Orders:
    return same_orders(2, energy_linear=energy_linear, energy_d2t_linear=2)


NEWMARK_BETA = Scheme(
    kind="newmark",
    title="Newmark's scheme",
    source="Newmark (1959); the trapezoidal rule of the vibration text, equation (37), by default",
    family="Newmark",
    options=(
        NumberOption(
            "beta", 0.25, 0.0, 1.0, "weight of the new acceleration in the position; 0: explicit"
        ),
        NumberOption(
            "gamma",
            0.5,
            0.0,
            1.5,
            "weight of the new acceleration in the velocity; 1/2: order 2, below it the amplitude grows",
        ),
    ),
    stepper=_Family(_newmark).stepper,
    weights=_Family(_newmark).weights,
    weighed=("beta", "gamma"),
    orders=_newmark_orders,
    # symmetric with gamma = 1/2 for any beta
    even_powers=lambda quantity, model, options: _is_centred(options),
    start="a^0, from the equation of motion",
    symmetric=True,
)
HHT = Scheme(
    kind="hht",
    title="HHT-alpha (Hilber, Hughes and Taylor)",
    source="Hilber, Hughes and Taylor (1977)",
    family="Newmark",
    options=(
        NumberOption(
            "alpha", -0.1, -1.0 / 3.0, 0.0, "damping of high frequencies, the most at -1/3"
        ),
    ),
    stepper=_Family(_hht).stepper,
    weights=_Family(_hht).weights,
    weighed=("alpha",),
    orders=_averaged_orders,
    even_powers=lambda quantity, model, options: not _damps(options),
    start="a^0, from the equation of motion",
)
GENERALIZED_ALPHA = Scheme(
    kind="generalized_alpha",
    title="Generalized-alpha (Chung and Hulbert)",
    source="Chung and Hulbert (1993)",
    family="Newmark",
    options=(
        NumberOption(
            "rho_inf", 0.8, 0.0, 1.0, "what is left of the highest frequencies in one step"
        ),
    ),
    stepper=_Family(_generalized_alpha).stepper,
    weights=_Family(_generalized_alpha).weights,
    weighed=("rho_inf",),
    orders=_averaged_orders,
    even_powers=lambda quantity, model, options: not _damps(options),
    start="a^0, from the equation of motion",
)

NEWMARK = (NEWMARK_BETA, HHT, GENERALIZED_ALPHA)
