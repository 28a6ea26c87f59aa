"""Records of a run in characteristic units: without units, and with the factors that lead back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from vibsim.record import Record, Variable

if TYPE_CHECKING:
    from vibsim.spec import Experiment


def in_scales(record: Record, experiment: Experiment) -> Record:
    """Return `record` with unit 1 and ``scale_<name>`` for every scale, where the run is a scaled one."""
    if experiment.scaling is None:
        return record
    model = experiment.model.definition
    units = {state.name: state.unit for state in model.states}
    units |= {output.name: output.unit for output in model.outputs}
    units |= {"t": "s", "energy": model.energy_unit}
    attrs: dict[str, Any] = dict(record.attrs)
    for name, scale in experiment.scaling.scales.items():
        attrs |= {f"scale_{name}": scale, f"scale_{name}_units": units[name]}
    return Record(_plain(record.coords), _plain(record.variables), attrs)


def _plain(table: Mapping[str, Variable]) -> dict[str, Variable]:
    return {
        name: replace(row, attrs={**row.attrs, "units": "1"}) if "units" in row.attrs else row
        for name, row in table.items()
    }
