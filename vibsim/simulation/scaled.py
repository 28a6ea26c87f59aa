"""Records of a run in characteristic units: dimensionless, with the scales as attributes."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from vibsim.core.record import Record, Variable

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

TIMELESS = "time_units"
"""Attribute of a Record whose time is dimensionless although the run is not scaled."""


def in_scales(record: Record, experiment: Experiment) -> Record:
    """Return `record`, if the run is scaled with unit 1 and an attribute ``scale_<name>`` for every scale.

    For a dimensionless model the time has unit 1 as well.
    """
    model = experiment.model.definition
    if experiment.scaling is None:
        timed = ("s", "rad s-1")
        return _plain(record, {TIMELESS: "1"}, timed) if model.dimensionless else record
    units = {row.name: row.unit for row in model.states}
    units |= {row.name: row.unit for row in model.outputs}
    units |= {"t": "s", "energy": model.energy_unit}
    attrs: dict[str, Any] = {}
    for name, scale in experiment.scaling.scales.items():
        attrs |= {f"scale_{name}": scale, f"scale_{name}_units": units[name]}
    return _plain(record, attrs)


def has_time_unit(record: Record) -> bool:
    """Tell whether times have a unit: not in a scaled run, and not for a dimensionless model."""
    return not {"scale_t", TIMELESS} & record.attrs.keys()


def _plain(record: Record, attrs: Mapping[str, Any], units: Container[str] | None = None) -> Record:
    """Return a record with further attributes, and unit 1 in place of `units` (None: of any unit)."""

    def plain(row: Variable) -> Variable:
        if "units" not in row.attrs or (units is not None and row.attrs["units"] not in units):
            return row
        return replace(row, attrs={**row.attrs, "units": "1"})

    coords, variables = (
        {name: plain(row) for name, row in table.items()}
        for table in (record.coords, record.variables)
    )
    return Record(coords, variables, {**record.attrs, **attrs})
