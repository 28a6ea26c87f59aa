"""The checks that passed in one table: what was checked, what was expected and what was measured, a row for each."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from vibsim.report.text import assertions, words

if TYPE_CHECKING:
    from vibsim.experiment import Check
    from vibsim.experiment.schema.checks import Measurement

MANY = 6
"""From so many checks on, those that passed share a table; fewer have a card each."""

_HEAD = re.compile(r"PASS in (\d+) of \1 results; (?:scheme )?(.+?) decides: ")
_STATEMENT = re.compile(r"^.*? Measured: the statement is true\. ", re.DOTALL)


def is_plain(asserted: Check | None, check: Mapping[str, Any]) -> bool:
    """Say whether a row tells all of a check: it passed, has no note and refutes no statement."""
    if check["status"] != "PASS" or asserted is None or getattr(asserted, "note", None):
        return False
    return asserted.kind != "claim" or asserted.holds


def row(asserted: Check, check: Mapping[str, Any]) -> dict[str, str]:
    """Return the words of a row: subject, where a claim stands, what was expected and measured."""
    expected = words.readable(words.expectation(check.get("expected")))
    if asserted.kind == "claim":
        return {
            "subject": f"Claim: {asserted.claim}",
            "origin": f"Source: {asserted.source}" if asserted.source else "",
            "asked": f"true: {_asked(asserted.that)}",
            "measured": _measured(asserted.that, check),
        }
    return {
        "subject": words.sentence(assertions.subject(asserted)),
        "origin": "",
        "asked": _order(asserted) if expected == "PASS" else expected,
        "measured": _measured(asserted, check),
    }


def _order(check: Measurement) -> str:
    """Return the order that a check asks for."""
    if check.kind != "converges" or check.order == "scheme":
        return "as its scheme promises"
    return f"order {check.order:g} ± {check.tolerance:g}"


def _asked(that: Measurement) -> str:
    """Return what a claim asks of a measurement."""
    return assertions.heading(that)


def _measured(that: Measurement, check: Mapping[str, Any]) -> str:
    """Return the part of a verdict's text that has the measured number."""
    text = _STATEMENT.sub("", words.told(check))
    found = _HEAD.match(text)
    several = f"all {found[1]} results; {found[2]}: " if found else ""
    text = text[found.end() :] if found else text
    if that.kind == "value":
        text = text.partition("; it is")[0]
        text = text if text.startswith("it grows") else text.rpartition(" is ")[2]
    elif that.kind == "equal":
        text = text.rpartition("they are ")[2]
    return several + text.rstrip(".")
