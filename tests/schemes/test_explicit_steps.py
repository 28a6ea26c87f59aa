"""Explicit schemes against the same steps written by hand, as their sources print them, on a driven pendulum."""

import math

import numpy as np
import pytest
import scheme_runs as runs_of

from vibsim.models import MODELS
from vibsim.schemes import SCHEMES

STEPS, DT = 16, 0.2


def force(u, v, t):
    return -math.sin(u) - 0.2 * v - 0.1 * v**3 + 0.3 * math.cos(1.7 * t)


def push(u, t):
    return -math.sin(u) + 0.3 * math.cos(1.7 * t)


def slope(y, t):
    return np.array([y[1], force(y[0], y[1], t)])


def euler(y, t, h):
    return y + h * slope(y, t)


def midpoint(y, t, h):
    return y + h * slope(y + h / 2 * slope(y, t), t + h / 2)


def heun(y, t, h):
    k = slope(y, t)
    return y + h / 2 * (k + slope(y + h * k, t + h))


def kutta(y, t, h):
    k_1 = slope(y, t)
    k_2 = slope(y + h / 2 * k_1, t + h / 2)
    k_3 = slope(y + h * (2 * k_2 - k_1), t + h)
    return y + h / 6 * (k_1 + 4 * k_2 + k_3)


def classical(y, t, h):
    k_1 = slope(y, t)
    k_2 = slope(y + h / 2 * k_1, t + h / 2)
    k_3 = slope(y + h / 2 * k_2, t + h / 2)
    k_4 = slope(y + h * k_3, t + h)
    return y + h / 6 * (k_1 + 2 * k_2 + 2 * k_3 + k_4)


def velocity_first(y, t, h):
    v = y[1] + h * force(y[0], y[1], t)
    return np.array([y[0] + h * v, v])


def position_first(y, t, h):
    u = y[0] + h * y[1]
    return np.array([u, y[1] + h * push(u, t + h)])


def velocity_verlet(y, t, h):
    u = y[0] + h * y[1] + h**2 / 2 * push(y[0], t)
    return np.array([u, y[1] + h / 2 * (push(y[0], t) + push(u, t + h))])


def position_verlet(y, t, h):
    middle = y[0] + h / 2 * y[1]
    v = y[1] + h * push(middle, t + h / 2)
    return np.array([middle + h / 2 * v, v])


def yoshida(y, t, h):
    """Three steps of position Verlet, of x_1, x_0 and x_1 times dt."""
    x_1 = 1.0 / (2.0 - math.cbrt(2.0))
    x_0 = 1.0 - 2.0 * x_1
    for part in (x_1, x_0, x_1):
        y = position_verlet(y, t, part * h)
        t += part * h
    return y


def pefrl(y, t, h):
    xi, lam, chi = 0.1786178958448091, -0.2123418310626054, -0.06626458266981849
    (u, v) = y
    drifts = [xi, chi, 1 - 2 * (chi + xi), chi, xi]
    kicks = [(1 - 2 * lam) / 2, lam, lam, (1 - 2 * lam) / 2, 0.0]
    for drift, kick in zip(drifts, kicks, strict=True):
        u, t = u + drift * h * v, t + drift * h
        v = v + kick * h * push(u, t)
    return np.array([u, v])


def nystrom(y, t, h):
    (u, v) = y
    k_1 = push(u, t)
    k_2 = push(u + h / 2 * v + h**2 / 8 * k_1, t + h / 2)
    k_3 = push(u + h * v + h**2 / 2 * k_2, t + h)
    return np.array([u + h * v + h**2 / 6 * (k_1 + 2 * k_2), v + h / 6 * (k_1 + 4 * k_2 + k_3)])


ONE_STEP = {
    "forward_euler": euler,
    "rk2": midpoint,
    "heun": heun,
    "rk3": kutta,
    "rk4": classical,
    "euler_cromer": velocity_first,
    "euler_cromer_u_first": position_first,
    "velocity_verlet": velocity_verlet,
    "position_verlet": position_verlet,
    "yoshida4": yoshida,
    "pefrl": pefrl,
    "rkn4": nystrom,
}


