r"""Steps of the centred differences ``u'' + D(u') = a(u, t)``: three arithmetics, and the treatments of damping.

With the increments ``d = u^n - u^(n-1)`` and ``e = u^(n+1) - u^n``, a damping rate c over the mass, and a the
acceleration without damping at n, every step is ``e = d + kick``:

- undamped: ``kick = dt^2 a``;
- linear damping, exactly centred, ``D = c (d + e)/(2 dt)``: ``kick = (dt^2 a - c dt d)/(1 + c dt/2)``;
- quadratic damping by the geometric mean, ``D = c |d| e/dt^2``: ``kick = (dt^2 a - c |d| d)/(1 + c |d|)``;
- quadratic damping, exactly centred, ``D = c |s| s/(4 dt^2)`` with ``s = d + e``: s solves a quadratic equation, and
  has the sign of ``r = 2 d + dt^2 a``, so ``s = 2 r/(1 + sqrt(1 + c |r|))`` and ``kick = dt^2 a - c |s| s/4``;
- any damping at the backward difference, ``D(d/dt)``: ``kick = dt^2 a(u^n, d/dt, t^n)`` with D in a.

The arithmetics are algebraically equal, with different round-off (`vibsim.schemes.central`).

Source: vibration text (B), equations (64) and (71), section 8.2, and exercise 16 for the last one. Compensated
summation: E. Hairer, C. Lubich and G. Wanner, Geometric Numerical Integration, section VIII.5.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from vibsim.elementary import ELEMENTARY
from vibsim.schemes.code_generation import written


@dataclass(frozen=True)
class Treatment:
    """How a step takes the damping: the text of its kick."""

    kick: str
    """Formula of the kick, from ``push``, which is ``dt^2 a``, and ``d``."""
    lines: tuple[str, ...] = ()
    """Assignments before it."""
    velocity: str = "0.0"
    """The velocity at which the acceleration is taken: at rest it has no damping."""

    @property
    def handed(self) -> str:
        """Functions of the model that the step asks for."""
        asks = any("damping_rate" in line for line in self.lines)
        return "acceleration, damping_rate" if asks else "acceleration"


_RATE = "rate = damping_rate(u, 0.0, t, p)"
UNDAMPED = Treatment("push")
LINEAR = Treatment("(push - rate * dt * d) / (1.0 + 0.5 * dt * rate)", (_RATE,))
GEOMETRIC = Treatment("(push - share * d) / (1.0 + share)", (_RATE, "share = rate * abs(d)"))
ROOT = Treatment(
    "(push - 0.25 * rate * abs(both) * both)",
    (
        _RATE,
        "reach = 2.0 * d + push",
        "both = 2.0 * reach / (1.0 + sqrt(1.0 + rate * abs(reach)))",
    ),
)
BACKWARD = Treatment("push", velocity="d / dt")

_COMPENSATED = '''
def step_compensated(state, t, dt, p, {handed}):
    """Return u^(n+1), its increment, their rounding errors, and the velocity at n."""
    u, d, u_rest, d_rest = state
    push = (dt * dt) * acceleration(u, {velocity}, t, p)
{lines}    kick = {kick} + d_rest
    d_ahead = d + kick
    part = d_ahead - d
    d_rest_ahead = (d - (d_ahead - part)) + (kick - part)
    # the rest of d belongs to u as well, but only in the sum that u keeps
    drift = d_ahead + u_rest
    ahead = u + drift
    part_of_u = ahead - u
    u_rest_ahead = (u - (ahead - part_of_u)) + (drift - part_of_u)
    return (ahead, d_ahead, u_rest_ahead, d_rest_ahead), (d + d_ahead) * (0.5 / dt)
'''
_INCREMENT = '''
def step_increment(state, t, dt, p, {handed}):
    """Return u^(n+1), its increment and the velocity at n."""
    u, d = state
    push = (dt * dt) * acceleration(u, {velocity}, t, p)
{lines}    d_ahead = d + {kick}
    return (u + d_ahead, d_ahead), (d + d_ahead) * (0.5 / dt)
'''
_THREE_TERM = '''
def step_three_term(state, t, dt, p, {handed}):
    """Return u^(n+1), u^n and the velocity at n: A (9)."""
    u, behind = state
{increment}    push = (dt * dt) * acceleration(u, {velocity}, t, p)
{lines}    ahead = 2.0 * u - behind + {kick}
    return (ahead, u), (ahead - behind) * (0.5 / dt)
'''
_TEXTS = {"compensated": _COMPENSATED, "increment": _INCREMENT, "three_term": _THREE_TERM}


@cache
def step(arithmetic: str, treatment: Treatment) -> Callable[..., Any]:
    """Return the step of an arithmetic (`vibsim.schemes.base.Stepper.step`) with a treatment of the damping."""
    needs_increment = treatment is not UNDAMPED
    text = _TEXTS[arithmetic].format(
        handed=treatment.handed,
        velocity=treatment.velocity,
        kick=treatment.kick,
        lines="".join(f"    {line}\n" for line in treatment.lines),
        increment="    d = u - behind\n" if needs_increment else "",
    )
    uses_root = any("sqrt" in line for line in treatment.lines)
    functions = {"sqrt": ELEMENTARY["sqrt"].full} if uses_root else {}
    return written(text.lstrip("\n"), functions=functions)
