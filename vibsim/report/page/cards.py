"""The checks of a page: a line for each, its evidence, and what to change where it did not pass."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from vibsim.checks.outcome import Result
from vibsim.checks.value import unit_of
from vibsim.checks.verdict_text import Wording, expectation
from vibsim.core.home import called
from vibsim.core.record import Record
from vibsim.core.vocabulary import worst
from vibsim.plan.versions import DRAWING, versions
from vibsim.report import data, words
from vibsim.report.choice import is_trap
from vibsim.report.evidence import figure
from vibsim.report.tables import checks as check_tables
from vibsim.report.tables import published
from vibsim.report.tables.table import Column, Table
from vibsim.report.text import assertions, experiment_file, findings, reasons
from vibsim.report.types import Check, Experiment

SAID_BY_THE_LINE = ("value", "equal", "converges")
"""Kinds of checks of which the line says all where they pass."""
ALIKE = (
    6  # checks on a number, or on solutions that are equal, from which on their lines are a table
)
WIDE = 1.0  # an interval that reaches further below its order is worth a sentence


def cards(
    experiment: Experiment, record: Record, summary: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Return what the page says of every check; of printed numbers of those that did not come out as expected."""
    in_tables = published.ids(experiment)
    return [
        card(experiment, record, check)
        for check in summary["checks"]
        if check["id"] not in in_tables or check["status"] != "PASS"
    ]


