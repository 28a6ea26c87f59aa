"""What the equation differentiates must not jump: its derivative would leave out an impulse without a word.

A voltage that is switched on is the most common case: V' vanishes before and behind it, and the current would stay 0.
"""

from __future__ import annotations

from collections.abc import Mapping

from vibsim.experiment.faults import Report
from vibsim.experiment.rules.tables import MemberNumbers
from vibsim.formula import Expression, derivative, parse, put, size, values
from vibsim.formula.jumps import first_jump
from vibsim.models import FormulaField

MEMBERS = 64
"""Members of a sweep that are looked at, evenly spread: a jump is hardly ever there for single ones."""
WORK = 2**14
"""Operations of all these members together: of a long formula, fewer members are looked at."""
WORDS = {1: "derivative", 2: "second derivative"}
HINTS = {
    "voltage": "write a steep ramp, V0*(1 + tanh((t - t1)/0.001))/2 say, or begin behind the jump, "
    "with di_dt larger by it over L",
    "road": "round it off, or give it as a table, whose spacing does that",
}
OTHERS = "write a solution whose value and slope have no jumps"


def check_jumps(members: MemberNumbers, formulas: Mapping[str, str], report: Report) -> None:
    """Refuse formulas that jump, or whose slope does, where the equation has their derivatives."""
    for row in members.model.formulas:
        if row.derivatives and row.name in formulas:
            _check(row, formulas[row.name], members, report)


def _check(row: FormulaField, text: str, members: MemberNumbers, report: Report) -> None:
    (name,) = row.names
    known = [own.name for own in members.model.parameters]
    formula, along = parse(text, (name, *known)), parse(row.along, ("t", *known))
    for order in range(row.derivatives):
        at = _jump(put(formula, name, along), members, along)
        if at is not None:
            what = "jumps" if order == 0 else "its slope jumps"
            rule = (
                f"{what} near {name} = {at:.6g}, and the equation has its {WORDS[row.derivatives]}"
            )
            report.add(("model", row.name), rule, HINTS.get(row.name, OTHERS), text)
            return
        formula = derivative(formula, name)


def _jump(formula: Expression, members: MemberNumbers, along: Expression) -> float | None:
    """Return the place of a jump of some member; None where none is found."""
    most = max(1, min(MEMBERS, WORK // size(formula, WORK)))
    for parameters, end in members.some(most):
        numbers = {row.name: parameters[row.key] for row in members.model.parameters}
        at = first_jump(formula, numbers, end)
        if at is not None:
            # halving ends beside 0, not at it
            at = at if at > 1e-9 * end else 0.0
            return float(values(along, {**numbers, "t": at}))
    return None
