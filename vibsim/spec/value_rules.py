"""What a value must be besides well-formed, wherever it is asked for: in a check, or in a printed table."""

from __future__ import annotations

from vibsim.errors import nearest
from vibsim.spec.check_places import Ladder
from vibsim.spec.faults import Report
from vibsim.spec.quantity_rules import (
    allowed,
    known_by_theory,
    known_exactly,
    known_in_exact_numbers,
    one_of,
)
from vibsim.spec.source import Path_
from vibsim.spec.values import VALUES, Value


def known_value(name: str, path: Path_, report: Report) -> Value | None:
    """Return the value of a name; None, and a fault, where there is none."""
    row = VALUES.get(name)
    if row is None:
        report.add(path, "unknown value", nearest(name, list(VALUES)), name)
    return row


def value_of(
    row: Value, quantity: str | None, best: bool, path: Path_, ladder: Ladder, report: Report
) -> None:
    """Check which quantity the value at `path` is of, and that the model knows what it is compared with.

    Parameters
    ----------
    path
        Of the mapping with the keys ``value`` and ``quantity``.
    best
        Whether it is of the extrapolated solution.
    """
    if row.of != "none":
        _of(row, quantity, best, path, ladder, report)
    elif quantity is not None:
        rule = f"{row.name} is of the motion as a whole and takes no quantity"
        report.add((*path, "quantity"), rule, at_key=True)
    needs(row, quantity, (*path, "value"), ladder, report)


def _of(
    row: Value, quantity: str | None, best: bool, path: Path_, ladder: Ladder, report: Report
) -> None:
    choices = allowed(row, ladder, best)
    if quantity is None:
        rule = f"required key is missing: {row.name} is of a quantity"
        report.add((*path, "quantity"), rule, "choose from " + ", ".join(choices))
    else:
        one_of(quantity, choices, (*path, "quantity"), ladder, report, row.name)


def needs(row: Value, quantity: str | None, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check that the model knows exactly what the value at `path` is compared with."""
    model = ladder.model
    if model is None:
        return
    if row.needs_exact == "period" and model.exact_period is None:
        report.add(path, f"the exact period of {model.kind} is not known", value=row.name)
    if row.needs_exact == "solution":
        known_exactly(quantity, row.name, path, ladder, report)
    if row.needs_events and model.events is None:
        report.add(path, f"{model.kind} has no events: its motion is smooth", value=row.name)
    if row.needs_rational:
        known_in_exact_numbers(row.name, path, ladder, report)
    if row.needs_linear:
        known_by_theory(row.name, path, ladder, report)
