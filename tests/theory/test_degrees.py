"""Polynomials that schemes reproduce exactly: hand-written recurrences in fractions, the engine, and the texts."""

from fractions import Fraction
from functools import cache

import numpy as np
import pytest
import sympy
from scheme_variants import VARIANTS
from thinned import thinned

from vibsim.engine import integrate
from vibsim.models import MODELS
from vibsim.models.oscillator import written
from vibsim.schemes import FIXED_STEP, SCHEMES
from vibsim.schemes.base import handed
from vibsim.theory import degrees
from vibsim.theory.degrees import HIGHEST_DEGREE, exact_degree, fitted_force, miss, reproduces

FORMULAS = {
    "none": {"spring": "k*u"},
    "linear": {"spring": "k*u", "damping": "b*v"},
    "quadratic": {"spring": "k*u", "damping": "b*abs(v)*v"},
    "cubic spring": {"spring": "k*u + k*u**3"},
}
M, K, B = Fraction(3, 2), Fraction(5, 4), Fraction(2, 5)
C = (Fraction(6, 5), Fraction(3, 4), Fraction(2, 7), Fraction(3, 8), Fraction(1, 3))
"""Coefficients of a solution that does not turn for t > 0."""
DT, N = Fraction(1, 8), 3
"""Few steps: where a polynomial is missed on a nonlinear force, the digits multiply in each."""


@cache
def model(name):
    return written(FORMULAS[name], ("k", "b"))


def stepper(kind, of, **options):
    scheme = SCHEMES[kind]
    return scheme.stepper_for(of, {**scheme.defaults(), **options})


@cache
def polynomial(degree, derivative=0):
    x = sympy.Symbol("x")
    formula = sum(sympy.Rational(c) * x**k for k, c in enumerate(C[: degree + 1]))
    coefficients = sympy.Poly(sympy.diff(formula, x, derivative), x).all_coeffs()
    numbers = [Fraction(int(c.p), int(c.q)) for c in coefficients]

    def value(t):
        total = 0
        for c in numbers:
            total = total * t + c
        return total

    return value


def force(name, degree):
    """Return a(u, v, t) with the force that makes the polynomial the solution."""
    u_e, v_e, a_e = (polynomial(degree, k) for k in range(3))

    def own(u, v):
        damping = {"linear": B * v, "quadratic": B * abs(v) * v}.get(name, 0)
        return -(damping + K * u + (K * u**3 if name == "cubic spring" else 0)) / M

    return lambda u, v, t: own(u, v) + a_e(t) - own(u_e(t), v_e(t))


def central(name, degree):
    """B (7)-(8), (63)-(65), (70)-(72): F^n follows from the solution."""
    u_e, v_e, a_e = (polynomial(degree, k) for k in range(3))
    a = force(name, degree)
    u = [u_e(0), u_e(0) + DT * v_e(0) + DT * DT / 2 * a(u_e(0), v_e(0), 0)]
    for n in range(1, N):
        t, here, behind = n * DT, u[n], u[n - 1]
        damping = {"linear": B * v_e(t), "quadratic": B * abs(v_e(t)) * v_e(t)}.get(name, 0)
        spring = [K * x + (K * x**3 if name == "cubic spring" else 0) for x in (here, u_e(t))]
        rest = M * a_e(t) + damping + spring[1] - spring[0]
        if name == "linear":
            above = 2 * M * here + (B * DT / 2 - M) * behind + DT**2 * rest
            u.append(above / (M + B * DT / 2))
        elif name == "quadratic":
            d = here - behind
            u.append(
                (2 * M * here - M * behind + B * here * abs(d) + DT**2 * rest) / (M + B * abs(d))
            )
        else:
            u.append(2 * here - behind + DT**2 * rest / M)
    return u


def rk4(name, degree):
    a, u, v = force(name, degree), polynomial(degree)(0), polynomial(degree, 1)(0)
    found = [u]
    for n in range(N):
        t = n * DT
        k1, l1 = v, a(u, v, t)
        k2, l2 = v + DT / 2 * l1, a(u + DT / 2 * k1, v + DT / 2 * l1, t + DT / 2)
        k3, l3 = v + DT / 2 * l2, a(u + DT / 2 * k2, v + DT / 2 * l2, t + DT / 2)
        k4, l4 = v + DT * l3, a(u + DT * k3, v + DT * l3, t + DT)
        u, v = u + DT / 6 * (k1 + 2 * k2 + 2 * k3 + k4), v + DT / 6 * (l1 + 2 * l2 + 2 * l3 + l4)
        found.append(u)
    return found