def gathered(
    made: list[dict[str, Any]], decides: str | None
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the cards that stand alone, and the many alike, of which the line says all, as tables of lines.

    The check that decides stands alone.
    """
    groups = []
    for kind in SAID_BY_THE_LINE[:2]:
        plain = [
            c for c in made
            if c["measures"] == kind and c["badge"] == words.BADGES["PASS"] and c["id"] != decides and not c["note"]
        ]  # fmt: skip
        if len(plain) < ALIKE:
            continue
        made = [c for c in made if c not in plain]
        wanted = {c["wanted"] for c in plain}
        names = ["check", "got"] if len(wanted) == 1 else ["check", "wanted", "got"]
        rows = tuple(tuple(c["what" if name == "check" else name] for name in names) for c in plain)
        groups.append(
            {
                "what": f"{plain[0]['what']}, and {len(plain) - 1} more",
                "wanted": wanted.pop() if len(wanted) == 1 else "as listed",
                "table": Table(
                    f"checks_{kind}", "Checks that passed", tuple(map(Column, names)), rows
                ),
            }
        )
    return made, groups


def card(experiment: Experiment, record: Record, check: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the page says of one check; an experiment with a tolerance has one that nothing asserts."""
    asserted = next((spec for spec in experiment.checks if spec.id == check["id"]), None)
    measured = asserted.measured if asserted else None
    value = measured if measured and measured.kind == "value" else None
    explained = reasons.reason(
        check["reason"],
        measured.kind if measured else check["kind"],
        value=value.value if value else "",
        levels=len(data.whole(record, "level")),
        is_promised=findings.keeps_promise(record, measured, check),
    )
    # of a claim that is refuted as expected, what the reason does not say is the point
    is_false = asserted is not None and asserted.kind == "claim" and not asserted.holds
    is_refuted = is_false and check["reason"] == "match"
    unit = data.pretty_unit(unit_of(experiment, record, value)) if value else ""
    wording = Wording(experiment, record, asserted, words.PAGE)
    decisive, counts, status = check["results"][0], check["counts"], check["status"]
    facts = (decisive[key] for key in ("scheme", "case", "status", "reason", "facts"))
    result = Result(*facts)
    decides = worst(word for word, count in counts.items() if count)
    told = wording.text(result, counts, check["where"])
    if _is_said(asserted, check):
        told = _hardest(record, check)
    results, more = _results(record, check, unit)
    return {
        "id": check["id"],
        "status": status,
        "measures": measured.kind if measured else check["kind"],
        "badge": words.badge(check),
        "what": assertions.about(asserted) if asserted else assertions.OF_TOLERANCE,
        "source": assertions.source(asserted) if asserted else "",
        "wanted": _wanted(experiment, asserted, check),
        "got": _got(check, wording, result),
        "note": getattr(asserted, "note", None) or "",
        "reason": check["reason"] or "–",
        "meaning": reasons.REFUTED if is_refuted else explained.meaning,
        "needs": explained.needs,
        "results": results,
        "more": more,
        # but for those that the check's own text has
        "where": [f"{place['text']}." for word, place in check["where"].items() if word != decides],
        "alone": _alone(check),
        "picture": figure.picture(experiment, record, asserted, check),
        "text": told,
        "advice": wording.advice(status, result, counts),
        "change": experiment_file.change(experiment, measured, check),
    }


def _is_said(asserted: Check | None, check: Mapping[str, Any]) -> bool:
    """Say whether the line of a check tells all of what was measured: it is as asked for, without a doubt."""
    if check["status"] != "PASS" or asserted is None:
        return False
    result = check["results"][0]
    order, low, wanted = (words.fact(result, name) for name in ("order", "order_low", "expected"))
    allowed = getattr(asserted.measured, "tolerance", math.inf)
    is_doubtful = order is not None and low is not None and order - low > WIDE
    # that the interval reaches what is wanted, where the order itself does not, is worth a sentence
    is_doubtful |= None not in (order, wanted) and abs(order - wanted) > allowed
    is_plain = asserted.measured.kind in SAID_BY_THE_LINE and not is_trap(asserted)
    return is_plain and not is_doubtful


def _hardest(record: Record, check: Mapping[str, Any]) -> str:
    """Name the result that decides, of several."""
    total, result = sum(check["counts"].values()), check["results"][0]
    if total < 2:
        return ""
    named = check_tables.member(record, result["case"])
    place = f"{result['scheme']}{f', {named}' if named else ''}"
    return f"The hardest of {words.number(total, 'integer')}: {place}."


def _wanted(experiment: Experiment, asserted: Check | None, check: Mapping[str, Any]) -> str:
    """Say in a few words what is asked for."""
    if asserted is None:
        return expectation(experiment, None, words.PAGE)
    asked = asserted.measured
    told = ""
    if asked.kind == "converges":
        told = assertions.order_asked(asked, words.fact(check["results"][0], "expected"))
    elif asked.kind == "conserves":
        told = assertions.DRIFTS[asked.drift]
    told = told or words.labelled(expectation(experiment, asked, words.PAGE), None)
    return told if asserted.kind != "claim" or asserted.holds else f"not: {told}"


def _got(check: Mapping[str, Any], wording: Wording, result: Result) -> str:
    """Say in a few words what was measured where it decides."""
    order, reason = words.fact(check["results"][0], "order"), check["results"][0]["reason"]
    if order is not None and check["results"][0]["status"] != "INCONCLUSIVE":
        between = words.interval(words.interval_of(check["results"][0]))
        return f"order {words.number(order, 'order')}{f' ({between})' if between != '–' else ''}"
    if check["kind"] == "converges" or "order" in (check["results"][0].get("facts") or {}):
        return str(reason).replace("_", " ")
    return wording.brief(result)


def _results(record: Record, check: Mapping[str, Any], unit: str) -> tuple[Any, str]:
    """Return the table of the results, and a sentence that says how many it leaves out; of one result neither."""
    table, counts = check_tables.results(record, check, unit), check["counts"]
    total = sum(counts.values())
    # where all passed, the table of checks has the hardest
    if table is None or total < 2 or check["status"] == "PASS":
        return None, ""
    told = ", ".join(f"{n} {word}" for word, n in counts.items() if n)
    listed = len(table.rows)
    return table, f"In all: {told}. Listed are the {listed} worst." if total > listed else ""


def _alone(check: Mapping[str, Any]) -> str:
    """Return the commands that run the listed members alone, a line for each."""
    listed = check.get("results") or []
    lines: dict[str, str] = {}
    for result in listed:
        if result.get("command"):
            # of the schemes of a member the worst comes first
            found = f"{result['status']} {result['reason']}"
            lines.setdefault(called(result["command"]), found)
    width = max(map(len, lines), default=0)
    return "\n".join(f"{command:{width}}  # {found}" for command, found in lines.items())


def provenance_rows(provenance: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the versions of all software in one line, then what else is known of where the results came from."""
    found = {**provenance.get("versions", {}), **versions(DRAWING)}
    named = {"python": "Python"}
    yield "Versions", ", ".join(f"{named.get(name, name)} {found[name]}" for name in found)
    yield from flat({k: v for k, v in provenance.items() if k not in {"experiment", "versions"}})


def flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield the entries of a nested mapping with dotted keys."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from flat(value, f"{prefix}{key}.")
        elif isinstance(value, list | tuple):
            yield f"{prefix}{key}", ", ".join(map(str, value))
        else:
            yield f"{prefix}{key}", str(value)
