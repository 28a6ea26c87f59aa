"""Table of the polynomial degree up to which every scheme is exact, and its residual on the next degree.

Source: vibration text, sections 2.2 and 8.5, problem 1 and exercise 9.
"""

from __future__ import annotations

import re

from vibsim import theory
from vibsim.formula import Binary, Expression, Name, Negate, literal, parse
from vibsim.report.choice import has_swept_options
from vibsim.report.tables.table import Cell, Column, Table
from vibsim.report.types import Experiment
from vibsim.theory import Miss, Residual
from vibsim.theory.degrees import HIGHEST_DEGREE, applies

LONGEST = 40  # most characters of a coefficient in the table
DIGITS = 6  # coefficients with longer integers are written as decimals
EXACT = "exact"
CAUSES = {
    "": "the first step alone",
    "differences": "its formulas for u' and u''",
    "force": "the force, taken at a point that is off the solution",
    "damping": "its treatment of damping",
}
"""`vibsim.theory.Miss.cause` to its words."""


def table(experiment: Experiment) -> Table | None:
    """Return one row per scheme, for the model of the experiment with a manufactured force for each polynomial.

    None unless the exact solution is a polynomial or a check is on `exact_degree`. Adaptive schemes and schemes with
    swept options have no row.
    """
    model = experiment.model.definition
    if not _is_about_polynomials(experiment) or not applies(model):
        return None
    columns = (
        Column("scheme"), Column("exact up to degree", form="integer"), Column("first miss at degree", form="integer"),
        Column("first step off by"), Column("a step at t off by"), Column("because of"),
    )  # fmt: skip
    rows: list[tuple[Cell, ...]] = []
    for spec in experiment.schemes:
        if spec.adaptive or has_swept_options(experiment, spec):
            continue
        stepper = spec.method.stepper_for(model, spec.options)
        degree = theory.exact_degree(stepper, model)
        if degree == HIGHEST_DEGREE:
            rows.append((spec.name, degree, None, EXACT, EXACT, "–"))
        else:
            miss = theory.miss(stepper, model, degree + 1)
            residuals = residual_text(miss.start), residual_text(miss.step)
            rows.append((spec.name, degree, miss.degree, *residuals, _cause(miss)))
    # the left side; each polynomial has its own force
    equation = model.equation.partition(" = ")[0]
    caption = (
        "Polynomials c₀ + c₁ t + c₂ t² + … that schemes reproduce exactly, as solutions of "
        f"{equation} with a force for each, while the velocity keeps its sign; and the first term of their "
        "error (computed less exact) on the next degree"
    )
    return Table("exact_degrees", caption, columns, tuple(rows)) if rows else None


def _cause(miss: Miss) -> str:
    """Say what causes a residual; the first step may be less accurate than the others for its own reason."""
    cause = CAUSES[miss.cause]
    is_start_worse = miss.start is not None and (
        miss.step is None or miss.start.power < miss.step.power
    )
    return f"the first step, and {cause}" if is_start_worse and miss.cause else cause


def residual_text(residual: Residual | None) -> str:
    """Write a residual as text: ``-c_3 dt^3``; a long coefficient is left out."""
    if residual is None:
        return EXACT
    power = f"dt^{residual.power}"
    text = coefficient(residual)
    factors = {"1": power, "-1": f"-{power}"}.get(text, f"{text} {power}")
    shown = factors if len(text) <= LONGEST else f"order {power}"
    return shown if residual.of == "position" else f"{residual.of}: {shown}"


def coefficient(residual: Residual) -> str:
    """Write a coefficient as text, with decimals if it has long numbers or roots."""
    from sympy import N

    text = str(residual.coefficient)
    if re.search(rf"\d{{{DIGITS + 1},}}|\*\*\(", text) is not None:
        text = str(N(residual.coefficient, DIGITS))
    return text.replace("**", "^").replace("*", " ")


def _is_about_polynomials(experiment: Experiment) -> bool:
    """Return whether the stated exact solution is a polynomial, or a check is on `exact_degree`."""
    if any(getattr(c.measured, "value", None) == "exact_degree" for c in experiment.checks):
        return True
    text, model = experiment.model.formulas.get("exact"), experiment.model.definition
    names = ("t", *(row.name for row in model.parameters))
    return text is not None and is_polynomial(parse(text, names))


def is_polynomial(node: Expression) -> bool:
    """Return whether a formula is a polynomial in ``t``."""
    match node:
        case Negate(operand):
            return is_polynomial(operand)
        case Binary("**", base, exponent):
            power = literal(exponent)
            is_whole = power is not None and power >= 0.0 and power.is_integer()
            return "t" not in node.names or (is_whole and is_polynomial(base))
        case Binary("/", left, right):
            return "t" not in right.names and is_polynomial(left)
        case Binary(_, left, right):
            return is_polynomial(left) and is_polynomial(right)
    return node == Name("t") or "t" not in node.names
