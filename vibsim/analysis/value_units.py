"""The unit of a number that a ``value`` check asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.record import Record
from vibsim.spec.values import VALUES

if TYPE_CHECKING:
    from vibsim.spec import Experiment
    from vibsim.spec.checks import ValueCheck


def unit_of(experiment: Experiment, record: Record, check: ValueCheck) -> str:
    """Return the unit of the number of a check, such as ``rad s-1``; empty where it has none.

    Parameters
    ----------
    record
        Convergence Record: a scaled run, and a model without units, have none.
    """
    time = "" if {"scale_t", "time_units"} & record.attrs.keys() else "s"
    match VALUES[check.value].measure:
        case "quantity":
            return _of(record, check.quantity)
        case "l1" | "l2" as norm:
            extra = {"l1": time, "l2": f"sqrt({time})" if time else ""}[norm]
            return f"{_of(record, check.quantity)} {extra}".strip()
        case "time":
            return time
        case "frequency":
            return "rad s-1" if time else ""
        case "position":
            return _of(record, experiment.model.definition.position)
    return ""


def _of(record: Record, quantity: str | None) -> str:
    """Return the unit of a quantity."""
    for end in ("end", "difference_norm", "finest"):
        if f"{quantity}_{end}" in record:
            found = str(record.variable(f"{quantity}_{end}").attrs.get("units", ""))
            return "" if found == "1" else found
    return ""
