r"""Explicit multistep methods (Adams-Bashforth) for ``u' = v``, ``v' = a(u, v, t)``, given by their weights.

``u^(n+1) = u^n + dt sum_j b_j v^(n-j)``, ``v^(n+1) = v^n + dt sum_j b_j a^(n-j)``, j = 0, ..., k-1: order k with one
evaluation of the force per step, for any force. The state carries the slopes at the k-1 previous points.

**Start.** The missing points come from a Runge-Kutta method of order k, one more than a start needs. The second-order
method has its slopes at n = 0 and 1 after one step of Heun's method. The third-order method also needs u^2 before its
formula has all slopes, but a scheme hands the engine its state at step 1 only. So the start takes two steps of Kutta's
method and replaces the missing slope at n = -1 by the value with which the formula reproduces that u^2:
``f^(-1) = ((u^2 - u^1)/dt - b_0 f^1 - b_1 f^0)/b_2``, and likewise for v. The force is never evaluated at t < 0.

On ``u'' + w^2 u = 0`` a step multiplies the amplitude by ``1 + p^4/4`` (k = 2) or ``1 - 3 p^4/8`` (k = 3, damped up to
its stability limit), p = w dt, so the energy is of order 3 with both.

Source: E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, section III.1.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from vibsim.schemes.base import Acceleration, Scheme, Stepper
from vibsim.schemes.code_generation import weighted, written
from vibsim.schemes.orders import Orders, same_orders
from vibsim.schemes.runge_kutta import HEUN, RK3

heun_step = HEUN.stepper({}).step
kutta_step = RK3.stepper({}).step


def adams_bashforth(weights: tuple[str, ...]) -> Callable[..., Any]:
    """Return the step of the method with these weights (formulas, the latest slope first).

    The state is (u, v), then velocity and acceleration at each previous point, the latest first.
    """
    formulas: dict[str, str] = {}
    previous = range(1, len(weights))
    velocities, accelerations = ([name, *(f"{name}_{j}" for j in previous)] for name in ("v", "a"))
    carried = [name for j in previous for name in (f"v_{j}", f"a_{j}")]
    drift, kick = (weighted("W", weights, names, formulas) for names in (velocities, accelerations))
    following = [f"u + dt * ({drift})", f"v + dt * ({kick})", "v", "a", *carried[:-2]]
    text = (
        "def step_adams(state, t, dt, p, acceleration):\n"
        f"    u, v, {', '.join(carried)} = state\n"
        "    a = acceleration(u, v, t, p)\n"
        f"    return ({', '.join(following)}), v\n"
    )
    return written(text, formulas)


def start_two(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration
) -> tuple[float, ...]:
    """Return u^1 and v^1 by a step of Heun's method, and the slopes at n = 0."""
    one, _ = heun_step((u, v), 0.0, dt, p, acceleration)
    return one[0], one[1], v, acceleration(u, v, 0.0, p)


def start_three(
    variant: int, u: float, v: float, dt: float, p: Any, acceleration: Acceleration
) -> tuple[float, ...]:
    """Return u^1 and v^1 by Kutta's method, the slopes at n = 0, and slopes at n = -1 that reproduce its u^2, v^2."""
    one, _ = kutta_step((u, v), 0.0, dt, p, acceleration)
    two, _ = kutta_step(one, dt, dt, p, acceleration)
    u_1, v_1 = one
    a_0, a_1 = acceleration(u, v, 0.0, p), acceleration(u_1, v_1, dt, p)
    v_before = (12.0 * (two[0] - u_1) / dt - 23.0 * v_1 + 16.0 * v) / 5.0
    a_before = (12.0 * (two[1] - v_1) / dt - 23.0 * a_1 + 16.0 * a_0) / 5.0
    return u_1, v_1, v, a_0, v_before, a_before


def _scheme(
    kind: str,
    title: str,
    weights: tuple[str, ...],
    start: Callable[..., tuple[float, ...]],
    start_in_words: str,
    orders: Orders,
) -> Scheme:
    def carried(u: Any, v: Any, a: Any, t: Any, dt: Any) -> Any:
        """Return u and v at t, then v and a at the previous points, the latest first."""
        previous = [t - float(j) * dt for j in range(1, len(weights))]
        return u(t), v(t), *(slope(time) for time in previous for slope in (v, a))

    return Scheme(
        kind=kind,
        title=title,
        source="Hairer, Norsett and Wanner I, section III.1",
        family="multistep",
        stepper=lambda options: Stepper(start, adams_bashforth(weights), carried=carried),
        orders=lambda options: orders,
        start=start_in_words,
    )


AB2 = _scheme(
    "ab2",
    "Adams-Bashforth method (order 2)",
    ("3/2", "-1/2"),
    start_two,
    "u^1 by Heun's method",
    same_orders(2, energy_linear=3),
)
AB3 = _scheme(
    "ab3",
    "Adams-Bashforth method (order 3)",
    ("23/12", "-4/3", "5/12"),
    start_three,
    "u^1 and u^2 by Kutta's third-order method",
    same_orders(3),
)

ADAMS_BASHFORTH = (AB2, AB3)
