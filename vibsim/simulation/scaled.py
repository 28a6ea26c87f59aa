"""Records of a run in characteristic units: without units, and with the factors that lead back."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from vibsim.core.record import Record, Variable

if TYPE_CHECKING:
    from vibsim.experiment import Experiment


TIMELESS = "time_units"
"""Attribute of a Record whose times have no unit although it is no scaled one."""


def in_scales(record: Record, experiment: Experiment) -> Record:
    """Return `record` with unit 1 and ``scale_<name>`` for every scale, where the run is a scaled one.

    Of a model that is dimensionless by itself the time has no unit either.
    """
    model = experiment.model.definition
    if experiment.scaling is None:
        return _timeless(record) if model.dimensionless else record
    units = {state.name: state.unit for state in model.states}
    units |= {output.name: output.unit for output in model.outputs}
    units |= {"t": "s", "energy": model.energy_unit}
    attrs: dict[str, Any] = dict(record.attrs)
    for name, scale in experiment.scaling.scales.items():
        attrs |= {f"scale_{name}": scale, f"scale_{name}_units": units[name]}
    return Record(_plain(record.coords), _plain(record.variables), attrs)


def has_time_unit(record: Record) -> bool:
    """Tell whether times have a unit: not those of a scaled run, nor of a model that is dimensionless by itself."""
    return not {"scale_t", TIMELESS} & record.attrs.keys()


def _timeless(record: Record) -> Record:
    timed = ("s", "rad s-1")
    attrs = {**record.attrs, TIMELESS: "1"}
    return Record(_plain(record.coords, timed), _plain(record.variables, timed), attrs)


def _plain(
    table: Mapping[str, Variable], units: Container[str] | None = None
) -> dict[str, Variable]:
    """Return the variables with unit 1 in place of their own: of any, or of some units."""
    return {
        name: replace(row, attrs={**row.attrs, "units": "1"})
        if "units" in row.attrs and (units is None or row.attrs["units"] in units)
        else row
        for name, row in table.items()
    }
