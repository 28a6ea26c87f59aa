"""The checks of a page: a line for each, its evidence, and a proposed change if it did not pass."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from vibsim.checks.outcome import Result
from vibsim.checks.value import is_proved
from vibsim.checks.verdict_text import Wording
from vibsim.core.home import called
from vibsim.core.vocabulary import worst
from vibsim.plan.versions import DRAWING, versions
from vibsim.report import choice, words
from vibsim.report.choice import CheckedLadder
from vibsim.report.data import Results
from vibsim.report.evidence import figure
from vibsim.report.tables import checks as check_tables
from vibsim.report.tables import published
from vibsim.report.tables.table import Column, Table
from vibsim.report.text import assertions, experiment_file, findings, reasons

SAID_BY_THE_LINE = ("value", "equal", "converges")  # kinds whose line says everything if passed
ALIKE = 6  # value checks, or checks of equality, from which their lines become a table
WIDE = 1.0  # an interval that extends further below its order gets a sentence


def cards(record: Results, summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the cards of all checks; of checks of printed numbers only those that did not pass."""
    in_tables = published.ids(record.experiment)
    return [
        card(record, check)
        for check in summary["checks"]
        if check["id"] not in in_tables or check["status"] != "PASS"
    ]


def gathered(
    made: list[dict[str, Any]], decides: str | None
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Split cards into single ones, among them the decisive one, and many alike that become rows of a table."""
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
        is_same = len(wanted) == 1
        keys = ["what", "got"] if is_same else ["what", "wanted", "got"]
        rows = tuple(tuple(c[key] for key in keys) for c in plain)
        columns = tuple(map(Column, ["check", *keys[1:]]))
        table = Table(f"checks_{kind}", "Checks that passed", columns, rows)
        what = f"{plain[0]['what']}, and {len(plain) - 1} more"
        groups.append(
            {"what": what, "wanted": wanted.pop() if is_same else "as listed", "table": table}
        )
    return made, groups


def card(record: Results, check: Mapping[str, Any]) -> dict[str, Any]:
    """Return the card of a check; the check of a tolerance has no assertion in the experiment."""
    checked = choice.of_check(record, check)
    asserted, measured, decisive = checked.asserted, checked.measured, checked.result
    explained = findings.explained(checked, checked.reason)
    # the reason alone does not say that a claim is refuted as expected
    is_refuted = checked.is_refutation and checked.reason == "match"
    value = measured if measured and measured.kind == "value" else None
    unit = record.unit_of_number(value) if value else ""
    wording = Wording(record.experiment, record, asserted, words.PAGE)
    counts, status = check["counts"], checked.status
    result = Result.of(decisive)
    decides = worst(word for word, count in counts.items() if count)
    text = words.swept(wording.text(result, counts, check["where"]))
    if _is_said(checked):
        text = _hardest(checked)
    wanted = assertions.wanted(record.experiment, measured, words.fact(decisive, "promised"), unit)
    results, more = _results(record, check, unit)
    return {
        "id": check["id"],
        "status": status,
        "measures": checked.kind,
        "badge": words.badge(check),
        "what": assertions.about(asserted, record),
        "source": assertions.source(asserted, record),
        "wanted": f"false (the statement: {wanted})" if checked.is_refutation else wanted,
        "got": words.swept(_got(checked, wording, result)) + _of_all(check),
        "note": getattr(asserted, "note", None) or "",
        "reason": checked.reason or "–",
        "meaning": reasons.REFUTED if is_refuted else explained.meaning,
        "needs": explained.needs,
        "results": results,
        "more": more,
        # except for the one in the text of the check
        "where": [
            words.swept(f"{place['text']}.")
            for word, place in check["where"].items()
            if word != decides
        ],
        "alone": _alone(check),
        "picture": figure.picture(checked),
        "text": text,
        "advice": wording.advice(status, result, counts),
        "change": experiment_file.change(record.experiment, measured, check),
    }


def _is_said(checked: CheckedLadder) -> bool:
    """Return whether the line of a check says everything: it passed beyond doubt."""
    check, fact = checked.measured, checked.facts.get
    if checked.status != "PASS" or check is None or _is_beside(checked):
        return False
    order, low, number, bound = map(fact, ("order", "order_low", "value", "error_bound"))
    if order is not None and low is not None and order - low > WIDE:
        return False
    if check.kind == "value" and number is not None and bound is not None:
        return is_proved(check, number, bound) and not checked.is_trap
    return check.kind in SAID_BY_THE_LINE and not checked.is_trap


def _is_beside(checked: CheckedLadder) -> bool:
    """Return whether a check passed whose order misses the expected one, because its interval reaches that."""
    order, wanted = (checked.facts.get(name) for name in ("order", "promised"))
    if checked.status != "PASS" or order is None or wanted is None or checked.is_trap:
        return False
    return bool(abs(order - wanted) > getattr(checked.measured, "tolerance", math.inf))


def _hardest(checked: CheckedLadder) -> str:
    """Name the decisive one of several results; empty for a single result."""
    if checked.total < 2:
        return ""
    named = check_tables.member(checked.record, checked.result["case"])
    place = f"{checked.result['scheme']}{f', {named}' if named else ''}"
    return f"The hardest of {words.number(checked.total, 'integer')}: {place}."


def _got(checked: CheckedLadder, wording: Wording, result: Result) -> str:
    """Say in a few words what the decisive result measured."""
    order = checked.facts.get("order")
    if order is not None and result.status != "INCONCLUSIVE":
        text = f"order {words.with_interval(order, words.interval_of(checked.result))}"
        return f"{text}: its interval overlaps the band" if _is_beside(checked) else text
    if checked.is_on_order or "order" in checked.facts:
        return reasons.OUTCOMES.get(result.reason, str(result.reason))
    return wording.brief(result)


def _of_all(check: Mapping[str, Any]) -> str:
    """Say of how many results the decisive one is shown; empty for a single result."""
    status, counts = check["status"], check["counts"]
    total, count = (words.number(n, "integer") for n in (sum(counts.values()), counts[status]))
    if sum(counts.values()) < 2:
        return ""
    if status == "PASS":
        return f", the hardest of {total}"
    return f"; {count} of {total} {words.BADGES[status]}"


def _results(record: Results, check: Mapping[str, Any], unit: str) -> tuple[Any, str]:
    """Return the table of results and a sentence on those left out; neither for one result or a passed check."""
    table, counts = check_tables.results(record, check, unit), check["counts"]
    total = sum(counts.values())
    # the table of checks has the hardest result of a passed check
    if total < 2 or check["status"] == "PASS":
        return None, ""
    counted = ", ".join(f"{n} {word}" for word, n in counts.items() if n)
    listed = len(table.rows)
    return table, f"In all: {counted}. Listed are the {listed} worst." if total > listed else ""


def _alone(check: Mapping[str, Any]) -> str:
    """Return the commands that run the listed members alone, one line each."""
    lines: dict[str, str] = {}
    for result in check["results"]:
        if result.get("command"):
            # the worst scheme of a member comes first
            found = f"{result['status']} {result['reason']}"
            lines.setdefault(called(result["command"]), found)
    width = max(map(len, lines), default=0)
    return "\n".join(f"{command:{width}}  # {found}" for command, found in lines.items())


def provenance_rows(provenance: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the versions of all software in one line, then the rest of the provenance."""
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
