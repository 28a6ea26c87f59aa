"""Every scheme against its exact discrete solution, and those solutions of the vibration text that are known."""

import mpmath
import numpy as np
import pytest
from scheme_variants import VARIANTS
from thinned import thinned

from vibsim.engine import integrate
from vibsim.models import MODELS
from vibsim.schemes import FIXED_STEP, SCHEMES, Stepper
from vibsim.schemes.base import LOW_STARTS
from vibsim.theory import discrete, orders, rounding_bound, stability_limit

SPRING = MODELS["spring"]


def steps_per_radian(scheme, options):
    """Return values of w dt that are small, large, just within and beyond the limit, and exactly at it."""
    limit = stability_limit(scheme, options)
    if not 0 < limit < np.inf:
        return np.array([1e-3, 0.1, 0.77, 1.9, 5.0])
    return np.array([1e-3, 0.1, 0.3 * limit, 0.999 * limit, limit, 1.01 * limit])


def run(scheme, options, p, initial, steps):
    parameters = np.ones((len(p), 1))
    starts = np.tile(initial, (len(p), 1))
    runs = integrate(
        SPRING, scheme, options, parameters, starts, p, steps, 1, lane="plain", with_gathered=False
    )
    return runs.position, runs.velocity, runs.last_step


@pytest.mark.parametrize(("scheme", "options"), thinned(VARIANTS, 5))
def test_what_is_computed_is_the_exact_discrete_solution(scheme, options):
    p = steps_per_radian(scheme, options)
    steps = 500
    stepper = scheme.stepper(options)
    position, velocity, last = run(scheme, options, p, (1.1, -0.3), steps)
    u, v = discrete(stepper, 1.0, p, 1.1, -0.3, np.arange(steps + 1), steps)
    for end in np.unique(last):
        rows = last == end
        bounds = rounding_bound(stepper, 1.0, p[rows], 1.1, -0.3, int(end))
        for computed, exact, bound in zip((position, velocity), (u, v), bounds, strict=True):
            error = np.max(np.abs(computed - exact)[rows, : end + 1], axis=1)
            assert np.all(error <= bound)
            scale = np.max(np.abs(exact[rows, : end + 1]), axis=1)
            assert np.all(bound < 1e-5 * scale)


@pytest.mark.parametrize("scheme", thinned(FIXED_STEP.values(), 3), ids=FIXED_STEP)
def test_the_derived_bound_sees_another_frequency(scheme):
    """One part in 10^11 is more than rounding, of every scheme."""
    stepper = scheme.stepper(scheme.defaults())
    n = np.arange(1001)
    u, _ = discrete(stepper, 1.0, 0.05, 1.0, 0.0, n)
    wrong, _ = discrete(stepper, 1.0 + 1e-11, 0.05, 1.0, 0.0, n)
    bound, _ = rounding_bound(stepper, 1.0, 0.05, 1.0, 0.0, 1000)
    assert np.max(np.abs(u - wrong)) > bound


def close(computed, exact, scale=1.0):
    """Compare with numbers of many digits: one rounding of what is near `scale`, and one of the coefficient."""
    for one, other in zip(computed, exact, strict=True):
        assert abs(mpmath.mpf(float(one)) - other) <= 4e-16 * scale


N = np.array([0, 1, 2, 3, 50, 1001, 10**6, 10**9])


@pytest.fixture
def digits():
    with mpmath.workdps(60):
        yield


def stepper(kind, **options):
    scheme = SCHEMES[kind]
    return scheme.stepper({**scheme.defaults(), **options})


@pytest.mark.usefixtures("digits")
@pytest.mark.parametrize("arithmetic", ["compensated", "increment", "three_term"])
def test_central_is_the_cosine_of_equation_20(arithmetic):
    w, dt = 2 * np.pi, 0.07
    u, v = discrete(stepper("central", arithmetic=arithmetic), w, dt, 1.5, 0.0, N)
    angle = 2 * mpmath.asin(mpmath.mpf(w) * dt / 2)
    close(u, [1.5 * mpmath.cos(int(n) * angle) for n in N], 1.5)
    # the centred difference of it
    speed = mpmath.sin(angle) / mpmath.mpf(dt)
    close(v, [-1.5 * speed * mpmath.sin(int(n) * angle) for n in N], 1.5 * float(speed))


@pytest.mark.usefixtures("digits")
def test_forward_euler_is_equations_43_and_44():
    w, dt = 2.0, 0.05
    n = np.array([0, 1, 7, 500, 20000])
    u, v = discrete(stepper("forward_euler"), w, dt, 0.7, 0.0, n)
    p = mpmath.mpf(w) * mpmath.mpf(dt)
    for k, here, speed in zip(n.tolist(), u, v, strict=True):
        grown = 0.7 * (1 + p * p) ** (mpmath.mpf(k) / 2)
        close(
            [here, speed],
            [grown * mpmath.cos(k * mpmath.atan(p)), -w * grown * mpmath.sin(k * mpmath.atan(p))],
            float(2 * grown),
        )