def euler_cromer(name, degree):
    a, u, v = force(name, degree), polynomial(degree)(0), polynomial(degree, 1)(0)
    found = [u]
    for n in range(N):
        v = v + DT * a(u, v, n * DT)
        u = u + DT * v
        found.append(u)
    return found


def crank_nicolson(name, degree):
    """The trapezoidal rule of a linear force, whose two equations are solved by hand."""
    a, u, v = force(name, degree), polynomial(degree)(0), polynomial(degree, 1)(0)
    found, h = [u], DT / 2
    rate = B / M if name == "linear" else 0
    for n in range(N):
        # v' = v + h (a + g - k/m u' - c v'), u' = u + h (v + v'), with g the acceleration at rest in 0
        g = a(0, 0, (n + 1) * DT)
        reach = v + h * (a(u, v, n * DT) + g - K / M * (u + h * v))
        v, u = (new := reach / (1 + h * h * K / M + h * rate)), u + h * (v + new)
        found.append(u)
    return found


BY_HAND = {
    ("central", name): (central, degree)
    for name, degree in {"none": 2, "linear": 2, "quadratic": 1, "cubic spring": 2}.items()
}
BY_HAND |= {("rk4", name): (rk4, 1) for name in FORMULAS}
BY_HAND |= {("euler_cromer", name): (euler_cromer, 1) for name in FORMULAS}
BY_HAND |= {("crank_nicolson", name): (crank_nicolson, 2) for name in ("none", "linear")}


@pytest.mark.parametrize(("kind", "name"), BY_HAND)
def test_the_degree_is_that_of_recurrences_in_fractions(kind, name):
    recurrence, highest = BY_HAND[kind, name]
    for degree in range(highest + 2):
        u_e = polynomial(degree)
        errors = [u - u_e(n * DT) for n, u in enumerate(recurrence(name, degree))]
        assert any(errors) == (degree > highest)
    arithmetics = ("compensated", "increment", "three_term") if kind == "central" else (None,)
    for arithmetic in arithmetics:
        options = {"arithmetic": arithmetic} if arithmetic else {}
        assert exact_degree(stepper(kind, model(name), **options), model(name)) == highest


def marks(which):
    """Leave options, and the scheme whose symbols take longest, to the slow tests."""
    return () if which in FIXED_STEP and which != "gauss4" else (pytest.mark.slow,)


def cases(*, corrected):
    """List schemes and models; `corrected`: also the correction of the frequency, on the spring that it is made for."""
    found = [
        pytest.param(*variant.values, name, id=f"{variant.id}-{name}", marks=marks(variant.id))
        for variant in VARIANTS
        for name in FORMULAS
        if variant.values[0].treats(model(name))
        if not variant.values[1].get("frequency_correction") or (corrected and name == "none")
    ]
    return thinned(found, 3)


def written_out(name, degree):
    """Return the model with the polynomial as its exact solution, and values of its parameters."""
    exact = " + ".join(f"{float(c)!r}*t**{k}" for k, c in enumerate(C[: degree + 1]))
    of = written({**FORMULAS[name], "exact": exact}, ("k", "b"))
    values = {"m": float(M), "parameters.k": float(K), "parameters.b": float(B)}
    return of, values


def run(scheme, options, name, degree, n, end):
    of, values = written_out(name, degree)
    start = [float(polynomial(degree, k)(0)) for k in range(2)]
    found = integrate(
        of,
        scheme,
        options,
        np.array([[values[row.key] for row in of.parameters]]),
        np.array([start]),
        np.array([end / n]),
        n,
        1,
        lane="plain",
        with_gathered=False,
    ).position[0]
    u_e = np.array(
        [float(polynomial(degree)(Fraction(i) * Fraction(end) / n)) for i in range(n + 1)]
    )
    return np.abs(found - u_e), np.max(np.abs(u_e))


