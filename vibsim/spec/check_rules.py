"""What a check must be besides well-formed: it names what the experiment has."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from vibsim.errors import nearest
from vibsim.models.error_parts import is_error_part
from vibsim.spec.check_places import (
    Ladder,
    check_anywhere,
    check_place,
    is_faulty,
    known_schemes,
)
from vibsim.spec.checks import Check, ClaimCheck, ConvergesCheck, ValueCheck
from vibsim.spec.faults import Report
from vibsim.spec.part_rules import known_part, promised_part
from vibsim.spec.quantity_rules import has_quantity, known_quantity
from vibsim.spec.scheme_check_rules import conserves, equal, stable
from vibsim.spec.scheme_checks import ConservesCheck, EqualCheck, StableCheck
from vibsim.spec.source import Path_
from vibsim.spec.value_rules import known_value, value_of
from vibsim.vocabulary import BY_TOLERANCE, REASONS


def finish_checks(checks: Iterable[Any], ladder: Ladder, report: Report) -> tuple[Any, ...]:
    """Note every fault of the checks (None stands for a malformed one); give an id to those without."""
    listed = list(checks)
    ids = _ids(listed, report)
    if ladder.by_tolerance:
        _check_own(listed, report)
    finished = []
    for i, check in enumerate(listed):
        if check is None:
            continue
        path: Path_ = ("checks", i)
        _check(check, path, ladder, report)
        update: dict[str, Any] = {"id": ids[i]}
        if isinstance(check, ClaimCheck):
            update["that"] = check.that.model_copy(update={"id": ids[i]})
        finished.append(check.model_copy(update=update))
    return tuple(finished)


def _ids(checks: list[Any], report: Report) -> list[str]:
    """Return the id of every check; a generated one is its place in the file."""
    given: dict[str, int] = {}
    for i, check in enumerate(checks):
        if check is not None and check.id and given.setdefault(check.id, i) != i:
            report.add(("checks", i, "id"), "two checks have one id", value=check.id)
    ids = []
    for i, check in enumerate(checks):
        name = check.id if check is not None else ""
        number = i + 1
        while not name:
            candidate = f"check_{number}"
            name = candidate if candidate not in given else ""
            number += len(checks)
        ids.append(name)
    return ids


def _check_own(checks: list[Any], report: Report) -> None:
    """Refuse the name of the verdict that every experiment with a tolerance has."""
    for i, check in enumerate(checks):
        if check is not None and check.id == BY_TOLERANCE:
            rule = "is the id of the verdict on the tolerance itself"
            report.add(("checks", i, "id"), rule, value=check.id)


def _check(check: Check, path: Path_, ladder: Ladder, report: Report) -> None:
    if isinstance(check, ClaimCheck):
        path = (*path, "that")
        if check.that.id:
            report.add((*path, "id"), "the id belongs to the claim", at_key=True)
    match check.measured:
        case ConvergesCheck() as inner:
            _converges(inner, path, ladder, report)
        case ValueCheck() as inner:
            _value(inner, path, ladder, report)
        case StableCheck() as inner:
            stable(inner, path, ladder, report)
        case ConservesCheck() as inner:
            conserves(inner, path, ladder, report)
        case EqualCheck() as inner:
            equal(inner, path, ladder, report)


def _converges(check: ConvergesCheck, path: Path_, ladder: Ladder, report: Report) -> None:
    known_schemes(check.schemes, path, ladder, report)
    if is_error_part(check.converges):
        known_part(check.converges, (*path, "converges"), ladder, report)
        promised_part(check, path, ladder, report)
    elif known_quantity(check.converges, (*path, "converges"), ladder, report):
        named = ((name, (*path, "schemes", i)) for i, name in enumerate(check.schemes or ()))
        has_quantity(check.converges, named, ladder, report)
    reason = check.expect.reason
    if reason is None:
        return
    place = (*path, "expect", "reason")
    if reason not in REASONS:
        report.add(place, "unknown reason", nearest(reason, list(REASONS)), reason)
    elif REASONS[reason] != check.expect.status and not is_faulty(
        (*path, "expect", "status"), report
    ):
        rule = f"reason of status {REASONS[reason]}, but the status is {check.expect.status}"
        choices = [name for name, status in REASONS.items() if status == check.expect.status]
        report.add(place, rule, "choose from " + ", ".join(choices), reason)


def _value(check: ValueCheck, path: Path_, ladder: Ladder, report: Report) -> None:
    _comparison(check, path, report)
    row = known_value(check.value, (*path, "value"), report)
    if row is None:
        check_anywhere(check.at, (*path, "at"), ladder, report)
        return
    value_of(row, check.quantity, check.at.level == "best", path, ladder, report)
    if check.quantity is not None and check.at.scheme is not None:
        named = [(check.at.scheme, (*path, "at", "scheme"))]
        has_quantity(check.quantity, named, ladder, report)
    check_place(check.at, row, (*path, "at"), ladder, report)


def _comparison(check: ValueCheck, path: Path_, report: Report) -> None:
    given = [name for name in ("equals", "below", "above") if getattr(check, name) is not None]
    if any(is_faulty((*path, name), report) for name in ("equals", "below", "above")):
        return
    if len(given) != 1:
        found = " and ".join(given) or "none of them"
        report.add(path, f"must have exactly one of equals, below, above; has {found}")
    for name in ("rtol", "atol"):
        if getattr(check, name) is not None and "equals" not in given:
            report.add((*path, name), "is used with equals only", at_key=True)
