"""The implicit schemes: their own equations solved otherwise, their identities, and what Newton's method must do."""

import dataclasses
import itertools
import math

import mpmath
import numpy as np
import pytest
from thinned import thinned

from vibsim.engine import integrate, lane_for
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES
from vibsim.schemes.base import UNIT_ROUND_OFF, handed

IMPLICIT = [
    kind for kind, s in SCHEMES.items() if not s.adaptive and s.stepper(s.defaults()).implicit
]
OPTIONS = [
    *((kind, {}) for kind in IMPLICIT),
    ("newmark", {"beta": 0.0}),
    ("newmark", {"beta": 1 / 6}),
    ("newmark", {"beta": 0.3, "gamma": 0.6}),
    ("newmark", {"beta": 1.0, "gamma": 1.5}),
    ("hht", {"alpha": 0.0}),
    ("hht", {"alpha": -1 / 3}),
    ("generalized_alpha", {"rho_inf": 1.0}),
    ("generalized_alpha", {"rho_inf": 0.0}),
]
SPRING = MODELS["spring"]
FORCED = dataclasses.replace(
    SPRING,
    kind="forced",
    acceleration="-w**2*sin(u) - 0.3*abs(v)*v - 0.1*v + 0.7*cos(1.3*t)",
    linear=False,
    conservative=False,
)
"""Nonlinear, damped and forced: every argument of the force matters."""


def forced(u, v, t):
    return -mpmath.sin(u) - FRICTION * abs(v) * v - DRAG * v + LOAD * mpmath.cos(RATE * t)


FRICTION, DRAG, LOAD, RATE = map(mpmath.mpf, (0.3, 0.1, 0.7, 1.3))


def run(kind, model, steps, *, end=12.0, start=(1.1, -0.3), w=1.0, lane="plain", **options):
    scheme = SCHEMES[kind]
    numbers = (np.full((1, len(model.parameters)), w), np.array([start]), np.array([end / steps]))
    return integrate(model, scheme, {**scheme.defaults(), **options}, *numbers, steps, 1, lane=lane)


def matrix(kind, p, **options):
    """Return the step on ``u'' + p^2 u = 0`` with dt = 1, from its columns."""
    scheme = SCHEMES[kind]
    stepper = scheme.stepper({**scheme.defaults(), **options})
    functions = (lambda u, v, t, q: -p * p * u, lambda u, v, t, q: (-p * p, 0.0))
    size = len(handed(stepper.start, *functions)(0, 0.0, 0.0, 1.0, ()))
    step = handed(stepper.step, *functions)
    return np.array([step(tuple(row), 0.0, 1.0, ())[0] for row in np.eye(size).tolist()]).T


def radius(kind, p, **options):
    return max(abs(np.linalg.eigvals(matrix(kind, p, **options))))


def root(equations, guess):
    """Solve equations at 40 digits, by mpmath's own method."""
    found = mpmath.findroot(equations, guess, tol=1e-60, maxsteps=50)
    return tuple(found)


def by_definition(kind, steps, dt, options):
    """Return u and v at the end of a run on `FORCED`, from the equations of the scheme as its source has them."""
    u, v = mpmath.mpf(1.1), mpmath.mpf(-0.3)
    behind, a = None, forced(u, v, 0)
    for n in range(steps):
        t, ahead = n * dt, (n + 1) * dt

        def trapezoidal(x, y, u=u, v=v, t=t, ahead=ahead):
            kick = forced(u, v, t) + forced(x, y, ahead)
            return x - u - dt * (v + y) / 2, y - v - dt * kick / 2

        def backward(x, y, u=u, v=v, ahead=ahead):
            return x - u - dt * y, y - v - dt * forced(x, y, ahead)

        def differences(x, y, u=u, v=v, b=behind, ahead=ahead):
            return (
                3 * x - 4 * u + b[0] - 2 * dt * y,
                3 * y - 4 * v + b[1] - 2 * dt * forced(x, y, ahead),
            )

        if kind == "backward_euler":
            following = root(backward, (u, v))
        elif kind == "crank_nicolson" or (kind == "bdf2" and n == 0):
            following = root(trapezoidal, (u, v))
        elif kind == "bdf2":
            following = root(differences, (u, v))
        elif kind == "gauss4":
            following = gauss(u, v, t, dt)
        else:
            *following, a = newmark(kind, u, v, a, t, dt, options)
        behind, (u, v) = (u, v), following
    return u, v