@pytest.mark.parametrize(("scheme", "options", "name"), thinned(cases(corrected=True), 2))
def test_the_engine_reproduces_that_degree_and_no_higher(scheme, options, name):
    highest = exact_degree(scheme.stepper_for(model(name), options), model(name))
    # lines, but for the correction, which changes the initial velocity
    assert highest >= (0 if options.get("frequency_correction") else 1)
    n, end = 32, 2
    # with any coefficients: a lower degree is this one with some of them 0
    for degree in (highest, highest + 1):
        error, size = run(scheme, options, name, degree, n, end)
        # a rounding of size eps |u| in every step, carried on as a velocity for the rest of the run, and as much from
        # the force, whose terms are at most 16 |u|^3
        limit = n * n * 2.0**-52 * (size + (2.0 / n) ** 2 * 16.0 * size**3)
        assert (np.max(error) <= limit) == (degree <= highest), (degree, np.max(error), limit)


ROUNDING = 16 * 2.0**-52
"""Of a step on numbers up to 2, velocities over dt apart, which are missed by more in the first power."""


def first_error(scheme, options, name, degree, dt):
    """Return what the scheme's own functions are off by after the first step, in floats: position and velocity."""
    of = model(name)
    own = scheme.stepper_for(of, options)
    u_e, v_e, a_e = (polynomial(degree, k) for k in range(3))
    m, k, b = float(M), float(K), float(B)

    def at(u, v, t):
        damping = {"linear": b * v, "quadratic": b * abs(v) * v}.get(name, 0.0)
        return -(damping + k * u + (k * u**3 if name == "cubic spring" else 0.0)) / m

    def acceleration(u, v, t, p):
        exact = at(float(u_e(Fraction(t))), float(v_e(Fraction(t))), t)
        return at(u, v, t) + float(a_e(Fraction(t))) - exact

    def slopes(u, v, t, p):
        by_v = {"linear": b, "quadratic": 2 * b * abs(v)}.get(name, 0.0)
        return -(k + (3 * k * u * u if name == "cubic spring" else 0.0)) / m, -by_v / m

    start = handed(own.start, acceleration, slopes, lambda u, v, t, p: b / m)
    state = start(own.variant, float(u_e(0)), float(v_e(0)), dt, ())
    exact = own.carried(*(lambda t, f=f: float(f(Fraction(t))) for f in (u_e, v_e, a_e)), dt, dt)
    return [x - y for x, y in zip(state, exact, strict=True)]


@pytest.mark.parametrize(("scheme", "options", "name"), thinned(cases(corrected=False), 3))
def test_residuals_of_the_first_step_are_those_in_floats(scheme, options, name):
    of = model(name)
    own = scheme.stepper_for(of, options)
    found = miss(own, of, exact_degree(own, of) + 1)
    if found.start is None:
        assert found.step is not None
        return
    symbols = {"m": M, "k": K, "b": B, "t": 0} | {f"c_{i}": c for i, c in enumerate(C)}
    dt = 2.0**-5
    coefficient = float(
        found.start.coefficient.subs({k: sympy.Rational(v) for k, v in symbols.items()})
    )
    index = ("position", "velocity").index(found.start.of)
    error = first_error(scheme, options, name, found.degree, dt)
    assert np.max(np.abs(error[:index]), initial=0.0) <= ROUNDING
    # the next term of the series is smaller by dt times numbers of order 1
    expected = coefficient * dt**found.start.power
    assert error[index] == pytest.approx(expected, rel=16 * dt, abs=ROUNDING)


def test_what_the_text_and_its_errata_say_of_the_centred_scheme():
    c, b, m = sympy.symbols("c_2 b m")
    cubic = miss(stepper("central", model("none")), model("none"), 3)
    assert (cubic.start.of, cubic.start.power, cubic.start.coefficient) == (
        "position",
        3,
        -sympy.Symbol("c_3"),
    )
    assert cubic.step is None
    assert cubic.cause == ""
    geometric = miss(stepper("central", model("quadratic")), model("quadratic"), 2)
    assert geometric.start is None
    assert (geometric.step.power, geometric.cause) == (4, "damping")
    assert sympy.simplify(geometric.step.coefficient - b * c**2 / m) == 0


