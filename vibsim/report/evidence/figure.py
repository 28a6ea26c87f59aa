"""The picture that shows a verdict, of the result that decides: the one that the sentence beside it names.

Each kind of check has a module of its own. Where no series are kept over time, pictures of energy, equality and
stability show the number that decides of all members instead.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from vibsim.core.record import Record
from vibsim.report import style
from vibsim.report.data import Member, case_name, is_lean, place_of
from vibsim.report.evidence import energy, equal, members, order, stable, value
from vibsim.report.evidence.frame import Picture

if TYPE_CHECKING:
    from vibsim.experiment import Check, Experiment


def picture(
    experiment: Experiment, record: Record, asserted: Check | None, check: Mapping[str, Any]
) -> Picture | None:
    """Return the picture of the result that decides a check; None where there is nothing to draw."""
    results: Sequence[Mapping[str, Any]] = check.get("results") or []
    member = _member(record, results[0]) if results else None
    if asserted is None or member is None:
        return None
    with style.applied():
        found = _draw(experiment, record, asserted, member)
    return found and replace(found, name=f"evidence_{asserted.id}")


def _draw(
    experiment: Experiment, record: Record, asserted: Check, member: Member
) -> Picture | None:
    measured = asserted.measured
    if measured.kind == "converges":
        return order.picture(record, measured, member)
    if measured.kind == "value":
        return value.picture(experiment, record, measured, asserted.id, member)
    if is_lean(record):
        return members.picture(record, measured, asserted.id, member)
    if measured.kind == "conserves":
        return energy.picture(record, measured, asserted.id, member)
    if measured.kind == "equal":
        return equal.picture(record, measured, asserted.id, member)
    return stable.picture(experiment, record, asserted.id, member)


def _member(record: Record, result: Mapping[str, Any]) -> Member | None:
    names, case = record.words("scheme"), place_of(record, result.get("case", -1))
    name = str(result.get("scheme"))
    if name not in names or case is None:
        return None
    return Member(names.index(name), case, name, case_name(record, case))