def gauss(u, v, t, dt):
    """Take one step by all four stage equations."""
    root_3 = mpmath.sqrt(3)
    c = (mpmath.mpf(1) / 2 - root_3 / 6, mpmath.mpf(1) / 2 + root_3 / 6)
    quarter = mpmath.mpf(1) / 4
    rows = ((quarter, quarter - root_3 / 6), (quarter + root_3 / 6, quarter))

    def stages(k_1, k_2, a_1, a_2):
        left = []
        for (x, y), k, a, c_i in zip(rows, (k_1, k_2), (a_1, a_2), c, strict=True):
            speed = v + dt * (x * a_1 + y * a_2)
            left += [k - speed, a - forced(u + dt * (x * k_1 + y * k_2), speed, t + c_i * dt)]
        return left

    a = forced(u, v, t)
    k_1, k_2, a_1, a_2 = root(stages, (v, v, a, a))
    return u + dt * (k_1 + k_2) / 2, v + dt * (a_1 + a_2) / 2


def newmark(kind, u, v, a, t, dt, options):
    """Take one step by the three equations of the family, with the parameters of the papers."""
    one = mpmath.mpf(1)
    m = f = mpmath.mpf(0)
    if kind == "newmark":
        beta, gamma = mpmath.mpf(options["beta"]), mpmath.mpf(options["gamma"])
    elif kind == "hht":
        f = -mpmath.mpf(options["alpha"])
        beta, gamma = (1 + f) ** 2 / 4, (1 + 2 * f) / 2
    else:
        rho = mpmath.mpf(options["rho_inf"])
        m, f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        beta, gamma = (1 - m + f) ** 2 / 4, one / 2 - m + f

    def equations(x, y, z):
        return (
            x - u - dt * v - dt**2 * ((one / 2 - beta) * a + beta * z),
            y - v - dt * ((1 - gamma) * a + gamma * z),
            (1 - m) * z + m * a - (1 - f) * forced(x, y, t + dt) - f * forced(u, v, t),
        )

    return root(equations, (u, v, a))


@pytest.mark.parametrize(("kind", "options"), thinned(OPTIONS, 3))
def test_steps_solve_the_equations_of_the_scheme(kind, options):
    """Large steps, of which a scheme that stops early or starts otherwise would show."""
    steps, end = 24, 12.0
    chosen = {**SCHEMES[kind].defaults(), **options}
    runs = run(kind, FORCED, steps, end=end, **options)
    with mpmath.workdps(40):
        u, v = by_definition(kind, steps, mpmath.mpf(end / steps), chosen)
        # 16 roundings a step; the force is stable, so that none of them grows
        allowed = 16 * steps * UNIT_ROUND_OFF
        assert abs(runs.position[0, -1] - u) <= allowed
        assert abs(runs.velocity[0, -1] - v) <= allowed


def errors(kind, model, level, options):
    """Return the largest errors of position, velocity and energy, and of both with ``[D_2t u]``."""
    steps, end = 2**level, 12.0
    runs = run(kind, model, steps, **options)
    t, dt = np.linspace(0.0, end, steps + 1), end / steps
    exact = model.exact(
        t,
        {model.position: 1.1, model.velocity: -0.3},
        {parameter.name: 1.0 for parameter in model.parameters},
    )
    u, v = runs.position[0], runs.velocity[0]
    potential = 0.5 * u**2 if model.linear else 2 * np.sin(0.5 * u) ** 2
    d2t = (u[2:] - u[:-2]) / (2 * dt)
    energy, energy_d2t = 0.5 * v**2 + potential, 0.5 * d2t**2 + potential[1:-1]
    return {
        model.position: np.max(np.abs(u - exact[model.position])),
        model.velocity: np.max(np.abs(v - exact[model.velocity])),
        f"{model.velocity}_d2t": np.max(np.abs(d2t - exact[model.velocity][1:-1])),
        "energy": np.max(np.abs(energy - energy[0])),
        "energy_d2t": np.max(np.abs(energy_d2t - energy[0])),
    }


