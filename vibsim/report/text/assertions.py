"""What a check asserts, in words."""

from __future__ import annotations

from typing import Any

from vibsim.checks import accurate
from vibsim.checks.value_text import rule, what, what_of_all
from vibsim.checks.verdict_text import expectation, expected_verdict
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.experiment.value_names import CASES, IN_WORDS
from vibsim.report import words
from vibsim.report.data import Results
from vibsim.report.text.reasons import OUTCOMES
from vibsim.report.types import Check, Experiment, Measurement

PLACES = ("t", "step", "level", "scheme", "case")  # keys that locate a number
STABLE = {
    True: "stability: the amplitude grows by no more than an error that vanishes with dt",
    False: "instability: the amplitude grows by more than an error that vanishes with dt",
}
"""Words for a check for stability; Forward Euler, whose growth vanishes under refinement, is not unstable."""
DRIFTS = {
    "none": "is conserved up to round-off",
    "bounded": "has an error that stays bounded",
    "linear": "has an error that grows like t",
    "quadratic": "has an error that grows like t²",
}
"""Kind of drift to the words on the energy."""
SOLUTIONS = {"exact": "the exact solution", "discrete": "the exact solution of its own steps"}
"""Words for the solutions that may be compared with one, besides those of other schemes."""
OF_TOLERANCE = "Error of the extrapolated solution, in the unit of each state, at every stored time"


def about(check: Check | None, record: Results | None = None) -> str:
    """Return the subject of a check in one line: its claim or what it measures; without a check, the tolerance."""
    if check is None:
        return OF_TOLERANCE
    if check.kind == "claim":
        return f"“{check.claim}”"
    if check.kind == "converges":
        return f"Order of {words.title(check.converges)}{_where(check, record, norm=check.norm)}"
    if check.kind == "accurate":
        return f"Error of {words.title(check.accurate)} at the finest level{_where(check, record)}"
    return words.PAGE.opening(subject(check, record))


def wanted(
    experiment: Experiment, check: Measurement | None, promised: float | None = None, unit: str = ""
) -> str:
    """Say in a few words what a check expects; without a check, the tolerance.

    `promised` is the scheme's order, `unit` that of the number of a value check.
    """
    if check is not None and check.kind == "conserves":
        return DRIFTS[check.drift].removeprefix("is ").removeprefix("has ")
    if check is not None and check.kind == "value":
        return rule(check, words.PAGE, unit)
    if check is None or check.kind != "converges":
        return words.labelled(expectation(experiment, check, words.PAGE), None)
    order = words.number(promised, "step") if check.order == "scheme" else f"{check.order:g}"
    if check.expect.status != "PASS":
        outcome = OUTCOMES.get(check.expect.reason or "", expected_verdict(check.expect))
        return f"{outcome}, instead of order {order}"
    return f"order {order} ± {check.tolerance:g}{', promised' * (check.order == 'scheme')}"


def source(check: Check | None, record: Results | None = None) -> str:
    """Return the source of a claim and what measures it; empty for other kinds of checks."""
    if check is None or check.kind != "claim":
        return ""
    origin = f"{check.source}. " if check.source else ""
    return f"{origin}Measured by: {measured(check.that, record)}."


