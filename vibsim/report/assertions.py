"""What a check asserts, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.report import words

if TYPE_CHECKING:
    from vibsim.spec import Check, ConvergesCheck, ValueCheck


def heading(check: Check) -> str:
    """Return the assertion of a check in one line."""
    if check.kind == "claim":
        return f"Claim: {check.claim}"
    return _converges(check) if check.kind == "converges" else _value(check)


def of_tolerance(bound: str) -> str:
    """Return in one line what an experiment with a tolerance asserts; `bound` is what its verdict expects."""
    return f"The error of the extrapolated solution is {bound}, in the unit of each state, at every stored time"


def background(check: Check) -> str:
    """Return where a claim stands and what measures it; empty for the other kinds."""
    if check.kind != "claim":
        return ""
    source = f"Source: {check.source}. " if check.source else ""
    truth = "true" if check.holds else "false"
    inner = _converges(check.that) if check.that.kind == "converges" else _value(check.that)
    return f"{source}Expected to be {truth}. Measured by: {inner}."


def _converges(check: ConvergesCheck) -> str:
    order = "the order of its scheme" if check.order == "scheme" else f"order {check.order:g}"
    only = f", {_listed('scheme', check.schemes)}" if check.schemes else ""
    text = f"{words.symbol(check.converges)} converges with {order} ± {check.tolerance:g} ({check.norm} norm{only})"
    if check.expect.status == "PASS":
        return text
    why = f" ({check.expect.reason})" if check.expect.reason else ""
    return f"{text}, expected to end as {check.expect.status}{why}"


def _value(check: ValueCheck) -> str:
    of = f" of {words.symbol(check.quantity)}" if check.quantity else ""
    places = ((key, getattr(check.at, key)) for key in ("t", "step", "level", "scheme", "case"))
    where = ", ".join(f"{key} {value}" for key, value in places if value is not None)
    tolerances = [
        f"{key} {value:g}"
        for key, value in (("rtol", check.rtol), ("atol", check.atol))
        if value is not None
    ]
    bounds = {"equals": check.equals, "is below": check.below, "is above": check.above}
    rule = next((f"{verb} {value!r}" for verb, value in bounds.items() if value is not None), "")
    extra = f" ({', '.join(tolerances)})" if tolerances else ""
    return f"{check.value}{of}{f' at {where}' if where else ''} {rule}{extra}"


def _listed(word: str, names: tuple[str, ...]) -> str:
    return f"{word}{'s' if len(names) > 1 else ''} {', '.join(names)}"