def test_what_keeps_other_schemes_from_degree_two():
    causes = {"forward_euler": "differences", "rk4": "force", "euler_cromer": "", "ab2": ""}
    for kind, cause in causes.items():
        found = miss(stepper(kind, model("none")), model("none"), 2)
        assert found.cause == cause
        assert found.start is not None


# the setting of the numbers in the errata
I_, V_, MASS, DAMPING, SPRING, Q, END = 1.2, 3.0, 2.0, 0.9, 4.0, 2.0, 2.0


def fitted_run(n, added, *, at_start=False):
    """Return the largest error of the centred scheme with the geometric mean, with `added(dt)` to the acceleration."""
    of = written({"spring": "k*u", "damping": "b*abs(v)*v"}, ("k", "b"))
    own, dt = stepper("central", of, arithmetic="increment"), END / n

    def exact(t):
        return I_ + V_ * t + Q * t * t

    def acceleration(u, v, t, p):
        speed = V_ + 2 * Q * t
        outer = 2 * MASS * Q + DAMPING * abs(speed) * speed + SPRING * exact(t)
        total = (outer - DAMPING * abs(v) * v - SPRING * u) / MASS
        return total + (added(dt) if t > 0 or at_start else 0.0)

    functions = (acceleration, lambda *_: None, lambda u, v, t, p: DAMPING / MASS)
    state = handed(own.start, *functions)(own.variant, I_, V_, dt, ())
    errors = [abs(state[0] - exact(dt))]
    step = handed(own.step, *functions)
    for i in range(1, n):
        state, _ = step(state, i * dt, dt, ())
        errors.append(abs(state[0] - exact((i + 1) * dt)))
    return max(errors)


def test_a_fitted_force_reproduces_the_quadratic_with_quadratic_damping():
    of = model("quadratic")
    fitted = fitted_force(stepper("central", of), of, 2)
    b, c_2, dt, m = sympy.symbols("b c_2 dt m")
    assert sympy.simplify(fitted + b * c_2**2 * dt**2 / m) == 0
    added = sympy.lambdify(dt, fitted.subs({b: DAMPING, c_2: Q, m: MASS}))
    unfitted = [fitted_run(n, lambda dt: 0.0) for n in (20, 40, 80)]
    # printed in the errata with these digits
    np.testing.assert_allclose(unfitted, [4.2e-3, 1.07e-3, 2.7e-4], rtol=5e-3)
    for n in (20, 40, 80):
        # the solution grows to 15.2, and roundings are carried on for the rest of the run
        assert fitted_run(n, added) <= n * 2.0**-52 * 15.2
        # F^0 must stay, as (72) is exact already
        assert fitted_run(n, added, at_start=True) > 1e-6


def test_no_fitted_force_makes_a_wrong_start_right():
    for kind, degree in (("central", 3), ("rk4", 2)):
        with pytest.raises(
            ValueError, match=f"no force at the inner points makes degree {degree} exact"
        ):
            fitted_force(stepper(kind, model("none")), model("none"), degree)


@pytest.mark.slow
def test_nothing_is_missed_without_forces_but_by_the_differences():
    of = written({"spring": "0*u"}, ())
    assert exact_degree(stepper("rk4", of), of) == 4
    assert exact_degree(stepper("gauss4", of), of) == 4
    assert exact_degree(stepper("rkn4", of), of) == 4
    assert HIGHEST_DEGREE > 4


def test_names_of_a_model_are_not_taken_for_coefficients():
    of = written({"spring": "c_3*u", "damping": "c_1*v"}, ("c_1", "c_3"))
    found = miss(stepper("central", of), of, 3)
    assert found.start.coefficient == -sympy.Symbol("cc_3")
    assert found.step.coefficient == sympy.sympify("-c_1*cc_3/m")


def test_forces_of_time_alone_do_not_matter():
    of = written({"spring": "k*u", "force": "sin(3*t)/(1 + t**2)"}, ("k",))
    assert exact_degree(stepper("central", of), of) == 2
    assert degrees.applies(of)


@pytest.mark.parametrize("kind", ["pendulum", "sliding_box", "bouncing_ball", "elastic_pendulum"])
def test_models_without_exact_numbers_are_refused(kind):
    of = MODELS[kind]
    assert not degrees.applies(of)
    with pytest.raises(ValueError, match=f"the acceleration of {kind}"):
        reproduces(stepper("rk4", of), of, 1)
