"""Theory of a step that somebody else wrote: one that iterates until two numbers agree, and so may not end."""

import math

import pytest

from vibsim import theory
from vibsim.core.errors import VibsimError
from vibsim.schemes import Scheme
from vibsim.schemes.code_generation import self_starting
from vibsim.schemes.orders import same_orders


def until_small(state, t, dt, p, acceleration):
    """Solve the equation of Crank and Nicolson by iteration, which converges for w dt < 2."""
    u, v = state
    x, change = u, 1.0
    while abs(change) > 1e-12:
        y = u + dt * v + 0.25 * dt * dt * (acceleration(u, v, t, p) + acceleration(x, v, t + dt, p))
        change = y - x
        x = y
    return (x, v + 0.5 * dt * (acceleration(u, v, t, p) + acceleration(x, v, t + dt, p))), v


def until_lost(state, t, dt, p, acceleration):
    """Compare with 1 what is far smaller: a loop that ends in 16 digits, and not in 32."""
    u, v = state
    small = 1.0
    while 1.0 + small * dt != 1.0:
        small = 0.9 * small
    return (u + dt * v, v + dt * acceleration(u, v, t, p)), v


def own(step):
    stepper = self_starting(step)
    return Scheme(
        kind=step.__name__,
        title="of a test",
        source="a test",
        family="own",
        stepper=lambda options: stepper,
        orders=lambda options: same_orders(2),
    )


def test_where_a_loop_does_not_end_there_is_no_theory():
    stepper = own(until_small).stepper({})
    alone = theory.roots(stepper, [0.5, 0.6]).log_growth
    beside = theory.roots(stepper, [0.5, 2.0]).log_growth
    assert abs(alone[0]) < 1e-11
    assert abs(beside[0]) < 1e-11
    assert math.isnan(beside[1])
    u, v = theory.rounding_bound(stepper, 1.0, [0.5, 2.0], 1.0, 0.0, 8)
    assert u[0] < 1e-12
    assert u[1] == v[1] == math.inf


@pytest.mark.slow
def test_a_loop_that_does_not_end_limits_the_step():
    assert 1.8 < theory.stability_limit(own(until_small), {}) < 2.0


def test_a_loop_that_32_digits_do_not_end_is_refused():
    with pytest.raises(VibsimError, match="the theory of the step until_lost cannot be computed"):
        theory.roots(own(until_lost).stepper({}), [0.5])
