"""The units of the numbers of ``value`` checks, and of quantities in a convergence Record."""

from __future__ import annotations

import json
from collections.abc import Mapping

from vibsim.core.record import Record
from vibsim.experiment import Experiment
from vibsim.experiment.schema.checks import ValueCheck
from vibsim.experiment.value_names import OF_THE_SAME_KIND
from vibsim.simulation.scaled import has_time_unit

UNITS = "units_of_quantities"
"""Attribute with the units of quantities by name, as JSON, of a Record that holds verdicts but no quantities."""


def unit_of(experiment: Experiment, record: Record, check: ValueCheck) -> str:
    """Return the unit of the number of a check, such as ``rad s-1``; empty if it has none.

    A scaled run and a model without units have none, as the convergence Record shows.
    """
    time = "s" if has_time_unit(record) else ""
    position = experiment.model.definition.position
    return unit_of_number(check, _known_units(record), position, time)


def unit_of_number(check: ValueCheck, known: Mapping[str, str], position: str, time: str) -> str:
    """Return the unit of the number of a check from the units of quantities and time; empty if it has none."""
    measure = check.number.measure
    if check.take not in OF_THE_SAME_KIND:
        # swept values have other units, and directions have none
        return ""
    of_time = {"time": "s", "frequency": "rad s-1", "l1": "s", "l2": "sqrt(s)"}
    unit = of_time.get(measure, "") if time else ""
    if measure not in ("quantity", "l1", "l2", "position"):
        return unit
    owner = position if measure == "position" else check.quantity
    return f"{known.get(owner or '', '')} {unit}".strip()


def unit_of_quantity(record: Record, quantity: str) -> str:
    """Return the unit of a quantity; empty if it has none."""
    return _known_units(record).get(quantity, "")


def unit_of_norm(record: Record, quantity: str) -> str:
    """Return the unit of the L2 norm over time of a quantity; empty if it has none."""
    return f"{_known_units(record).get(quantity, '')} {'sqrt(s)' if has_time_unit(record) else ''}".strip()


def _known_units(record: Record) -> dict[str, str]:
    stored = record.attrs.get(UNITS)
    units: dict[str, str] = units_in(record) if stored is None else json.loads(str(stored))
    return units


def units_in(record: Record) -> dict[str, str]:
    """Return the units of all quantities of a convergence Record, to be stored as `UNITS`."""
    units: dict[str, str] = {}
    # at least one of these is stored for each quantity that a check may use
    for suffix in ("_end", "_floor", "_finest"):
        for name, variable in record.variables.items():
            if name.endswith(suffix):
                unit = str(variable.attrs.get("units", ""))
                units.setdefault(name.removesuffix(suffix), "" if unit == "1" else unit)
    return units
