"""The scheme of the last lab sheet: half a kick, a drift, half a kick. Something in it is wrong."""

from __future__ import annotations

from vibsim.schemes import Scheme
from vibsim.schemes.code_generation import self_starting
from vibsim.schemes.orders import same_orders


def step_lab(state, t, dt, p, acceleration):
    """Return the angle and the angular velocity at t + dt, and the angular velocity at t; state is both at t."""
    u, v = state
    v_half = v + 0.5 * dt * acceleration(u, v, t, p)
    u_new = u + dt * v_half
    v_new = v_half + dt * acceleration(u, v_half, t, p)
    return (u_new, v_new), v


STEPPER = self_starting(step_lab)
LAB = Scheme(
    kind="lab",
    title="Kick, drift, kick",
    source="Verlet 1967, in the form with the velocity",
    family="lab",
    stepper=lambda options: STEPPER,
    orders=lambda options: same_orders(2),
)