def by_hand(step):
    y = [np.array(runs_of.INITIAL)]
    for n in range(STEPS):
        y.append(step(y[-1], n * DT, DT))
    return np.array(y)


def adams(weights, starter):
    """Textbook start: as many steps of the one-step method as the formula needs points."""
    y = [np.array(runs_of.INITIAL)]
    for n in range(len(weights) - 1):
        y.append(starter(y[-1], n * DT, DT))
    for n in range(len(weights) - 1, STEPS):
        slopes = [slope(y[n - j], (n - j) * DT) for j in range(len(weights))]
        y.append(y[-1] + DT * sum(w * f for w, f in zip(weights, slopes, strict=True)))
    return np.array(y)


def compare(kind, expected):
    scheme = SCHEMES[kind]
    model = runs_of.DRAGGED if scheme.velocity_forces else runs_of.DRIVEN
    found = runs_of.run(scheme, model, scheme.defaults(), STEPS, end=STEPS * DT)
    # each step rounds some 20 terms of the size of the state, and an error of v moves u for the time left
    bound = STEPS * 20 * 2.0**-53 * (1.0 + STEPS * DT) * np.max(np.abs(expected))
    np.testing.assert_allclose(found.position[0], expected[:, 0], rtol=0, atol=bound)
    np.testing.assert_allclose(found.velocity[0], expected[:, 1], rtol=0, atol=bound)


@pytest.mark.parametrize("kind", ONE_STEP)
def test_steps_are_those_of_the_source(kind):
    compare(kind, by_hand(ONE_STEP[kind]))


def test_adams_bashforth_starts_with_points_of_a_one_step_method():
    """The slope that stands for the one at n = -1 gives u^2 of Kutta's method, and is forgotten then."""
    compare("ab2", adams((3 / 2, -1 / 2), heun))
    compare("ab3", adams((23 / 12, -16 / 12, 5 / 12), kutta))


@pytest.mark.parametrize("kind", ["euler_cromer", "euler_cromer_u_first", "velocity_verlet"])
def test_positions_are_those_of_the_centred_scheme(kind):
    """Euler-Cromer with the centred start (vibration text 7.2), Verlet always; its velocity is ``[D_2t u]``."""
    scheme, central = SCHEMES[kind], SCHEMES["central"]
    centred = {"start": "centred"} if scheme.options else {}
    found = runs_of.run(scheme, runs_of.DRIVEN, centred, 256)
    expected = runs_of.run(central, runs_of.DRIVEN, runs_of.own_end(central), 256)
    bound = 256 * 20 * 2.0**-53 * (1.0 + runs_of.END) * 4.0
    np.testing.assert_allclose(found.position, expected.position, rtol=0, atol=bound)
    if not scheme.stepper(scheme.defaults() | centred).own_velocity:
        np.testing.assert_allclose(
            found.velocity[0], expected.velocity[0], rtol=0, atol=256 * bound / runs_of.END
        )


@pytest.mark.parametrize(("kind", "sign"), [("euler_cromer", 1), ("euler_cromer_u_first", -1)])
def test_plain_euler_cromer_is_half_a_step_off(kind, sign):
    """``u^n = I cos((n +- 1/2) a)/cos(a/2)``, ``sin(a/2) = w dt/2`` (errata, vibration text 7.1)."""
    steps, end = 64, 10.0
    scheme = SCHEMES[kind]
    found = runs_of.run(
        scheme, MODELS["spring"], scheme.defaults(), steps, initial=(1.0, 0.0), end=end
    )
    angle = 2.0 * math.asin(0.5 * end / steps)
    n = np.arange(steps + 1)
    expected = np.cos((n + sign * 0.5) * angle) / math.cos(0.5 * angle)
    bound = steps * 20 * 2.0**-53 * (1.0 + end)
    np.testing.assert_allclose(found.position[0], expected, rtol=0, atol=bound)