@pytest.mark.parametrize("model", [SPRING, MODELS["pendulum"]], ids=["spring", "pendulum"])
@pytest.mark.parametrize(("kind", "options"), thinned(OPTIONS, 3))
def test_every_quantity_has_its_order(kind, options, model):
    """Far enough down the ladder that second-order terms do not show, and above round-off."""
    scheme = SCHEMES[kind]
    chosen = {**scheme.defaults(), **options}
    is_fourth = scheme.formal_order(model.position, model, chosen) == 4
    # the largest error of all is that of rho_inf = 0
    level = 8 if is_fourth else 13 if options.get("rho_inf") == 0.0 else 12
    coarse, fine = (errors(kind, model, level + i, options) for i in (0, 1))
    for name, error in fine.items():
        order = scheme.formal_order(name, model, chosen)
        if math.isinf(order):
            assert error <= 2 ** (level + 1) * UNIT_ROUND_OFF, name
        else:
            assert np.log2(coarse[name] / error) == pytest.approx(order, abs=0.05), name


@pytest.mark.parametrize(("kind", "options"), OPTIONS)
def test_errors_expand_in_the_powers_that_the_scheme_says(kind, options):
    """At whole times, so that the errors of three levels may be compared: two terms of the expansion, then the next."""
    model, scheme = MODELS["pendulum"], SCHEMES[kind]
    chosen = {**scheme.defaults(), **options}
    p = scheme.formal_order(model.position, model, chosen)
    first = 6 if p == 4 else 9
    values = [run(kind, model, 2 ** (first + i), **options).position[0, -1] for i in range(4)]
    best = [b + (b - a) / (2**p - 1) for a, b in itertools.pairwise(values)]
    apart = np.diff(best)
    following = 2 if scheme.has_even_powers(model.position, model, chosen) else 1
    assert np.log2(abs(apart[0] / apart[1])) == pytest.approx(p + following, abs=0.25)


def test_the_trapezoidal_rule_under_four_names():
    model, steps = MODELS["pendulum"], 2**10
    reference = run("crank_nicolson", model, steps)
    for kind, options in (
        ("newmark", {}),
        ("hht", {"alpha": 0.0}),
        ("generalized_alpha", {"rho_inf": 1.0}),
    ):
        other = run(kind, model, steps, **options)
        for name in ("position", "velocity"):
            # a rounding in each of N steps, carried on by a motion that is stable
            np.testing.assert_allclose(
                getattr(other, name), getattr(reference, name), atol=steps * UNIT_ROUND_OFF
            )


def test_newmark_with_beta_0_is_velocity_verlet():
    model, steps = MODELS["pendulum"], 2**9
    runs = run("newmark", model, steps, beta=0.0)
    u, v, dt = 1.1, -0.3, 12.0 / steps
    for n in range(1, steps + 1):
        half = v - 0.5 * dt * math.sin(u)
        u += dt * half
        v = half - 0.5 * dt * math.sin(u)
        assert runs.position[0, n] == pytest.approx(u, abs=n * 2 * UNIT_ROUND_OFF)
        assert runs.velocity[0, n] == pytest.approx(v, abs=n * 2 * UNIT_ROUND_OFF)


@pytest.mark.parametrize("rho", [0.0, 0.3, 0.8, 1.0])
def test_rho_inf_is_what_is_left_of_the_highest_frequencies(rho):
    # the double root at infinity is reached like 1/p, by a factor of up to 100
    assert radius("generalized_alpha", 1e6, rho_inf=rho) == pytest.approx(rho, abs=1e-3)


@pytest.mark.parametrize(
    ("kind", "options", "limit"),
    [
        ("backward_euler", {}, 0.0),
        ("bdf2", {}, 0.0),
        ("crank_nicolson", {}, 1.0),
        ("gauss4", {}, 1.0),
        ("hht", {"alpha": -1 / 3}, 0.5),
        ("hht", {"alpha": 0.0}, 1.0),
    ],
)
def test_radius_at_infinity(kind, options, limit):
    assert radius(kind, 1e6, **options) == pytest.approx(limit, abs=1e-2)


