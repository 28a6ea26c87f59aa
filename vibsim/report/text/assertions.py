"""What a check asserts, in words."""

from __future__ import annotations

from vibsim.checks.accurate import rule
from vibsim.checks.value import SAMPLED, what
from vibsim.report.text import words
from vibsim.report.types import Check, Measurement

PLACES = ("t", "step", "level", "scheme", "case")  # where a number may be taken
STABLE = {
    True: "stability: the amplitude grows by no more than an error that vanishes with dt",
    False: "instability: the amplitude grows by more than an error that vanishes with dt",
}
"""What is said of a check for stability: Forward Euler, whose growth refinement cures, is not unstable."""
DRIFTS = {
    "none": "is conserved up to round-off",
    "bounded": "has an error that stays bounded",
    "linear": "has an error that grows like t",
    "quadratic": "has an error that grows like t²",
}
"""What is said of the energy for every kind of drift."""
SOLUTIONS = {"exact": "the exact solution", "discrete": "the exact solution of its own steps"}
"""What a solution may be compared with, beside that of another scheme."""


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
    asked = ""
    if check.kind == "converges" and check.expect.status == "PASS":
        order = f"order {check.order:g} ± {check.tolerance:g}" if check.order != "scheme" else ""
        asked = order or "as its scheme promises"
    return {"subject": words.PAGE.opening(subject(check)), "origin": "", "asked": asked}


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
            order = (
                "the order of its scheme" if check.order == "scheme" else f"order {check.order:g}"
            )
            only = f", {_listed(check.schemes)}" if check.schemes else ""
            why = f" ({check.expect.reason})" if check.expect.reason else ""
            trap = f", expected to end as {check.expect.status}{why}"
            return (
                f"{words.title(check.converges)} converges with {order} ± {check.tolerance:g} ({check.norm} norm{only})"
                f"{'' if check.expect.status == 'PASS' else trap}"
            )
        case "accurate":
            only = f" ({_listed(check.schemes)})" if check.schemes else ""
            return f"{words.title(check.accurate)} is {rule(check, words.PAGE)} at the finest level{only}"
        case "value":
            bounds = (
                ("equals", check.equals),
                ("is below", check.below),
                ("is above", check.above),
            )
            given = [f" {verb} {words.PAGE.digits(repr(x))}" for verb, x in bounds if x is not None]
            near = (("rtol", check.rtol), ("atol", check.atol))
            tolerances = [f"{key} {words.PAGE.number(x)}" for key, x in near if x is not None]
            extra = f" ({', '.join(tolerances)})" if tolerances else ""
            return f"{subject(check)}{given[0] if given else ' '}{extra}"
        case "stable":
            return f"{STABLE[check.stable]}{_where(check)}"
        case "conserves":
            own = "the scheme's own velocity" if check.conserves == "energy" else "[D₂ₜu]"
            return f"the energy by {own} {DRIFTS[check.drift]}{_where(check)}"
        case "equal":
            other = SOLUTIONS.get(check.second, check.second)
            within = "round-off" if check.atol is None else words.PAGE.number(check.atol)
            letter = words.title(check.quantity)
            return f"{letter} by {check.first} equals that of {other} to {within}{_where(check)}"


def subject(check: Measurement) -> str:
    """Return what is measured, and where, without what is expected of a number or of a difference."""
    if check.kind == "equal":
        return f"{words.title(check.quantity)} by {check.first}{_where(check)}"
    if check.kind != "value":
        return _measured(check)
    told, is_sampled = what(check, words.PAGE), check.value in SAMPLED
    keys = ("level", "scheme", "case") if is_sampled else PLACES
    places = ((key, getattr(check.at, key)) for key in keys)
    where = ", ".join(f"{key} {value}" for key, value in places if value is not None)
    return f"{told}{(f' ({where})' if is_sampled else f' at {where}') if where else ''}"


def _where(check: Measurement) -> str:
    """Say in brackets which schemes, which level and which member a check is about."""
    names = getattr(check, "schemes", None)
    parts = [_listed(names)] if names else []
    places = ((key, getattr(check, key)) for key in ("level", "case"))
    parts += [f"{key} {value}" for key, value in places if value is not None]
    return f" ({', '.join(parts)})" if parts else ""


def _listed(names: tuple[str, ...]) -> str:
    return f"scheme{'s' if len(names) > 1 else ''} {', '.join(names)}"
