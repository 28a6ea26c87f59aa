"""The words of a page: the verdict on every check, what was computed, and where it came from."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from shlex import quote
from typing import Any

from vibsim.checks.outcome import Result
from vibsim.checks.value import unit_of
from vibsim.checks.verdict_text import Wording, expectation
from vibsim.core.record import Record
from vibsim.core.vocabulary import worst
from vibsim.experiment.collection import ADHOC, ENDINGS
from vibsim.plan.versions import DRAWING, versions
from vibsim.report import data
from vibsim.report.evidence import figure
from vibsim.report.tables import checks as check_tables
from vibsim.report.tables import published
from vibsim.report.text import assertions, reasons, setting, words
from vibsim.report.types import Check, Experiment, Measurement

MANY_CHECKS = 6  # from so many checks on, those that passed share a table; fewer have a card each
WITH_AN_ORDER = ("asymptotic", "order_low", "order_high")
"""Reasons of a result whose order is known: any other has at most an estimate that may be an accident."""
BRIEF = 3  # with more checks than this, the evidence of those that passed is folded away
PYTHON = """\
from vibsim import Experiment, analyse, simulate, verdicts

experiment = Experiment.from_yaml("{file}"){alone}
convergence = analyse(experiment, {{level: simulate(experiment, level) for level in experiment.levels}})
for verdict in verdicts(experiment, convergence):
    print(verdict.id, verdict.status, verdict.reason)"""


def context(
    experiment: Experiment,
    record: Record,
    summary: Mapping[str, Any],
    provenance: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the words of a page by the names that its template uses."""
    in_tables = published.ids(experiment)
    asserted = {spec.id: spec for spec in experiment.checks}
    made = {check["id"]: card(experiment, record, check) for check in summary["checks"]}
    unsettled = [made[check["id"]] for check in summary["checks"] if check["status"] != "PASS"]
    # of printed numbers those get a card that did not come out as expected
    carded = [
        check
        for check in summary["checks"]
        if check["id"] not in in_tables or check["status"] != "PASS"
    ]
    plain = [check["id"] for check in carded if _is_plain(asserted.get(check["id"]), check)]
    plain = plain if len(carded) >= MANY_CHECKS else []
    used = provenance.get("experiment")
    broken, listed = words.broken(summary), len(summary.get("failures") or [])
    return {
        "collection": experiment.collection,
        "name": experiment.name,
        "title": experiment.title,
        "source": experiment.source,
        "status": summary["status"],
        "sentence": words.overall(summary),
        "unsettled": unsettled if len(summary["checks"]) > 1 else [],
        "checks": [made[check["id"]] for check in carded if check["id"] not in plain],
        "plain": [made[name] | assertions.row(asserted[name]) for name in plain],
        "brief": len(carded) > BRIEF,
        "failures": check_tables.failures(summary, record),
        "unlisted": f"In all {broken} runs broke down; listed are the first {listed}."
        if broken > listed
        else "",
        "setup": list(setting.setup(experiment, record)),
        "provenance": list(provenance_rows(provenance)),
        "used": json.dumps(used, indent=1, ensure_ascii=False, default=str) if used else "",
        "target": quote(experiment.word),
        "python": _python(experiment),
    }


def _python(experiment: Experiment) -> str:
    """Return the lines of Python that do the same as the command."""
    word, is_ours = experiment.word, experiment.collection != ADHOC
    file, at, case = word.rpartition("@")
    if not at or word.endswith(ENDINGS):
        file, case = word, ""
    named = f"configs/{file}.yaml" if is_ours else file
    return PYTHON.format(file=named, alone=f".alone({case})" if case else "")


def _is_plain(asserted: Check | None, check: Mapping[str, Any]) -> bool:
    """Say whether a row tells all of a check: it passed, has no note and refutes no statement."""
    if check["status"] != "PASS" or asserted is None or getattr(asserted, "note", None):
        return False
    return asserted.kind != "claim" or asserted.holds


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
        is_promised=_keeps_promise(record, measured, check),
    )
    # of a claim that is refuted as expected, what the reason does not say is the point
    is_false = asserted is not None and asserted.kind == "claim" and not asserted.holds
    is_refuted = is_false and check["reason"] == "match"
    unit = data.pretty_unit(unit_of(experiment, record, value)) if value else ""
    wording = Wording(experiment, record, asserted, words.PAGE)
    decisive, counts = check["results"][0], check["counts"]
    facts = (decisive[key] for key in ("scheme", "case", "status", "reason", "facts"))
    result = Result(*facts)
    decides = worst(word for word, count in counts.items() if count)
    told = ", ".join(f"{n} {word}" for word, n in counts.items() if n)
    listed = len(check["results"])
    more = f"In all: {told}. Listed are the {listed} worst."
    # the result that decides has a settled order
    settled = check["status"] != "INCONCLUSIVE" and decisive["reason"] in WITH_AN_ORDER
    return {
        "id": check["id"],
        "kind": check["kind"],
        "heading": assertions.heading(asserted)
        if asserted
        else assertions.of_tolerance(check["expected"]),
        "background": assertions.background(asserted) if asserted else "",
        "note": getattr(asserted, "note", None) or "",
        "status": check["status"],
        "reason": check["reason"] or "–",
        "meaning": reasons.REFUTED if is_refuted else explained.meaning,
        "needs": explained.needs,
        "expected": expectation(experiment, asserted, words.PAGE),
        "factor": words.ratio(words.fact(decisive, "order")) if settled else "",
        "results": check_tables.results(record, check, unit),
        "more": more if sum(counts.values()) > listed else "",
        # but for those that the check's own text has
        "where": [f"{place['text']}." for word, place in check["where"].items() if word != decides],
        "alone": _alone(check),
        "picture": figure.picture(experiment, record, asserted, check),
        "text": wording.text(result, counts, check["where"]),
        "measured": wording.measured(result, counts),
        "advice": wording.advice(check["status"], result, counts),
    }


def _keeps_promise(record: Record, measured: Measurement | None, check: Mapping[str, Any]) -> bool:
    """Say whether the result that decides has the order of its scheme, and the check asks for another one."""
    decisive: Mapping[str, Any] = next(iter(check.get("results") or []), {})
    order, place = words.fact(decisive, "order"), data.place_of(record, decisive.get("case", -1))
    if measured is None or measured.kind != "converges" or measured.order == "scheme":
        return False
    if order is None or place is None:
        return False
    promised = data.formal_orders(record, measured.converges)
    own = promised[record.words("scheme").index(decisive["scheme"]), place]
    is_due = data.due(record, measured.converges) == "promised"
    return bool(is_due and abs(own - order) <= measured.tolerance)


def _alone(check: Mapping[str, Any]) -> str:
    """Return the commands that run the listed members alone, a line for each; of a check that passes the first."""
    listed = (check.get("results") or [])[: 1 if check["status"] == "PASS" else None]
    lines: dict[str, str] = {}
    for result in listed:
        if result.get("command"):
            # of the schemes of a member the worst comes first
            found = f"{result['status']} {result['reason']}"
            lines.setdefault(f".venv/bin/{result['command']}", found)
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
