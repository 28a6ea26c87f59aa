"""The centred scheme against exact discrete solutions, published numbers and its own algebra."""

import math

import mpmath
import numpy as np
import pytest

from vibsim.engine import integrate
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES

CENTRAL = SCHEMES["central"]
ARITHMETICS = next(o.choices for o in CENTRAL.options if o.name == "arithmetic")


def run(kind, level, *, theta=1.0, omega=0.0, end=20.0, g=1.0, scheme=CENTRAL, **options):
    steps = 2**level
    return integrate(
        MODELS[kind],
        scheme,
        {**scheme.defaults(), **options},
        np.array([[g, 1.0, 1.0, 0.0][: len(MODELS[kind].parameters)]]),
        np.array([[theta, omega]]),
        np.array([end / steps]),
        steps,
        1,
    )


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize(
    ("level", "theta"), [(6, 0.9996677748139638), (7, 0.9971663759228251), (8, 0.9961666300804089)]
)
def test_theta_at_20_on_three_levels(arithmetic, level, theta):
    assert run("pendulum", level, arithmetic=arithmetic).position[0, -1] == pytest.approx(
        theta, abs=1e-11
    )


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize(
    ("theta", "omega", "g"), [(1.0, 0.0, 1.0), (0.3, -2.0, 4.0), (-2.0, 0.5, 9.81)]
)
def test_linear_motion_is_the_exact_discrete_solution(arithmetic, theta, omega, g):
    """``theta^n = A cos(n a) + B sin(n a)``, ``sin(a/2) = w dt/2``: vibration text, section 4.2."""
    level, end = 9, 20.0
    dt = end / 2**level
    n = np.arange(2**level + 1)
    angle = 2 * math.asin(math.sqrt(g) * dt / 2)
    exact = theta * np.cos(n * angle) + omega * dt / math.sin(angle) * np.sin(n * angle)
    error = run(
        "linear_pendulum", level, theta=theta, omega=omega, end=end, g=g, arithmetic=arithmetic
    )
    scale = abs(theta) + abs(omega)
    # each of N roundings acts on the velocity at most: N^2 eps is the worst that the three-term form can do
    assert np.max(np.abs(error.position[0] - exact)) <= scale * (2**level) ** 2 * 2.0**-53


def test_round_off_separates_the_three_arithmetics():
    """Against the same discrete solution at 60 digits: three_term, increment, compensated, each far better."""
    level = 14
    with mpmath.workdps(60):
        dt = mpmath.mpf(20) / 2**level
        exact = mpmath.cos(2**level * 2 * mpmath.asin(dt / 2))
        errors = [
            float(
                abs(exact - mpmath.mpf(run("linear_pendulum", level, arithmetic=a).position[0, -1]))
            )
            for a in ("three_term", "increment", "compensated")
        ]
    assert errors[0] > 20 * errors[1]
    assert errors[2] <= 2.0**-52


def test_increment_beats_three_term_by_four_orders_at_level_20():
    exact = 0.9958006771243681
    level = 20
    fine = run("pendulum", level + 1).position[0, -1]
    defects = {}
    for arithmetic in ("increment", "three_term"):
        value = run("pendulum", level, arithmetic=arithmetic).position[0, -1]
        # the error of the scheme itself, known from the compensated form one level finer, is taken off
        defects[arithmetic] = abs((value - exact) - 4 * (fine - exact))
    assert defects["increment"] <= 1e-3 * defects["three_term"]


SHARES = {"centred": 0.5, "taylor": 0.5, "first_order": 0.0, "backward": 1.0}
"""Of dt^2 times the acceleration, in the first step."""


@pytest.mark.parametrize("start", SHARES)
@pytest.mark.parametrize(("kind", "force"), [("pendulum", math.sin(0.7)), ("linear_pendulum", 0.7)])
def test_first_step(kind, force, start):
    runs = run(kind, 6, theta=0.7, omega=0.4, start=start)
    dt = 20.0 / 64
    expected = 0.7 + dt * 0.4 - SHARES[start] * dt**2 * force
    assert runs.position[0, 1] == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_velocity_is_the_centred_difference_and_its_end_formulas(arithmetic):
    dt = 20.0 / 64
    kick, extrapolate, backward = (
        run("pendulum", 6, arithmetic=arithmetic, end_velocity=rule)
        for rule in ("kick", "extrapolate", "backward")
    )
    u, v = kick.position[0], kick.velocity[0]
    np.testing.assert_allclose(v[1:-1], (u[2:] - u[:-2]) / (2 * dt), atol=1e-13)
    assert v[0] == 0.0
    assert v[-1] == pytest.approx((u[-1] - u[-2]) / dt - dt * math.sin(u[-1]) / 2, abs=1e-13)
    assert extrapolate.velocity[0, -1] == pytest.approx(2 * v[-2] - v[-3], abs=1e-13)
    assert backward.velocity[0, -1] == pytest.approx((u[-1] - u[-2]) / dt, abs=1e-13)
    for other in (extrapolate, backward):
        np.testing.assert_array_equal(other.position, kick.position)
        np.testing.assert_array_equal(other.velocity[0, :-1], v[:-1])


def test_the_scheme_runs_backwards_to_where_it_came_from():
    """The centred scheme is symmetric: with the kick velocity at the end, reversed, it returns."""
    there = run("pendulum", 10, theta=1.2, omega=0.3, end_velocity="kick")
    back = run(
        "pendulum",
        10,
        theta=there.position[0, -1],
        omega=-there.velocity[0, -1],
        end_velocity="kick",
    )
    assert back.position[0, -1] == pytest.approx(1.2, abs=1e-13)
    assert back.velocity[0, -1] == pytest.approx(-0.3, abs=1e-13)


