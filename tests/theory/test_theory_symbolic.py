"""Formulas in p: against the numbers of every scheme, and against those of the vibration text."""

import numpy as np
import pytest
import sympy
from scheme_variants import VARIANTS
from thinned import thinned

from vibsim import theory
from vibsim.schemes import FIXED_STEP, SCHEMES
from vibsim.theory import operators, symbolic

P, N = (symbolic.symbol(name) for name in ("p", "n"))
BEGIN, PUSH, W, TIME = (symbolic.symbol(name) for name in ("I", "V", "w", "t"))


def stepper(kind, **options):
    scheme = SCHEMES[kind]
    return scheme.stepper({**scheme.defaults(), **options})


@pytest.mark.parametrize("scheme", thinned(FIXED_STEP.values(), 3), ids=FIXED_STEP)
def test_formulas_and_numbers_are_one_theory(scheme):
    method = scheme.stepper(scheme.defaults())
    at = sympy.Rational(3, 8)
    numbers = theory.amplification(method, float(at))
    for formula, matrix in (
        (symbolic.matrix(method), numbers.matrix),
        (symbolic.start(method), numbers.start),
    ):
        values = np.array(formula.subs(P, at).evalf(30).tolist(), dtype=float)
        np.testing.assert_allclose(values, matrix.rounded, rtol=1e-15, atol=1e-30)
    first, *others = (factor.subs(P, at) for factor in operators.recurrence(method))
    # roots that are 0 are left out
    wanted = np.poly(numbers.matrix.rounded)
    found = np.zeros(len(wanted))
    found[: len(others) + 1] = [1.0, *(float((factor / first).evalf(30)) for factor in others)]
    np.testing.assert_allclose(found, wanted, atol=1e-13)


@pytest.mark.parametrize("scheme", thinned(FIXED_STEP.values(), 3), ids=FIXED_STEP)
def test_series_are_those_of_the_numbers(scheme):
    method = scheme.stepper(scheme.defaults())
    p = 0.02
    grown = symbolic.growth_series(method, 7).subs(P, sympy.Rational(1, 50)).evalf(40) - 1
    assert float(sympy.log(1 + grown)) == pytest.approx(
        float(theory.roots(method, p).log_growth), rel=1e-6, abs=1e-30
    )
    faster = symbolic.frequency_series(method, 7).subs(P, sympy.Rational(1, 50)).evalf(40) - 1
    assert float(faster) == pytest.approx(float(theory.roots(method, p).angle) / p - 1, abs=3e-16)
    early = symbolic.phase_error_series(method, 7).subs(P, sympy.Rational(1, 50)).evalf(40)
    assert float(early) == pytest.approx(float(theory.phase_error_per_period(method, p)), abs=3e-16)


@pytest.mark.parametrize("scheme", FIXED_STEP.values(), ids=FIXED_STEP)
def test_the_series_begin_with_the_declared_order(scheme):
    """Of the position; a start of lower order is no matter of the roots (Euler-Cromer: 2 against 1)."""
    method = scheme.stepper(scheme.defaults())
    frequency = symbolic.frequency_series(method) - 1
    growth = symbolic.growth_series(method) - 1
    tiny = 1e-12  # coefficients that were published as decimals

    def lowest(series):
        terms = sympy.Poly(series, P).terms() if series != 0 else []
        return min((power for (power,), value in terms if abs(value) > tiny), default=np.inf)

    promised = scheme.orders(scheme.defaults()).position
    order = min(lowest(frequency), lowest(growth) - 1)
    assert order == (2 if scheme.kind.startswith("euler_cromer") else promised)


def test_the_series_of_the_text():
    # (19), section 5.6 and the errata of 6.2
    assert symbolic.frequency_series(stepper("central"), 2) == 1 + P**2 / 24
    assert symbolic.frequency_series(stepper("forward_euler"), 2) == 1 - P**2 / 3
    assert symbolic.growth_series(stepper("forward_euler"), 2) == 1 + P**2 / 2
    assert symbolic.growth_series(stepper("rk2"), 3) == 1 + P**4 / 8
    assert symbolic.growth_series(stepper("rk4"), 4) == 1 - P**6 / 144
    assert symbolic.frequency_series(stepper("crank_nicolson"), 2) == 1 - P**2 / 12
    assert symbolic.growth_series(stepper("gauss4"), 6) == 1
    # exercise 3
    corrected = symbolic.frequency_series(stepper("central", frequency_correction=True), 3)
    assert corrected.coeff(P, 2) == 0
    assert corrected.coeff(P, 4) != 0


