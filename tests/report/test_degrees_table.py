"""The table of the polynomials that schemes reproduce."""

import pytest
import sympy

from vibsim.experiment import Experiment
from vibsim.formula import parse
from vibsim.report.tables import degrees
from vibsim.report.tables.degrees import is_polynomial, residual_text, table
from vibsim.theory import Residual

TEXT = """
title: polynomials
model: {kind: oscillator, spring: k*u, damping: {quadratic: 0.3}, exact: %s, parameters: {k: 2.0, w: 1.0}}
time: {end: 2.0}
levels: [4, 5]
schemes: [central, %s]
"""


def experiment(tmp_path, exact="3*t**2 + t", scheme="rk4", more=""):
    path = tmp_path / "polynomials.yaml"
    path.write_text(TEXT % (exact, scheme) + more)
    return Experiment.from_yaml(path)


def test_a_row_says_what_is_missed_and_why(tmp_path):
    found = table(experiment(tmp_path))
    damping, force = (degrees.CAUSES[name] for name in ("damping", "force"))
    by_rk4 = ("-b c_1 c_2 k/24 dt^5", "-b c_2 k (c_1 + 2 c_2 t)/24 dt^5")
    assert found.rows == (
        ("central", 1, 2, "exact", "b c_2^2 dt^4", damping),
        ("rk4", 1, 2, *by_rk4, force),
    )


def test_a_start_that_is_wrong_beside_the_steps_is_named(tmp_path):
    root = table(experiment(tmp_path, scheme="central_quadratic_root")).rows[1]
    assert root[-1] == f"the first step, and {degrees.CAUSES['damping']}"


def test_only_experiments_about_polynomials_have_it(tmp_path):
    assert table(experiment(tmp_path, exact="cos(w*t)")) is None
    asks = "checks: [{value: exact_degree, at: {scheme: rk4}, equals: 1}]\n"
    assert table(experiment(tmp_path, exact="cos(w*t)", more=asks)) is not None


def test_schemes_that_vary_have_no_row(tmp_path):
    sweep = "sweep: {schemes.hht.alpha: [-0.1, 0.0]}\n"
    found = table(experiment(tmp_path, scheme="hht", more=sweep))
    assert [row[0] for row in found.rows] == ["central"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("t**3 - 2*t + w", True),
        ("(t + 1)**2/w", True),
        ("-t", True),
        ("sin(w)*t", True),
        ("sin(t)", False),
        ("1/t", False),
        ("t**w", False),
        ("t**0.5", False),
    ],
)
def test_polynomials_are_told_from_other_formulas(text, expected):
    assert is_polynomial(parse(text, ("t", "w"))) is expected


def test_long_coefficients_are_left_out_and_long_numbers_rounded():
    x = sympy.Symbol("x")
    assert residual_text(None) == "exact"
    assert residual_text(Residual("velocity", 3, -(x**0))) == "velocity: -dt^3"
    assert (
        residual_text(Residual("position", 4, sympy.Rational(10**9 + 1, 7) * x))
        == "1.42857e+8 x dt^4"
    )
    assert residual_text(Residual("position", 4, sum(sympy.symbols("x_:20")))) == "order dt^4"
