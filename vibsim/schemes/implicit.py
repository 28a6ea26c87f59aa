r"""Backward Euler, Crank-Nicolson and BDF2 for ``u' = v``, ``v' = a(u, v, t)``.

Each step leaves one equation for the acceleration at the next point, solved by Newton's method to round-off
(`vibsim.schemes.newton`). On ``u'' + w^2 u = 0``, with p = w dt, a step multiplies the energy by ``1/(1 + p^2)``
(Backward Euler, order 1), by 1 (Crank-Nicolson, which keeps it exactly) and by ``1 - p^4/2 + ...`` (BDF2, order 3).

Crank-Nicolson is the trapezoidal rule, ``(u^(n+1) - 2 u^n + u^(n-1))/dt^2 = (a^(n+1) + 2 a^n + a^(n-1))/4``; it is
Newmark's scheme with beta = 1/4 and gamma = 1/2. Not to be confused with the implicit midpoint rule, to which the
text's program gives the same name: they differ by a change of variables, and agree on a linear force.

Source: vibration text (B), sections 5.2 and 5.3, equations (29)-(42); E. Hairer and G. Wanner, Solving Ordinary
Differential Equations II, section V.1 (BDF2).
"""

from __future__ import annotations

import math
from typing import Any

from vibsim.schemes.base import (
    Acceleration,
    Function,
    Options,
    Scheme,
    Slopes,
    Stepper,
    always,
)
from vibsim.schemes.newton import solved
from vibsim.schemes.one_step import self_starting
from vibsim.schemes.orders import Orders

Two = tuple[float, float]
Four = tuple[float, float, float, float]


def step_backward_euler(
    state: Two, t: float, dt: float, p: Any, acceleration: Acceleration, slopes: Slopes
) -> tuple[Two, float]:
    """Return u^(n+1), v^(n+1) and the velocity at n: B (31)-(32) for any force."""
    u, v = state
    guess = acceleration(u, v, t, p)
    a = solved(guess, u + dt * v, dt * dt, v, dt, t + dt, p, acceleration, slopes)
    ahead = v + dt * a
    return (u + dt * ahead, ahead), v


def step_crank_nicolson(
    state: Two, t: float, dt: float, p: Any, acceleration: Acceleration, slopes: Slopes
) -> tuple[Two, float]:
    """Return u^(n+1), v^(n+1) and the velocity at n: B (38)-(39) for any force."""
    u, v = state
    half = 0.5 * dt
    now = acceleration(u, v, t, p)
    push = v + half * now
    reach = u + half * (v + push)
    a = solved(now, reach, half * half, push, half, t + dt, p, acceleration, slopes)
    kick = half * (now + a)
    return (u + dt * (v + 0.5 * kick), v + kick), v


def start_bdf2(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration, slopes: Slopes
) -> Four:
    """Return the state at step 1, by one step of Crank-Nicolson."""
    (ahead, speed), _ = step_crank_nicolson((u, v), 0.0, dt, p, acceleration, slopes)
    return ahead, speed, u, v


def with_points_behind(u: Function, v: Function, a: Function, t: Any, dt: Any) -> Any:
    """Return u and v at t, and one step before."""
    return u(t), v(t), u(t - dt), v(t - dt)


def step_bdf2(
    state: Four, t: float, dt: float, p: Any, acceleration: Acceleration, slopes: Slopes
) -> tuple[Four, float]:
    """Return u, v at n+1 and at n, and the velocity at n: ``(3 y^(n+1) - 4 y^n + y^(n-1))/(2 dt) = f^(n+1)``."""
    u, v, u_before, v_before = state
    part = 2.0 * dt / 3.0
    # the increment is what is rounded, not 4/3 of the solution
    drift, push = (u - u_before) / 3.0, (v - v_before) / 3.0
    guess = (v - v_before) / dt
    reach, speed = u + (drift + part * (v + push)), v + push
    a = solved(guess, reach, part * part, speed, part, t + dt, p, acceleration, slopes)
    ahead = v + (push + part * a)
    return (u + (drift + part * ahead), ahead, u, v), v


_BACKWARD_EULER = self_starting(step_backward_euler, implicit=True)
_CRANK_NICOLSON = self_starting(step_crank_nicolson, implicit=True)
_BDF2 = Stepper(start_bdf2, step_bdf2, implicit=True, carried=with_points_behind)


def _backward_euler(options: Options) -> Stepper:
    return _BACKWARD_EULER


def _crank_nicolson(options: Options) -> Stepper:
    return _CRANK_NICOLSON


def _bdf2(options: Options) -> Stepper:
    return _BDF2


BACKWARD_EULER = Scheme(
    kind="backward_euler",
    title="Backward Euler",
    source="vibration text, sections 5.2 and 5.6",
    family="implicit one-step",
    stepper=_backward_euler,
    orders=lambda options: Orders(position=1, velocity=1, energy=1, energy_linear=1),
    force_evaluations=1,
    start="none: a one-step method",
    explicit=False,
)
CRANK_NICOLSON = Scheme(
    kind="crank_nicolson",
    title="Crank-Nicolson (trapezoidal rule)",
    source="vibration text, section 5.3, equations (33)-(42)",
    family="implicit one-step",
    stepper=_crank_nicolson,
    orders=lambda options: Orders(
        position=2, velocity=2, energy=2, energy_linear=math.inf, energy_d2t_linear=2
    ),
    even_powers=always,
    force_evaluations=1,
    start="none: a one-step method",
    explicit=False,
    symmetric=True,
)
BDF2 = Scheme(
    kind="bdf2",
    title="Backward differentiation formula of order 2",
    source="vibration text, exercise 12 (Backward2Step); Hairer and Wanner II, section V.1",
    family="multistep",
    stepper=_bdf2,
    orders=lambda options: Orders(
        position=2, velocity=2, energy=2, energy_linear=3, energy_d2t_linear=2
    ),
    force_evaluations=1,
    start="u^1 and v^1, by one step of Crank-Nicolson",
    explicit=False,
)

IMPLICIT = (BACKWARD_EULER, CRANK_NICOLSON, BDF2)
