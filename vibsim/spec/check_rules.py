"""What a check must be besides well-formed: it names what the experiment has."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from vibsim.errors import nearest
from vibsim.models import Model, quantities
from vibsim.spec.check_places import (
    Ladder,
    check_anywhere,
    check_place,
    is_faulty,
    known_scheme,
)
from vibsim.spec.checks import Check, ClaimCheck, ConvergesCheck, ValueCheck
from vibsim.spec.faults import Report
from vibsim.spec.source import Path_
from vibsim.spec.values import VALUES, Value
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
    measured = check.measured
    if isinstance(measured, ConvergesCheck):
        _converges(measured, path, ladder, report)
    else:
        _value(measured, path, ladder, report)


def _converges(check: ConvergesCheck, path: Path_, ladder: Ladder, report: Report) -> None:
    _quantity(check.converges, (*path, "converges"), ladder, report)
    for i, name in enumerate(check.schemes or ()):
        known_scheme(name, (*path, "schemes", i), ladder, report)
        if name in (check.schemes or ())[:i]:
            report.add((*path, "schemes", i), "a scheme must not be repeated", value=name)
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


def _quantity(name: str, path: Path_, ladder: Ladder, report: Report) -> None:
    if ladder.model is not None and name not in quantities(ladder.model):
        report.add(path, "unknown quantity", nearest(name, quantities(ladder.model)), name)


def _value(check: ValueCheck, path: Path_, ladder: Ladder, report: Report) -> None:
    _comparison(check, path, report)
    row = VALUES.get(check.value)
    if row is None:
        report.add(
            (*path, "value"), "unknown value", nearest(check.value, list(VALUES)), check.value
        )
        check_anywhere(check.at, (*path, "at"), ladder, report)
        return
    _of(check, row, path, ladder, report)
    _exact(check, row, path, ladder, report)
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


def _of(check: ValueCheck, row: Value, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check which quantity a value is of."""
    if row.of == "none":
        if check.quantity is not None:
            rule = f"{row.name} is of the motion as a whole and takes no quantity"
            report.add((*path, "quantity"), rule, at_key=True)
        return
    choices = allowed(row, ladder.model, check.at.level == "best")
    if check.quantity is None:
        rule = f"required key is missing: {row.name} is of a quantity"
        report.add((*path, "quantity"), rule, "choose from " + ", ".join(choices))
    elif choices and check.quantity not in choices:
        known = ladder.model is not None and check.quantity in quantities(ladder.model)
        rule = f"{row.name} is not known of this quantity" if known else "unknown quantity"
        hint = "choose from " + ", ".join(choices) if known else nearest(check.quantity, choices)
        report.add((*path, "quantity"), rule, hint, check.quantity)


def _exact(check: ValueCheck, row: Value, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check that the model knows exactly what the value is compared with."""
    model = ladder.model
    if model is None or row.needs_exact is None:
        return
    if row.needs_exact == "period" and model.exact_period is None:
        report.add((*path, "value"), f"the exact period of {model.kind} is not known")
    # the energy is known where it is conserved, and nowhere else
    energies = ("energy", "energy_deviation")
    known = model.conservative if check.quantity in energies else model.exact is not None
    if row.needs_exact == "solution" and not known:
        hint = f"{' and '.join(energies)} are" if model.conservative else ""
        rule = f"the exact {check.quantity or 'solution'} of {model.kind} is not known"
        report.add((*path, "value"), rule, hint)


def allowed(row: Value, model: Model | None, best: bool = False) -> tuple[str, ...]:
    """Name the quantities of `model` that `row` can be of; `best`: of the extrapolated solution."""
    if model is None or row.of == "none":
        return ()
    states = tuple(state.name for state in model.states)
    if row.of == "states":
        return states
    if row.of == "deviation":
        return ("energy_deviation",)
    if row.of == "extremal":
        return (*states, "energy_deviation")
    if row.of == "convergent" or best:
        return (*states, "energy", "energy_deviation")
    return quantities(model)
