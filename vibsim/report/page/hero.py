"""The first screen of a page: the finding, three numbers, two pictures, and the next step if a check did not pass."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from vibsim.checks.outcome import about_members
from vibsim.comparison.best_values import WORDS
from vibsim.core.home import called
from vibsim.core.vocabulary import ORDER_TOLERANCE, decisive_number
from vibsim.report import choice, finest_level, style, sweep_layout, words
from vibsim.report.choice import CheckedLadder
from vibsim.report.data import Results
from vibsim.report.evidence import figure, frame
from vibsim.report.figures import hero as drawn
from vibsim.report.style import Picture
from vibsim.report.tables import published
from vibsim.report.tables.best import best_value, error_size, rounded, used_levels
from vibsim.report.tables.best import numbers as numbers_of
from vibsim.report.text import assertions, findings

MOST_NUMBERS = 3  # large numbers on the first screen
MOST_SCHEMES = 3  # schemes that are named
# Least width of a panel of evidence with its title, and its height [inch].
NARROWEST, EVIDENCE = 1.8, 1.7
NO_BREAK = "\N{NO-BREAK SPACE}"
MOST_STATEMENTS = 3  # claims that are shown beside the finding
MEASURED = {
    "stable": "Growth per period", "conserves": "Largest energy error over E(0)", "equal": "Largest difference",
    "accurate": "Error of the finest level", "tolerance": "Error bound of the best solution",
}  # fmt: skip
"""Kind of a check to the name of its decisive number."""

Number = dict[str, str]  # ``label``, ``value`` with its unit, and ``note`` of a large number


def context(summary: Mapping[str, Any], lead: CheckedLadder) -> dict[str, Any]:
    """Return the words of the first screen by the names that its template uses."""
    record = lead.record
    claims = _statements(summary, lead)
    return {
        "finding": findings.title(lead, published.ids(record.experiment)),
        "counts": words.passed([check["status"] for check in summary["checks"]]),
        "marks": words.marks(summary["checks"]),
        "facts": " · ".join(filter(None, _facts(record))),
        "numbers": list(numbers(lead))[:MOST_NUMBERS],
        "meaning": style.sentences(
            findings.paragraph(lead), findings.asked_of(lead), *_traps(summary, lead)
        ),
        "statements": claims[:MOST_STATEMENTS],
        "more_statements": max(0, len(claims) - MOST_STATEMENTS),
    }


def _statements(summary: Mapping[str, Any], lead: CheckedLadder) -> list[dict[str, str]]:
    """Return the claims, other than that of the title, with their outcomes."""
    checks = lead.record.experiment.checks
    claims = {check.id: check.claim for check in checks if check.kind == "claim"}
    return [
        {"status": entry["status"], "badge": words.badge(entry), "claim": claims[entry["id"]]}
        for entry in summary["checks"]
        if entry["id"] in claims and entry is not lead.entry
    ]


def _traps(summary: Mapping[str, Any], lead: CheckedLadder) -> Iterator[str]:
    """Yield a sentence on the order that each trap found, unless the page is on this trap."""
    for check in summary["checks"]:
        result = check["results"][0]
        # any other order is an estimate that may be an accident
        has_order = result["reason"] in findings.WITH_AN_ORDER
        order = words.fact(result, "order") if has_order else None
        if words.badge(check) == words.TRAP and check is not lead.entry and order is not None:
            scheme, letter = result["scheme"], words.title(check["quantity"])
            yield f"As the trap expects, {letter} by {scheme} has order {words.number(order, 'order')}."


def _facts(record: Results) -> Iterator[str]:
    """Yield title, schemes, members, steps and source of the run."""
    yield record.experiment.title
    names = record.schemes
    yield ", ".join(names) if len(names) <= MOST_SCHEMES else f"{len(names)} schemes"
    if record.swept:
        yield f"{words.number(record.count, 'integer')} members"
    steps = [words.number(n, "integer") for n in record.steps]
    ends = np.unique(record.ends)
    end = record.time_text(ends[0]).replace(" ", NO_BREAK)
    over = f" up to t{NO_BREAK}={NO_BREAK}{end}"
    span = steps[0] if len(steps) == 1 else f"{steps[0]} to {steps[-1]}"
    yield f"{span} steps{over if ends.size == 1 else ''}"
    yield record.experiment.source or ""


def numbers(lead: CheckedLadder) -> Iterator[Number]:
    """Yield the large numbers, the most informative first: decisive number, order, error, member, best value, steps."""
    record = lead.record
    if lead.entry and not lead.is_on_order:
        yield from _measured(lead)
    if record.triples or lead.is_on_order:
        yield from _order(lead)
    if lead.measured is None or lead.measured.kind != "accurate":
        yield from _error(lead)
    if record.swept and lead.result.get("command") and lead.total != 1:
        text = re.sub(r"(?<!,) ", NO_BREAK, lead.member.case_words)
        command = called(lead.result["command"])
        yield {"label": "Hardest member", "value": text, "note": f"To run it alone: `{command}`"}
    yield from _best(lead)
    note = f"level {record.levels[-1]}"
    largest = float(record.omega_dt[lead.case, -1])
    if math.isfinite(largest):
        note += f"; w dt = {words.number(largest, 'step')}"
    yield {"label": "Finest time step", "value": record.time_text(lead.dt[-1]), "note": note}
    steps = words.number(record.steps[-1], "integer")
    yield {"label": "Steps", "value": steps, "note": "at the finest level"}


def _measured(lead: CheckedLadder) -> Iterator[Number]:
    """Yield the decisive number of a check that is not on an order."""
    number, check = decisive_number(lead.facts), lead.measured
    if number is None or not math.isfinite(number):
        return
    kind = lead.kind
    # an error has two digits, a growth factor more: it is compared with 1
    unit, label, form = "", MEASURED.get(kind, ""), "norm" if kind == "stable" else "brief"
    if check is not None and check.kind == "value":
        unit, form = lead.record.unit_of_number(check), "step"
        label = words.PAGE.opening(assertions.subject(check, lead.record))
    if kind in ("equal", "accurate"):
        unit = lead.norm_unit("l2" if kind == "accurate" else "linf")
    if check is not None and check.kind == "accurate" and check.is_relative:
        number = lead.facts.get("relative_error") or number
        unit = f"of the size of {lead.letter}"
    wanted = assertions.wanted(lead.record.experiment, check, unit=unit)
    note = f"{'the statement' if lead.is_refutation else 'asked for'}: {wanted}"
    if lead.is_trap and not lead.is_refutation:
        note = "the check expects that it is not as asked"
    if (allowed := lead.facts.get("allowed")) is not None:
        note = f"{words.number(allowed, 'brief')} is allowed"
    value = f"{words.number(number, form)} {unit}".rstrip()
    if check is None or check.kind != "value" or check.at.scheme is None:
        label += lead.record.of_several(lead.scheme)
    yield {"label": label, "value": value, "note": note}


def _order(lead: CheckedLadder) -> Iterator[Number]:
    """Yield the observed order with its interval, or in a sweep its range over the members, and the promised order.

    The members are those that the check judges.
    """
    if "order" not in lead:
        return
    record, of = lead.record, lead.basis_of_order
    letter = findings.short(record.model, lead.quantity)
    label = f"Observed order of {letter}{record.of_several(lead.scheme)}"
    promised = record.promised_text(lead.quantity, lead.scheme)
    due = f"the scheme promises {promised}" if of == "promised" else f"{promised} is expected"
    due, unasked = "" if promised == of else due, ""
    if lead.is_on_order:
        order, low, high = (lead.facts.get(f"order{end}") for end in ("", "_low", "_high"))
    else:
        order, low, high = lead.stated_order(lead.norm)
        misses = not low - ORDER_TOLERANCE <= lead.formal_order <= high + ORDER_TOLERANCE
        if due and misses and not choice.on_order(record, lead.quantity, lead.member.scheme_name):
            unasked = ", which no check asks for"
    orders = record.stated_orders(lead.quantity, lead.norm)[0][lead.scheme]
    shown = about_members(record, lead.measured if lead.is_on_order else None)
    every = style.finite(orders[shown])
    if lead.is_on_order and lead.result.get("status") == "INCONCLUSIVE":
        order = None
    if record.swept and every.size > 1:
        ends = [words.number(float(end), "order") for end in (every.min(), every.max())]
        value = ends[0] if ends[0] == ends[1] else " to ".join(ends)
        known, total = (words.number(n, "integer") for n in (every.size, record.count))
        known = known if known == total else f"{known} of the {total}"
        note = "; ".join(filter(None, [f"of {known} members", due]))
        yield {"label": label, "value": value, "note": note}
    elif lead.is_on_order and lead.result.get("reason") == "exact":
        yield {"label": label, "value": "exact", "note": "the levels differ by round-off only"}
    elif order is None or not math.isfinite(order):
        # a missing order is shown only if no other number decides
        if lead.is_on_order or not lead.entry:
            yield {"label": label, "value": "not measurable", "note": due}
    else:
        note = "; ".join(filter(None, [words.likely((low, high)), due + unasked]))
        yield {"label": label, "value": words.number(float(order), "order"), "note": note}


def _error(lead: CheckedLadder) -> Iterator[Number]:
    """Yield the root-mean-square error of the finest level, in its unit and relative to the size of the solution."""
    record, word = lead.record, "estimated"
    error, relative = lead.facts.get("error"), lead.facts.get("relative_error")
    true = float(finest_level.true_error(record, lead.quantity)[lead.member.place])
    if math.isfinite(true):
        word = "true" if record.name_of_exact == "exact" else "against the reference"
    if error is None and math.isfinite(true):
        error = true
    if error is None or not math.isfinite(error):
        if lead.is_on_order:
            note = "the levels do not tell it"
            yield {"label": "Error of the finest level", "value": "not known", "note": note}
        return
    mean = error / math.sqrt(record.ends[lead.case])
    size = f"; {words.share(relative)} of that of {words.title(lead.quantity)}" if relative else ""
    note = f"root mean square, {word}{size}"
    if error == 0.0:
        equal = (
            "the levels agree"
            if word == "estimated"
            else f"equal to the {record.name_of_exact} solution"
        )
        note = f"{equal} in every digit"
    steps = words.number(record.steps[-1], "integer")
    letter = findings.short(record.model, lead.quantity)
    yield {
        "label": f"Error of {letter} at {steps} steps{record.of_several(lead.scheme)}",
        "value": f"{words.number(mean, 'brief')} {lead.norm_unit('linf')}".rstrip(),
        "note": f"{note}{_of_member(lead)}",
    }


def _best(lead: CheckedLadder) -> Iterator[Number]:
    """Yield the best value of the first number of a check, or of the position at the end, period or amplitude."""
    record, model, position = lead.record, lead.record.model, lead.record.model.position
    checked = choice.asked_values(record)
    wanted = [
        f"{check.quantity}_{check.value}" if check.quantity else check.value for check in checked
    ]
    known = numbers_of(model, "scalar" not in record, [check.value for check in checked])
    rows = {row.variable: row for _, row in known}
    for name in [*wanted, f"{position}_end", "period", "amplitude"]:
        field = f"{name}_richardson"
        if name not in rows or field not in record:
            continue
        value, bound = best_value(record, name, lead.member)
        # a bound as large as the value means that the value is unknown
        if not (math.isfinite(value) and bound < abs(value)):
            continue
        row = rows[name]
        is_named = row.quantity in words.NAMES or row.quantity == position
        text = f"{words.symbol(row.quantity)} {WORDS[row.value]}" if is_named else row.words
        unit, size = record.unit(field), error_size(bound)
        note = f"± {size.text if size else '0'} {unit}".rstrip()
        yield {
            "label": f"Best value: {text}{record.of_several(lead.scheme)}",
            "value": f"{rounded(value, bound).text} {unit}".rstrip(),
            "note": f"{note}, {_levels_of_best(name, lead)}{_of_member(lead)}",
        }
        return


def _levels_of_best(name: str, lead: CheckedLadder) -> str:
    """Say from which levels a best value comes."""
    if "scalar" not in lead.record:
        return "extrapolated over the levels"
    first, last = used_levels(lead.record, lead.record.words("scalar").index(name), lead.member)
    if first == last:
        return f"level {last}, not extrapolated"
    return f"extrapolated over levels {words.levels((first, last))}"


def _of_member(lead: CheckedLadder) -> str:
    """Name the member of a number; empty without a sweep."""
    return f"; member {lead.member.case_words}" if lead.record.swept else ""


def pictures(lead: CheckedLadder) -> list[Picture]:
    """Return the one or two pictures of the first screen, the decisive one first."""
    record, has_order = lead.record, "order" in lead
    left = right = None
    values = [key.distinct.size for key in sweep_layout.keys(record)]
    has_response = max(values, default=1) >= sweep_layout.FEWEST_VALUES
    if has_response:
        left = drawn.response(lead)
    elif lead.entry and not lead.is_on_order:
        left = _evidence(lead, drawn.LEFT)
    elif has_order:
        left = drawn.differences(lead)
    if has_order:
        alone = not record.swept or (lead.total == 1 and not has_response)
        right = drawn.against_step(lead) if alone else drawn.orders(lead)
    if has_response:
        right = right or _evidence(lead, drawn.RIGHT)
    found = [picture for picture in (left, right) if picture is not None]
    if record.is_lean or len(found) == 2:
        return found
    moving = drawn.solution(lead.of(record.model.position), is_left=left is None)
    return [moving, *found] if left is None else [*found, moving]


def _evidence(lead: CheckedLadder, width: float) -> Picture | None:
    """Return the picture of this width that shows why the decisive check came out as it did."""
    if not lead.entry:
        return None
    found = figure.picture(lead)
    if found is None or found.figure is None:
        return None
    frame.place(found.figure, max(width / len(found.figure.axes), NARROWEST), EVIDENCE)
    return replace(found, name="hero_evidence", title="What decides")
