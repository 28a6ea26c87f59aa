"""Centred differences on damped oscillators: the text's recurrences, what they reproduce, and their orders."""

import math

import numpy as np
import pytest

from vibsim.engine import LANES, integrate
from vibsim.models.oscillator import written
from vibsim.schemes import SCHEMES
from vibsim.schemes.orders import depends_on_velocity

KINDS = ("central", "central_quadratic_root", "central_backward_damping")
ARITHMETICS = ("compensated", "increment", "three_term")
DAMPINGS = {"linear": "b*v", "quadratic": "b*abs(v)*v"}
M, B, K, F = 1.3, 0.4, 2.1, 0.6


def model(damping, **formulas):
    return written({"damping": damping, "spring": "k*u + u**3", **formulas}, ("k", "F"))


def run(kind, of, n, *, end=6.0, start=(0.8, -0.5), lane=None, **options):
    scheme = SCHEMES[kind]
    return integrate(
        of,
        scheme,
        {**scheme.defaults(), **options},
        np.array([[M, B, K, F]]),
        np.array([start]),
        np.array([end / n]),
        n,
        1,
        lane=lane,
    )


def recurrence(kind, damping, n, end=6.0, start=(0.8, -0.5)):
    """Step as the text writes it: B (64)-(65), (71)-(72), the root of section 8.2, exercise 16."""
    dt = end / n
    u_0, v_0 = start

    def rest(u, t):
        return F * math.cos(1.7 * t) - (K * u + u**3)

    first = B * v_0 if damping == "linear" else B * abs(v_0) * v_0
    u = [u_0, u_0 + dt * v_0 + dt**2 / (2 * M) * (rest(u_0, 0.0) - first)]
    for i in range(1, n):
        here, behind, right = u[i], u[i - 1], rest(u[i], i * dt)
        d = here - behind
        if kind == "central_backward_damping":
            back = B * d / dt if damping == "linear" else B * abs(d / dt) * d / dt
            u.append(2 * here - behind + dt**2 / M * (right - back))
        elif damping == "linear":
            above = 2 * M * here + (B / 2 * dt - M) * behind + dt**2 * right
            u.append(above / (M + B / 2 * dt))
        elif kind == "central":
            above = 2 * M * here - M * behind + B * here * abs(d) + dt**2 * right
            u.append(above / (M + B * abs(d)))
        else:
            # b/(4 dt^2) |s| s + m s/dt^2 = right + 2 m d/dt^2 with s = u^(n+1) - u^(n-1)
            constant = dt**2 * right + 2 * M * d
            size = (-M + math.sqrt(M * M + B * abs(constant))) / (B / 2)
            u.append(behind + math.copysign(size, constant))
    return np.array(u)


@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("kind", KINDS)
def test_steps_are_those_of_the_text(kind, arithmetic, damping):
    of = model(DAMPINGS[damping], force="F*cos(1.7*t)")
    for n in (7, 60, 61):
        found = run(kind, of, n, arithmetic=arithmetic).position[0]
        # every rounding of the three-term recurrences is carried on for the rest of the run
        np.testing.assert_allclose(found, recurrence(kind, damping, n), atol=n * n * 2.0**-52)


@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_linear_solution_is_reproduced(kind, damping):
    of = model(DAMPINGS[damping], exact="0.8 - 0.5*t")
    found = run(kind, of, 100)
    exact = 0.8 - 0.5 * np.linspace(0.0, 6.0, 101)
    np.testing.assert_allclose(found.position[0], exact, atol=2e-14)


@pytest.mark.parametrize("kind", KINDS)
def test_a_quadratic_solution_is_reproduced_where_linear_damping_is_centred(kind):
    of = model(DAMPINGS["linear"], exact="0.8 - 0.5*t + 0.2*t**2")
    t = np.linspace(0.0, 6.0, 101)
    error = np.max(np.abs(run(kind, of, 100).position[0] - (0.8 - 0.5 * t + 0.2 * t**2)))
    assert (error < 1e-13) == (kind != "central_backward_damping")


@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize("kind", KINDS)
def test_errors_fall_with_the_declared_order(kind, damping):
    of = model(DAMPINGS[damping], exact="0.8*cos(1.1*t) - t/5")
    errors = []
    for level in (9, 10, 11):
        found = run(kind, of, 2**level, start=(0.8, -0.2))
        t = np.linspace(0.0, 6.0, 2**level + 1)
        errors.append(np.max(np.abs(found.position[0] - (0.8 * np.cos(1.1 * t) - t / 5))))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    scheme = SCHEMES[kind]
    declared = scheme.formal_order("u", of, scheme.defaults())
    assert declared == (1 if kind == "central_backward_damping" else 2)
    np.testing.assert_allclose(orders, declared, atol=0.03)


@pytest.mark.parametrize("kind", KINDS)
def test_without_damping_all_are_one_scheme(kind):
    of = written({"spring": "k*u"}, ("b", "k", "F"))
    assert not depends_on_velocity(of)
    found, central = (run(name, of, 64) for name in (kind, "central"))
    assert found.position.tobytes() == central.position.tobytes()
    assert found.velocity.tobytes() == central.velocity.tobytes()


@pytest.mark.parametrize(
    ("kind", "damping"),
    [
        ("central", "quadratic"),
        pytest.param("central", "linear", marks=pytest.mark.slow),
        pytest.param("central_quadratic_root", "quadratic", marks=pytest.mark.slow),
        pytest.param("central_backward_damping", "quadratic", marks=pytest.mark.slow),
    ],
)
def test_lanes_give_the_same_bits(kind, damping):
    of = model(DAMPINGS[damping], force="F*cos(1.7*t)")
    plain, *others = (run(kind, of, 200, lane=lane) for lane in LANES)
    for other in others:
        assert plain.position.tobytes() == other.position.tobytes()
        assert plain.velocity.tobytes() == other.velocity.tobytes()
        assert plain.gathered.deviation.tobytes() == other.gathered.deviation.tobytes()


@pytest.mark.parametrize(
    ("damping", "able"), [("b*v", KINDS), ("F*sinh(v)", ("central_backward_damping",))]
)
def test_what_a_scheme_can_treat(damping, able):
    assert [kind for kind in KINDS if SCHEMES[kind].treats(model(damping))] == list(able)
