r"""Backward Euler, Crank-Nicolson, BDF2 and the Gauss method with two stages for ``u' = v``, ``v' = a(u, v, t)``.

Each step solves one equation for the acceleration at the next point, by Newton's method to round-off
(`vibsim.schemes.newton`). On ``u'' + w^2 u = 0``, with p = w dt, a step multiplies the energy by ``1/(1 + p^2)``
(Backward Euler, order 1), by 1 (Crank-Nicolson, which conserves it) and by ``1 - p^4/2 + ...`` (BDF2, order 3).

Crank-Nicolson is the trapezoidal rule, ``(u^(n+1) - 2 u^n + u^(n-1))/dt^2 = (a^(n+1) + 2 a^n + a^(n-1))/4``; it is
Newmark's scheme with beta = 1/4 and gamma = 1/2. It is not the implicit midpoint rule, to which the text's program
gives the same name: the two differ by a change of variables, and agree on a linear force.

The Gauss method is of order 4, symplectic and symmetric: ``V_i = v + dt sum_j a_ij A_j`` and
``U_i = u + dt sum_j a_ij V_j`` with ``A_i = a(U_i, V_i, t + c_i dt)``. Together
``U_i = u + c_i dt v + dt^2 sum_j (a^2)_ij A_j``: the two stage accelerations are the unknowns of each step. On
``u'' + w^2 u = 0`` a step is ``(1 + z/2 + z^2/12)/(1 - z/2 + z^2/12)``, the Pade approximation of ``exp z`` at z = i p,
of modulus 1: the energy is conserved and the method is unconditionally stable.

Source: vibration text (B), sections 5.2 and 5.3, equations (29)-(42); E. Hairer and G. Wanner, Solving Ordinary
Differential Equations II, section V.1 (BDF2). Gauss: E. Hairer, C. Lubich and G. Wanner, Geometric Numerical
Integration, sections II.1.3 and IV.2.1; E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential
Equations I, table II.7.3 (Hammer and Hollingsworth).
"""

from __future__ import annotations

import math
from typing import Any

from vibsim.schemes.base import Acceleration, Scheme, Slopes, Stepper
from vibsim.schemes.code_generation import self_starting, written
from vibsim.schemes.newton import Four, Two, solved, solved_together
from vibsim.schemes.orders import same_orders


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


def step_bdf2(
    state: Four, t: float, dt: float, p: Any, acceleration: Acceleration, slopes: Slopes
) -> tuple[Four, float]:
    """Return u, v at n+1 and at n, and the velocity at n: ``(3 y^(n+1) - 4 y^n + y^(n-1))/(2 dt) = f^(n+1)``."""
    u, v, u_before, v_before = state
    part = 2.0 * dt / 3.0
    # written with increments, so that rounding acts on these and not on 4/3 of the solution
    drift, push = (u - u_before) / 3.0, (v - v_before) / 3.0
    guess = (v - v_before) / dt
    reach, speed = u + (drift + part * (v + push)), v + push
    a = solved(guess, reach, part * part, speed, part, t + dt, p, acceleration, slopes)
    ahead = v + (push + part * a)
    return (u + (drift + part * ahead), ahead, u, v), v


_GAUSS_FORMULAS = {
    "C_1": "1/2 - sqrt(3)/6",
    "C_2": "1/2 + sqrt(3)/6",
    # the matrix a, its square S, and D = b^T a; b is (1/2, 1/2)
    "A_11": "1/4",
    "A_12": "1/4 - sqrt(3)/6",
    "A_21": "1/4 + sqrt(3)/6",
    "A_22": "1/4",
    "S_11": "1/24",
    "S_12": "1/8 - sqrt(3)/12",
    "S_21": "1/8 + sqrt(3)/12",
    "S_22": "1/24",
    "D_1": "1/4 + sqrt(3)/12",
    "D_2": "1/4 - sqrt(3)/12",
}

_GAUSS_STEP = """\
def step_gauss(state, t, dt, p, acceleration, slopes):
    u, v = state
    now = acceleration(u, v, t, p)
    square = dt * dt
    a_1, a_2 = solved_together(
        now, now,
        (u + C_1 * dt * v, u + C_2 * dt * v),
        (S_11 * square, S_12 * square, S_21 * square, S_22 * square),
        (v, v), (A_11 * dt, A_12 * dt, A_21 * dt, A_22 * dt),
        (t + C_1 * dt, t + C_2 * dt), p, acceleration, slopes,
    )
    return (u + dt * (v + dt * (D_1 * a_1 + D_2 * a_2)), v + dt * (0.5 * (a_1 + a_2))), v
"""

_BACKWARD_EULER = self_starting(step_backward_euler)
_CRANK_NICOLSON = self_starting(step_crank_nicolson)
_BDF2 = Stepper(
    start_bdf2,
    step_bdf2,
    carried=lambda u, v, a, t, dt: (u(t), v(t), u(t - dt), v(t - dt)),
)
_GAUSS = self_starting(written(_GAUSS_STEP, _GAUSS_FORMULAS, {"solved_together": solved_together}))

BACKWARD_EULER = Scheme(
    kind="backward_euler",
    title="Backward Euler",
    source="vibration text, sections 5.2 and 5.6",
    family="implicit one-step",
    stepper=lambda options: _BACKWARD_EULER,
    orders=lambda options: same_orders(1),
)
CRANK_NICOLSON = Scheme(
    kind="crank_nicolson",
    title="Crank-Nicolson (trapezoidal rule)",
    source="vibration text, section 5.3, equations (33)-(42)",
    family="implicit one-step",
    stepper=lambda options: _CRANK_NICOLSON,
    orders=lambda options: same_orders(2, energy_linear=math.inf, energy_d2t_linear=2),
    even_powers=True,
    symmetric=True,
)
BDF2 = Scheme(
    kind="bdf2",
    title="Backward differentiation formula of order 2",
    source="vibration text, exercise 12 (Backward2Step); Hairer and Wanner II, section V.1",
    family="multistep",
    stepper=lambda options: _BDF2,
    orders=lambda options: same_orders(2, energy_linear=3, energy_d2t_linear=2),
    start="u^1 and v^1, by one step of Crank-Nicolson",
)
GAUSS4 = Scheme(
    kind="gauss4",
    title="Gauss method with two stages (order 4)",
    source="Hairer, Lubich and Wanner, sections II.1.3 and IV.2.1",
    family="implicit Runge-Kutta",
    stepper=lambda options: _GAUSS,
    orders=lambda options: same_orders(4, energy_linear=math.inf, energy_d2t_linear=2),
    even_powers=True,
    force_evaluations=2,
    symplectic=True,
    symmetric=True,
)

IMPLICIT = (BACKWARD_EULER, CRANK_NICOLSON, BDF2)
