"""Schemes in operator notation: every equation holds of what the scheme computes, and those of the text are found."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import sympy
from scheme_variants import VARIANTS
from thinned import thinned

from vibsim import theory
from vibsim.schemes import SCHEMES
from vibsim.theory import operators, symbolic

P = symbolic.symbol("p")
W, DT, STEPS = 1.3, 0.5, 60
FIRST = 10
"""A step by which every start, and every root that is 0, is over."""
HALF, NOW, AHEAD = Fraction(1, 2), Fraction(0), Fraction(1)
WEIGHTS = {
    "D_t": {1: 1 / DT, -1: -1 / DT},
    "D_2t": {2: 0.5 / DT, -2: -0.5 / DT},
    "D_t+": {2: 1 / DT, 0: -1 / DT},
    "D_t-": {0: 1 / DT, -2: -1 / DT},
    "mean": {1: 0.5, -1: 0.5},
}
"""Factors of the values at so many half steps from here."""


def stepper(kind, **options):
    scheme = SCHEMES[kind]
    return scheme.stepper({**scheme.defaults(), **options})


def value(term, series, n):
    """Return the value of a term at the time n of the series that a scheme has computed."""

    def at(names, half_steps):
        if not names:
            assert half_steps % 2 == 0
            return series[term.of][half_steps // 2]
        weights = WEIGHTS[names[0]].items()
        return sum(factor * at(names[1:], half_steps + k) for k, factor in weights)

    w, dt = term.powers
    factor = float(sympy.sympify(term.factor).subs(P, sympy.Float(W * DT, 30)).evalf(30))
    return factor * W**w * DT**dt * at(term.operators, int(2 * (n + term.place)))


def holds(equation, series):
    """Say whether an equation holds at every time from `FIRST` at which its terms are known, to rounding."""
    for n in range(FIRST, STEPS - 2):
        left, right = ([value(term, series, n) for term in side] for side in equation)
        size = max(np.max(np.abs(series[name][: n + 2])) for name in "uv")
        if abs(sum(left) - sum(right)) > 1e-12 * size:
            return False
    return True


def written_out(equation):
    return [[(t.factor, t.powers, t.operators, t.of, t.place) for t in side] for side in equation]


@pytest.mark.parametrize(("scheme", "options"), thinned(VARIANTS, 5))
def test_every_equation_holds_of_the_exact_discrete_solution(scheme, options):
    method = scheme.stepper(options)
    u, v = theory.discrete(method, W, DT, 1.1, -0.4, np.arange(STEPS + 1))
    series = {"u": u, "v": v}
    factors = [float(f.subs(P, sympy.Float(W * DT, 30))) for f in operators.recurrence(method)]
    for n in range(FIRST, STEPS):
        terms = [f * u[n + 1 - k] for k, f in enumerate(factors)]
        assert abs(sum(terms)) <= 1e-14 * sum(map(abs, terms))
    found = [operators.without_velocity(method)]
    has_two_roots = len(factors) == 3
    if has_two_roots:
        found.append(operators.at_one_time(method))
        found += operators.with_velocity(method)
    else:
        with pytest.raises(ValueError, match="times, not 3"):
            operators.at_one_time(method)
        with pytest.raises(ValueError, match="more than position and velocity"):
            operators.with_velocity(method)
    for equation in found:
        assert holds(equation, series)
        (first, *rest), right = equation
        wrong = replace(first, factor=first.factor * (1 + 1e-9))
        assert not holds(([wrong, *rest], right), series)


@pytest.mark.parametrize(("scheme", "options"), thinned(VARIANTS, 4))
def test_the_weights_of_a_consistent_scheme_add_up_to_one(scheme, options):
    left, right = operators.without_velocity(scheme.stepper(options))
    assert sum(t.factor for t in left) == 1
    assert {t.operators[:2] for t in left} == {("D_t", "D_t")}
    sampled = sum(t.factor.subs(P, 0) for t in right if "D_t" not in t.operators)
    assert float(sampled) == pytest.approx(-1.0, abs=1e-15)


SECOND = (("D_t", "D_t"), "u", NOW)


@pytest.mark.parametrize(
    ("kind", "operator", "place"),
    [
        ("central", (), NOW),  # (9)
        ("forward_euler", (), -AHEAD),  # section 5.1
        ("backward_euler", (), AHEAD),  # section 5.2
        ("crank_nicolson", ("mean", "mean"), NOW),  # (37) and (42)
        ("euler_cromer", (), NOW),  # (56)
        ("euler_cromer_u_first", (), NOW),
    ],
)
def test_where_the_text_says_that_a_scheme_takes_the_position(kind, operator, place):
    assert written_out(operators.without_velocity(stepper(kind))) == [
        [(1, (0, 0), *SECOND)],
        [(-1, (2, 0), operator, "u", place)],
    ]


@pytest.mark.parametrize(
    ("kind", "of_u", "of_v"),
    [
        ("forward_euler", ("D_t+", (), NOW), ("D_t+", (), NOW)),  # (26)
        ("backward_euler", ("D_t-", (), AHEAD), ("D_t-", (), AHEAD)),  # (29)-(30), with w^2
        ("crank_nicolson", ("D_t", ("mean",), HALF), ("D_t", ("mean",), HALF)),  # (33)-(34)
        ("euler_cromer_u_first", ("D_t+", (), NOW), ("D_t-", (), AHEAD)),  # (49)-(50)
        ("euler_cromer", ("D_t-", (), AHEAD), ("D_t+", (), NOW)),  # (53)-(54)
    ],
)
def test_the_systems_of_the_text(kind, of_u, of_v):
    found = operators.with_velocity(stepper(kind))
    for equation, name, other, factor, powers, (operator, mean, place) in zip(
        found, "uv", "vu", (1, -1), ((0, 0), (2, 0)), (of_u, of_v), strict=True
    ):
        assert written_out(equation) == [
            [(1, (0, 0), (operator,), name, place)],
            [(factor, powers, mean, other, place)],
        ]


def test_forward_euler_drives_and_backward_euler_damps():
    for kind, sign in (("forward_euler", -1), ("backward_euler", 1)):
        (mass, drag, stiffness), right = operators.at_one_time(stepper(kind))
        assert (mass.factor, drag.factor, stiffness.factor) == (1 + P**2 / 2, sign, 1)
        assert (drag.operators, drag.powers, right) == (("D_2t",), (2, 1), [])
