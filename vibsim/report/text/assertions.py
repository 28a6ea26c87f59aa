"""What a check asserts, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.checks.value import SAMPLED, what
from vibsim.report.text import words

if TYPE_CHECKING:
    from vibsim.experiment import Check, ConvergesCheck, ValueCheck
    from vibsim.experiment.schema.checks import ConservesCheck, EqualCheck, Measurement, StableCheck


PLACES = ("t", "step", "level", "scheme", "case")
"""Where a number may be taken."""


def heading(check: Check | Measurement) -> str:
    """Return the assertion of a check in one line."""
    if check.kind == "claim":
        return f"Claim: {check.claim}"
    return words.PAGE.opening(_measured(check))


def of_tolerance(bound: str) -> str:
    """Return in one line what an experiment with a tolerance asserts; `bound` is what its verdict expects."""
    return f"The error of the extrapolated solution is {bound}, in the unit of each state, at every stored time"


def row(check: Check) -> dict[str, str]:
    """Return the words of a check in the table of those that passed: what it is about, and what it asks for."""
    if check.kind == "claim":
        origin = f"Source: {check.source}" if check.source else ""
        asked = f"true: {heading(check.that)}"
        return {"subject": f"Claim: {check.claim}", "origin": origin, "asked": asked}
    found = {"subject": words.PAGE.opening(subject(check)), "origin": "", "asked": ""}
    if check.kind == "converges" and check.expect.status == "PASS":
        found["asked"] = (
            "as its scheme promises"
            if check.order == "scheme"
            else f"order {check.order:g} ± {check.tolerance:g}"
        )
    return found


def background(check: Check) -> str:
    """Return where a claim stands and what measures it; empty for the other kinds."""
    if check.kind != "claim":
        return ""
    source = f"Source: {check.source}. " if check.source else ""
    truth = "true" if check.holds else "false"
    return f"{source}Expected to be {truth}. Measured by: {_measured(check.that)}."


def _measured(check: Measurement) -> str:
    match check.kind:
        case "converges":
            return _converges(check)
        case "value":
            return _value(check)
        case "stable":
            return _stable(check)
        case "conserves":
            return _conserves(check)
        case "equal":
            return _equal(check)


def _converges(check: ConvergesCheck) -> str:
    order = "the order of its scheme" if check.order == "scheme" else f"order {check.order:g}"
    only = f", {_listed('scheme', check.schemes)}" if check.schemes else ""
    text = f"{words.title(check.converges)} converges with {order} ± {check.tolerance:g} ({check.norm} norm{only})"
    if check.expect.status == "PASS":
        return text
    why = f" ({check.expect.reason})" if check.expect.reason else ""
    return f"{text}, expected to end as {check.expect.status}{why}"


def subject(check: Measurement) -> str:
    """Return what is measured, and where, without what is expected of a number or of a difference."""
    if check.kind == "equal":
        return f"{words.title(check.quantity)} by {check.first}{_where(check)}"
    if check.kind != "value":
        return _measured(check)
    told = what(check, words.PAGE)
    keys = ("level", "scheme", "case") if check.value in SAMPLED else PLACES
    places = ((key, getattr(check.at, key)) for key in keys)
    where = ", ".join(f"{key} {value}" for key, value in places if value is not None)
    if check.value in SAMPLED:
        return f"{told}{f' ({where})' if where else ''}"
    return f"{told}{f' at {where}' if where else ''}"


def _value(check: ValueCheck) -> str:
    tolerances = [
        f"{key} {words.PAGE.number(value)}"
        for key, value in (("rtol", check.rtol), ("atol", check.atol))
        if value is not None
    ]
    bounds = {"equals": check.equals, "is below": check.below, "is above": check.above}
    rule = next(
        (
            f"{verb} {words.PAGE.digits(repr(value))}"
            for verb, value in bounds.items()
            if value is not None
        ),
        "",
    )
    extra = f" ({', '.join(tolerances)})" if tolerances else ""
    return f"{subject(check)} {rule}{extra}"


STABLE = {
    True: "stability: the amplitude grows by no more than an error that vanishes with dt",
    False: "instability: the amplitude grows by more than an error that vanishes with dt",
}
"""What is said of a check for stability: Forward Euler, whose growth refinement cures, is not unstable."""


def _stable(check: StableCheck) -> str:
    return f"{STABLE[check.stable]}{_where(check)}"


DRIFTS = {
    "none": "is conserved up to round-off",
    "bounded": "has an error that stays bounded",
    "linear": "has an error that grows like t",
    "quadratic": "has an error that grows like t²",
}
"""What is said of the energy for every kind of drift."""


def _conserves(check: ConservesCheck) -> str:
    velocity = "the scheme's own velocity" if check.conserves == "energy" else "[D₂ₜu]"
    return f"the energy by {velocity} {DRIFTS[check.drift]}{_where(check)}"


def _equal(check: EqualCheck) -> str:
    known = {"exact": "the exact solution", "discrete": "the exact solution of its own steps"}
    other = known.get(check.second, check.second)
    within = "round-off" if check.atol is None else words.PAGE.number(check.atol)
    letter = words.title(check.quantity)
    return f"{letter} by {check.first} equals that of {other} to {within}{_where(check)}"


def _where(check: StableCheck | ConservesCheck | EqualCheck) -> str:
    """Say in brackets which schemes, which level and which member a check is about."""
    names = getattr(check, "schemes", None)
    parts = [_listed("scheme", names)] if names else []
    parts += [
        f"{key} {value}" for key in ("level", "case") if (value := getattr(check, key)) is not None
    ]
    return f" ({', '.join(parts)})" if parts else ""


def _listed(word: str, names: tuple[str, ...]) -> str:
    return f"{word}{'s' if len(names) > 1 else ''} {', '.join(names)}"
