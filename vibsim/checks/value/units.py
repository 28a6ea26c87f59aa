"""The unit of a number that a ``value`` check asks for."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from vibsim.core.record import Record
from vibsim.experiment.value_names import VALUES
from vibsim.simulation.scaled import has_time_unit

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import ValueCheck


UNITS = "units_of_quantities"
"""Attribute of a Record that holds verdicts and no quantities: their units by name, as JSON."""
_ENDS = ("end", "difference_norm", "finest")
"""What is stored of every quantity that a check may ask for, one of these at least."""


def unit_of(experiment: Experiment, record: Record, check: ValueCheck) -> str:
    """Return the unit of the number of a check, such as ``rad s-1``; empty where it has none.

    Parameters
    ----------
    record
        Convergence Record: a scaled run, and a model without units, have none.
    """
    time = "s" if has_time_unit(record) else ""
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


def units_in(record: Record) -> dict[str, str]:
    """Return the units of all quantities of a convergence Record, for one that keeps `UNITS` in place of them."""
    found: dict[str, str] = {}
    for end in _ENDS:
        for name, variable in record.variables.items():
            if name.endswith(f"_{end}"):
                unit = str(variable.attrs.get("units", ""))
                found.setdefault(name.removesuffix(f"_{end}"), "" if unit == "1" else unit)
    return found


def _of(record: Record, quantity: str | None) -> str:
    """Return the unit of a quantity."""
    told = record.attrs.get(UNITS)
    known = units_in(record) if told is None else json.loads(str(told))
    return str(known.get(quantity or "", ""))