@pytest.mark.parametrize("kind", IMPLICIT)
def test_no_step_is_too_large_for_a_linear_problem(kind):
    sizes = np.array([radius(kind, p) for p in np.logspace(-1, 2, 40)])
    # in (u, v dt) the eigenvectors are p apart in length, which costs digits of the eigenvalues
    assert (sizes <= 1.0 + 1e-10).all()
    if SCHEMES[kind].symmetric:
        np.testing.assert_allclose(sizes, 1.0, atol=1e-10)
    else:
        assert (sizes < 1.0).all()


@pytest.mark.parametrize(
    ("steps", "end", "printed"),
    [(400, 10.0, 1.222e-2), (200, 10.0, 4.758e-2), (800, 10.0, 3.077e-3)],
)
def test_energy_table_of_the_vibration_text(steps, end, printed):
    """Errata: what exact Crank-Nicolson gives, and that it is the artefact of ``[D_2t u]``."""
    w = 2 * math.pi
    runs = run("crank_nicolson", SPRING, steps, end=end, start=(1.0, 0.0), w=w)
    u, v, dt = runs.position[0], runs.velocity[0], end / steps
    scale = 0.5 * w**2
    d2t = 0.5 * ((u[2:] - u[:-2]) / (2 * dt)) ** 2 + scale * u[1:-1] ** 2
    assert f"{np.max(np.abs(d2t - scale)) / scale:.3e}" == f"{printed:.3e}"
    own = 0.5 * v**2 + scale * u**2
    assert np.max(np.abs(own - scale)) / scale <= steps * UNIT_ROUND_OFF


@pytest.mark.parametrize("kind", [kind for kind in IMPLICIT if SCHEMES[kind].symmetric])
def test_symmetric_schemes_run_backwards_to_where_they_came_from(kind):
    model, steps = MODELS["pendulum"], 2**8
    there = run(kind, model, steps)
    back = run(kind, model, steps, start=(there.position[0, -1], -there.velocity[0, -1]))
    allowed = 16 * steps * UNIT_ROUND_OFF
    assert back.position[0, -1] == pytest.approx(1.1, abs=allowed)
    assert back.velocity[0, -1] == pytest.approx(0.3, abs=allowed)


@pytest.mark.parametrize("kind", IMPLICIT)
def test_round_off_is_what_is_predicted(kind):
    """Against the same steps on the spring at 50 digits."""
    scheme, steps = SCHEMES[kind], 2**12
    stepper = scheme.stepper(scheme.defaults())
    found = run(kind, SPRING, steps).position[0, -1]
    with mpmath.workdps(50):
        dt = mpmath.mpf(12.0 / steps)
        functions = (lambda u, v, t, p: -u, lambda u, v, t, p: (mpmath.mpf(-1), mpmath.mpf(0)))
        step = handed(stepper.step, *functions)
        first = handed(stepper.start, *functions)(0, mpmath.mpf(1.1), mpmath.mpf(-0.3), dt, ())
        unit = mpmath.eye(len(first)).tolist()
        columns = [step(tuple(row), mpmath.mpf(0), dt, ())[0] for row in unit]
        power = (mpmath.matrix(columns).T) ** (steps - 1)
        exact = (power * mpmath.matrix(list(first)))[0]
        error = float(abs(exact - found))
    assert error <= 5 * scheme.round_off(scheme.defaults(), steps)


@pytest.mark.parametrize("kind", IMPLICIT)
def test_a_linear_force_takes_two_iterations(kind):
    scheme = SCHEMES[kind]
    stepper = scheme.stepper(scheme.defaults())
    calls = []

    def slopes(u, v, t, p):
        calls.append(u)
        return -1.0, -0.2

    def acceleration(u, v, t, p):
        return -u - 0.2 * v

    state = handed(stepper.start, acceleration, slopes)(0, 1.0, 0.5, 0.1, ())
    calls.clear()
    handed(stepper.step, acceleration, slopes)(state, 0.1, 0.1, ())
    assert len(calls) == 2 * scheme.evaluations