@pytest.mark.parametrize(("theta", "end", "with_end"), [(3.0, 20.0, 3.43), (1.0, 25.0, 3.87)])
def test_what_the_end_point_does_to_the_energy(theta, end, with_end):
    """The extrapolated end velocity spoils the maximum of the energy deviation; the kick does not."""
    coarse, fine = (run("pendulum", level, theta=theta, end=end) for level in (7, 8))
    assert coarse.gathered.deviation[0] / fine.gathered.deviation[0] == pytest.approx(
        with_end, abs=0.005
    )
    assert coarse.gathered.deviation_interior[0] / fine.gathered.deviation_interior[
        0
    ] == pytest.approx(4.0, abs=0.005)
    coarse, fine = (
        run("pendulum", level, theta=theta, end=end, end_velocity="kick") for level in (7, 8)
    )
    assert coarse.gathered.deviation[0] / fine.gathered.deviation[0] == pytest.approx(
        4.0, abs=0.005
    )


def test_backward_end_velocity_makes_the_largest_energy_deviation_first_order():
    """Errata, vibration text section 2.1."""
    sizes = [
        run("pendulum", level, end_velocity="backward").gathered.deviation[0]
        for level in (8, 9, 10, 11)
    ]
    np.testing.assert_allclose(sizes, [3.17e-3, 1.50e-3, 7.20e-4, 3.52e-4], rtol=4e-3)


def test_period_converges_to_the_elliptic_integral():
    exact = 6.699975664370453  # 4 K(sin 1/2)
    errors = [
        run("pendulum", level, end=50.0).gathered.period[0] - exact for level in (9, 10, 11, 12)
    ]
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4.0, rtol=0.02)


def test_time_of_a_turn_converges():
    exact = float(
        MODELS["pendulum"].exact_period(
            {"theta": 2.0, "omega": -3.0}, {"g": 1.0, "L": 1.0, "m": 1.0}
        )
    )
    errors = [
        run("pendulum", level, theta=2.0, omega=-3.0, end=50.0).gathered.period[0] - exact
        for level in (10, 11, 12)
    ]
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4.0, rtol=0.02)


def test_one_step_and_two_steps():
    for level in (0, 1):
        for rule in ("kick", "extrapolate", "backward"):
            runs = run("pendulum", level, end=0.1, end_velocity=rule)
            assert runs.position.shape == (1, 2**level + 1)
            assert np.isfinite(runs.velocity).all()
            assert runs.last_step[0] == 2**level


@pytest.mark.parametrize("rule", ["kick", "extrapolate", "backward"])
def test_the_end_velocity_does_not_move_a_peak(rule):
    """The last peak lies in the last step: a one-sided velocity there would place it with an error of dt."""
    end = 2 * math.pi * 1.002
    errors = [
        run("linear_pendulum", level, end=end, end_velocity=rule).gathered.period[0] - 2 * math.pi
        for level in (7, 8, 9)
    ]
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4.0, rtol=0.05)


def test_there_is_no_amplitude_before_there_is_a_trough():
    assert math.isnan(run("pendulum", 8, end=1.0).gathered.last_trough[0])
    assert run("pendulum", 10, theta=-1.0, end=20.0).gathered.last_trough[0] == pytest.approx(
        -1.0, abs=1e-3
    )


@pytest.mark.parametrize(
    ("start", "kind"), [("backward", "euler_cromer"), ("first_order", "euler_cromer_u_first")]
)
@pytest.mark.parametrize("arithmetic", ["compensated", "increment", "three_term"])
def test_one_sided_differences_start_as_euler_cromer_does(start, kind, arithmetic):
    """Vibration text, section 7.2: backward with the velocity first, forward with the position first."""
    found = run("pendulum", 6, theta=0.7, omega=0.4, start=start, arithmetic=arithmetic)
    other = run("pendulum", 6, theta=0.7, omega=0.4, scheme=SCHEMES[kind])
    np.testing.assert_allclose(found.position, other.position, rtol=0, atol=1e-12)


def test_a_taylor_polynomial_starts_as_the_centred_difference_does():
    """Vibration text, exercise 5, for any initial velocity."""
    centred, taylor = (
        run("pendulum", 6, theta=0.7, omega=0.4, start=s) for s in ("centred", "taylor")
    )
    np.testing.assert_array_equal(taylor.position, centred.position)
    np.testing.assert_array_equal(taylor.velocity, centred.velocity)


@pytest.mark.parametrize(("g", "omega"), [(1.0, 0.0), (4.0, -1.5), (0.25, 0.7)])
def test_the_corrected_frequency_is_right_to_fourth_order(g, omega):
    """Exercise 3, for any initial velocity; twice on a ladder: the position falls by 16, without it by 4."""
    w = math.sqrt(g)
    for is_corrected, ratio in ((True, 16.0), (False, 4.0)):
        errors = []
        for level in (9, 10):
            t = np.linspace(0.0, 20.0, 2**level + 1)
            exact = 1.0 * np.cos(w * t) + omega / w * np.sin(w * t)
            found = run(
                "linear_pendulum", level, omega=omega, g=g, frequency_correction=is_corrected
            )
            errors.append(np.max(np.abs(found.position[0] - exact)))
        # the next term is smaller by p^2 with p = w dt <= 2 20/512
        assert errors[0] / errors[1] == pytest.approx(ratio, rel=2e-2)


def test_a_start_without_its_second_order_term_breaks_the_promise():
    """The trap of A, section 2.3: order 1 where the scheme promises 2."""
    fine = run("pendulum", 14).position[0, -1]
    errors = [run("pendulum", n, start="first_order").position[0, -1] - fine for n in (9, 10, 11)]
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 2.0, rtol=0.1)