@pytest.mark.parametrize(("scheme", "options"), thinned(VARIANTS, 4))
def test_the_error_at_a_time_is_that_of_the_exact_discrete_solution(scheme, options):
    """What is left falls with the power that is told."""
    method, w, t = scheme.stepper(options), 1.3, 1.7
    error, following = symbolic.error_series(method)
    left = []
    for n in (48, 96):
        u, _ = theory.discrete(method, w, t / n, 1.0, 0.0, n)
        told = error.subs({P: sympy.Rational(t) * sympy.Rational(w) / n, W: w, TIME: t}).evalf(30)
        left.append(abs(float(sympy.cos(w * t) - float(u) - told)))
    power = sympy.degree(following, P)
    assert power >= 3
    assert left[1] <= left[0] * 2.0 ** (0.3 - power) + 4e-16


def test_the_errors_of_the_text():
    """Section 4.4, with the term that the erratum to it adds, and 5.6: growth and frequency of Forward Euler."""
    angle = W * TIME
    fourth = angle**2 * sympy.cos(angle) / 1152 + 3 * angle * sympy.sin(angle) / 640
    error, following = symbolic.error_series(stepper("central"))
    assert sympy.expand(error - P**2 * angle * sympy.sin(angle) / 24 - P**4 * fourth) == 0
    assert following == P**6
    error, _ = symbolic.error_series(stepper("forward_euler"))
    assert error.coeff(P, 1) == -angle * sympy.cos(angle) / 2


def test_the_characteristic_polynomial_of_the_text():
    """Section 4.1: A^2 - (2 - p^2) A + 1 = 0."""
    found = operators.recurrence(stepper("central", arithmetic="three_term"))
    assert [sympy.expand(factor) for factor in found] == [1, -2 + P**2, 1]


@pytest.mark.parametrize(("kind", "sign"), [("euler_cromer", 1), ("euler_cromer_u_first", -1)])
def test_the_solution_of_euler_cromer(kind, sign):
    """Exercise 17: I cos((n +- 1/2) th)/cos(th/2), p = 2 sin(th/2)."""
    theta = sympy.Symbol("theta", positive=True)
    wanted = BEGIN * sympy.cos((N + sign * sympy.Rational(1, 2)) * theta) / sympy.cos(theta / 2)
    solution = symbolic.solution(stepper(kind)).subs(PUSH, 0)
    # acos(1 - p^2/2) = theta for theta from 0 to pi
    found = solution.subs(sympy.acos(1 - P**2 / 2), theta).subs(
        sympy.sqrt(1 - (1 - P**2 / 2) ** 2), sympy.sin(theta)
    )
    found = found.subs(P, 2 * sympy.sin(theta / 2))
    assert sympy.simplify(sympy.expand_trig(found - wanted)) == 0


def test_the_solutions_of_the_text():
    angle = sympy.acos(1 - P**2 / 2)
    found = symbolic.solution(stepper("central")).subs(PUSH, 0)
    assert sympy.simplify(found - BEGIN * sympy.cos(N * angle)) == 0
    with pytest.raises(ValueError, match="parasitic"):
        symbolic.solution(stepper("ab2"))


@pytest.mark.parametrize("kind", ["central", "crank_nicolson", "rk4", "velocity_verlet", "newmark"])
def test_a_solution_is_the_exact_discrete_one(kind):
    method = stepper(kind)
    formula = sympy.lambdify((N, P, BEGIN, PUSH, W), symbolic.solution(method))
    n = np.arange(200)
    u, _ = theory.discrete(method, 2.0, 0.25, 1.1, -0.6, n)
    np.testing.assert_allclose(formula(n, 0.5, 1.1, -0.6, 2.0), u, atol=1e-12)