@pytest.mark.parametrize("kind", IMPLICIT)
@pytest.mark.parametrize("lane", ["plain", "scalar"])
def test_a_step_without_solution_ends_its_member_and_no_other(kind, lane):
    """``u'' = 1 + w u^2`` blows up: before it does, the equation of a step has no real solution."""
    model = dataclasses.replace(SPRING, acceleration="where(w > 2, 1 + w*u**2, -u)")
    parameters = np.array([[1.0], [30.0], [2.0]])
    runs = integrate(
        model,
        SCHEMES[kind],
        SCHEMES[kind].defaults(),
        parameters,
        np.array([[1.0, 0.0]] * 3),
        np.full(3, 0.1),
        64,
        1,
        lane=lane,
    )
    failed = runs.last_step[1]
    assert failed < 20
    assert np.isnan(runs.position[1, failed + 1 :]).all()
    assert list(runs.last_step[[0, 2]]) == [64, 64]
    assert np.isfinite(runs.position[[0, 2]]).all()


@pytest.mark.parametrize("kind", ["backward_euler", "crank_nicolson", "newmark", "bdf2"])
@pytest.mark.parametrize(
    "friction",
    [
        "3*tanh(1e4*v)",
        "where(v > 0, sqrt(v), -sqrt(-v))",
        "3*max(-1, min(1, 1e5*v))",
        "1e6*cos(u) - 1e6*cos(u) + v",
    ],
)
def test_steep_friction_is_solved_all_the_same(kind, friction):
    """Newton's method alone circles between both sides of a steep law, and has no slope at an infinite one."""
    model = dataclasses.replace(SPRING, acceleration=f"-u - ({friction})")
    steps, dt = 200, 0.05
    runs = run(kind, model, steps, end=steps * dt, start=(4.0, 0.0))
    assert runs.last_step[0] == steps
    u, v = runs.position[0], runs.velocity[0]
    assert np.max(np.abs(u)) <= 4.0
    force = [{"backward_euler": (1.0, 0.0)}.get(kind, (0.5, 0.5))]
    if kind != "bdf2":
        ((ahead, now),) = force
        # the position is a sum of velocities, whatever the friction
        drift = dt * (ahead * v[1:] + now * v[:-1])
        np.testing.assert_allclose(np.diff(u), drift, atol=8 * UNIT_ROUND_OFF * 4.0)


def test_a_jump_without_a_solution_is_no_solution():
    """A force that jumps over the value that the step needs has none, and must not pass for one."""
    model = dataclasses.replace(SPRING, acceleration="-u - 3*sign(v)")
    runs = run("backward_euler", model, 200, end=10.0, start=(2.0, 0.0))
    assert runs.last_step[0] < 200


def test_implicit_steps_stay_out_of_the_blocks():
    assert lane_for(2**10, 2**9, alone=True) == "scalar"
    assert lane_for(2**10, 2**9) == "blocks"
    assert lane_for(1, 2, alone=True) == "plain"


@pytest.mark.parametrize("lane", ["plain", "scalar"])
@pytest.mark.parametrize(
    ("kind", "options"),
    [
        *((kind, {}) for kind in ("backward_euler", "bdf2")),
        ("newmark", {"beta": 0.49, "gamma": 0.9}),
    ],
)
def test_a_decay_goes_on_to_zero(kind, options, lane):
    """Below the smallest normal number a part of a number may be rounded to 0, and with it an allowance."""
    runs = run(kind, SPRING, 12_000, end=12_000.0, start=(1.0, 0.0), lane=lane, **options)
    assert np.all(np.isfinite(runs.position))
    assert np.max(np.abs(runs.position[0, -100:])) < 2.0**-1000


def test_iterates_that_stay_on_one_side_of_the_solution_are_led_to_it():
    """Theta'' = -100 sin(theta) with w dt = 2.5: Newton's method circles where x is always below the force."""
    pendulum = MODELS["pendulum"]
    runs = integrate(
        pendulum,
        SCHEMES["generalized_alpha"],
        {"rho_inf": 0.0},
        np.array([[100.0, 1.0, 1.0, 0.0]]),
        np.array([[1.0, 0.3]]),
        np.array([0.25]),
        400,
        1,
    )
    assert runs.last_step[0] == 400
    assert np.isfinite(runs.position).all()