@pytest.mark.usefixtures("digits")
@pytest.mark.parametrize(("kind", "sign"), [("euler_cromer", 1), ("euler_cromer_u_first", -1)])
def test_euler_cromer_is_a_cosine_half_a_step_away(kind, sign):
    """Exercise 17, and the errata: the same frequency as the centred scheme, another phase and amplitude."""
    p = 0.6
    u, _ = discrete(stepper(kind), 1.0, p, 1.2, 0.0, N)
    angle = 2 * mpmath.asin(mpmath.mpf(p) / 2)
    wanted = [
        1.2 * mpmath.cos((int(n) + sign * mpmath.mpf("0.5")) * angle) / mpmath.cos(angle / 2)
        for n in N
    ]
    close(u, wanted, 1.5)


def test_at_the_limit_the_solutions_are_whole_numbers():
    n = np.arange(2000)
    sign = (-1.0) ** n
    u, _ = discrete(stepper("euler_cromer"), 1.0, 2.0, 1.0, 0.0, n)
    np.testing.assert_array_equal(u, sign * (1 + 2 * n))
    u, _ = discrete(stepper("euler_cromer", start="centred"), 1.0, 2.0, 1.0, 0.0, n)
    np.testing.assert_array_equal(u, sign)
    # u^1 = -u^0 + V dt, and twice the root -1: u^n = (-1)^n (u^0 - n V dt)
    u, v = discrete(stepper("central"), 1.0, 2.0, 1.0, 0.25, n)
    np.testing.assert_array_equal(u, sign * (1 - 0.5 * n))
    np.testing.assert_array_equal(v[1:], sign[1:] * 0.25)


def test_shapes_members_and_what_is_too_large():
    method = stepper("forward_euler")
    assert discrete(method, 1.0, 0.1, 1.0, 0.0, 5)[0].shape == ()
    assert discrete(method, 1.0, 0.1, 1.0, 0.0, [5, 6])[0].shape == (2,)
    assert discrete(method, 1.0, [0.1, 0.2], 1.0, 0.0, 5)[0].shape == (2,)
    u, _ = discrete(method, [1.0, 2.0], 0.1, 1.0, 0.0, np.arange(100))
    assert u.shape == (2, 100)
    np.testing.assert_array_equal(u[1], discrete(method, 2.0, 0.1, 1.0, 0.0, np.arange(100))[0])
    u, _ = discrete(method, 1.0, 1.0, 1.0, 0.0, [2000, 3001, 10**6])
    np.testing.assert_array_equal(np.isinf(u), [False, True, True])


@pytest.mark.parametrize("end", ["extrapolate", "backward", "kick"])
def test_the_last_velocity_follows_the_rule_of_the_scheme(end):
    method = stepper("central", end_velocity=end)
    u, v = discrete(method, 1.0, 0.3, 1.0, 0.2, np.arange(12), 10)
    wanted = {
        "extrapolate": 2 * v[9] - v[8],
        "backward": (u[10] - u[9]) / 0.3,
        "kick": (u[11] - u[9]) / 0.6,
    }
    np.testing.assert_allclose(v[10], wanted[end], rtol=1e-14)


@pytest.mark.parametrize(("scheme", "options"), VARIANTS)
def test_the_order_on_the_oscillator_is_the_promised_one(scheme, options):
    # such a start makes everything of first order; what a scheme promises is with a sound one
    is_sound = options.get("start") not in LOW_STARTS
    promised = (scheme.formal_order(name, SPRING, options) if is_sound else 1.0 for name in "uv")
    assert orders(scheme.stepper(options)) == tuple(promised)


def test_a_scheme_whose_solutions_overflow_has_no_order():
    """The method of order 3 with two steps that is not zero-stable (Hairer, Norsett and Wanner I, section III.3)."""

    def start(variant, u, v, dt, p, acceleration):
        return u + dt * v, v + dt * acceleration(u, v, 0.0, p), u, v

    def step(state, t, dt, p, acceleration):
        u, v, u_before, v_before = state
        a, a_before = acceleration(u, v, t, p), acceleration(u_before, v_before, t - dt, p)
        return (
            -4.0 * u + 5.0 * u_before + dt * (4.0 * v + 2.0 * v_before),
            -4.0 * v + 5.0 * v_before + dt * (4.0 * a + 2.0 * a_before),
            u,
            v,
        ), v

    assert np.isnan(orders(Stepper(start, step))).all()