def measured(check: Measurement, record: Results | None = None) -> str:
    """Say what a check measures and expects."""
    match check.kind:
        case "converges":
            order = (
                "the order of its scheme" if check.order == "scheme" else f"order {check.order:g}"
            )
            schemes = [_listed(check.schemes)] if check.schemes else []
            only = "".join(f", {part}" for part in [*schemes, *swept_values(check, record)])
            statement = (
                f"converges with {order} ± {check.tolerance:g} ({words.NORMS[check.norm]}{only})"
            )
            is_trap = check.expect.status != "PASS"
            trap = f", expected to end as {expected_verdict(check.expect)}" if is_trap else ""
            return f"{words.title(check.converges)} {statement}{trap}"
        case "accurate":
            statement = f"{words.title(check.accurate)} is {accurate.rule(check, words.PAGE)} at the finest level"
            return f"{statement}{_where(check, record)}"
        case "value":
            bounds = {"equals": check.equals, "is below": check.below, "is above": check.above}
            conditions = [
                f" {verb} {words.PAGE.number(x, 15)}" for verb, x in bounds.items() if x is not None
            ]
            tolerance_keys = (("rtol", check.rtol), ("atol", check.atol))
            tolerances = [
                f"{key} {words.PAGE.number(x)}" for key, x in tolerance_keys if x is not None
            ]
            extra = f" ({', '.join(tolerances)})" if tolerances else ""
            return f"{subject(check, record)}{conditions[0] if conditions else ' '}{extra}"
        case "stable":
            return f"{STABLE[check.stable]}{_where(check, record)}"
        case "conserves":
            velocity = "the scheme's own velocity" if check.conserves == "energy" else "[D₂ₜu]"
            return f"the energy by {velocity} {DRIFTS[check.drift]}{_where(check, record)}"
        case "equal":
            partner = SOLUTIONS.get(check.second, check.second)
            within = "round-off" if check.atol is None else words.PAGE.number(check.atol)
            letter = words.title(check.quantity)
            return f"{letter} by {check.first} equals that of {partner} to {within}{_where(check, record)}"


def subject(check: Measurement, record: Results | None = None) -> str:
    """Say what a check measures, and where; of a number or a difference without its expected value."""
    if check.kind == "equal":
        return f"{words.title(check.quantity)} by {check.first}{_where(check, record)}"
    if check.kind != "value":
        return measured(check, record)
    statement, is_sampled = what(check, words.PAGE), check.number.is_sample
    keys = ("level", "scheme", "case") if is_sampled else PLACES
    places = ((key, getattr(check.at, key)) for key in keys)
    parts = [_place(record, key, value) for key, value in places if value is not None]
    where = words.swept(", ".join([*parts, *swept_values(check, record)]))
    if check.take is not None:
        over = "all members" if check.over == CASES else words.swept(str(check.over))
        statement = f"{IN_WORDS[check.take]} {what_of_all(check, words.PAGE)} over {over}"
    statement = f"{statement}{(f' ({where})' if is_sampled else f' at {where}') if where else ''}"
    return statement.replace("level best", "the limit of the levels")


def _where(check: Measurement, record: Results | None = None, norm: str = TYPICAL_NORM) -> str:
    """Write in brackets the norm, unless it is the typical one, and the schemes, level and members of a check."""
    names = getattr(check, "schemes", None)
    parts = [] if norm == TYPICAL_NORM else [words.NORMS[norm]]
    parts += [_listed(names)] if names else []
    places = ((key, getattr(check, key, None)) for key in ("level", "case"))
    parts += [_place(record, key, value) for key, value in places if value is not None]
    parts += swept_values(check, record)
    return f" ({words.swept(', '.join(parts))})" if parts else ""


def _place(record: Results | None, key: str, value: Any) -> str:
    """Name a place where a number is taken: a member by its swept values, if these are known."""
    case = record.case_position(value) if record is not None and key == "case" else None
    if record is None or case is None:
        return f"{key} {value}"
    return record.case_name(case)


def swept_values(check: Measurement, record: Results | None = None) -> list[str]:
    """Return the swept values that select the members of a check, as ``key = value`` with units that a record has."""
    units = {}
    if record is not None:
        units = dict(record.swept_label(name) for name in record.swept)
    return [
        f"{key} = {value if isinstance(value, str) else words.number(value, 'step')} {units.get(key, '')}".rstrip()
        for key, value in check.swept.items()
    ]


def _listed(names: tuple[str, ...]) -> str:
    return f"scheme{'s' if len(names) > 1 else ''} {', '.join(names)}"
