"""Small sweeps with members of every kind, simulated and analysed whole or in parts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from vibsim import Experiment
from vibsim.analysis import analyse_parts, join_parts
from vibsim.core.record import Record, Variable

CHECKS: list[dict[str, Any]] = [
    {"converges": "theta"},
    {"converges": "omega", "norm": "linf", "order": 2, "tolerance": 0.05},
    {"converges": "energy_deviation", "expect": {"status": "FAIL"}},
    {"value": "period_error", "below": 0.01},
    {"value": "error_l1", "quantity": "omega", "at": {"level": "best"}, "below": 0.01},
    {"value": "error_estimate_defect", "quantity": "theta", "below": 0.02},
    {"value": "richardson_error", "quantity": "theta", "below": 1e-3},
    {"claim": "it stays", "that": {"value": "end", "quantity": "kinetic_energy", "below": 9}},
]


def of(sweep: Mapping[str, Any], **changes: Any) -> Experiment:
    data: dict[str, Any] = {
        "title": "sweep",
        "model": {"kind": "pendulum"},
        "initial": {"theta": 1.0, "omega": 0.0},
        "time": {"end": 20.0},
        "levels": [4, 5, 6, 7],
        "schemes": ["central", {"kind": "central", "label": "trap", "start": "first_order"}],
        "samples": "common",
        "sweep": sweep,
        "checks": CHECKS,
    }
    return Experiment.from_dict({**data, **changes})


SWEEPS = {
    # at rest below and above, swings, next to the separatrix, over the top
    "grid": of(
        {
            "initial.theta": [0.0, 1e-9, 1.0, 2.5, 3.1, 3.1415926, math.pi],
            "initial.omega": [0.0, 0.3, 2.0, -2.5],
        }
    ),
    # w dt from 0.1 to 140 at the coarsest level: some members break down
    "ends": of(
        {"time.end": [1.6, 16.0, 40.0, 2000.0], "model.L": [0.5, 1.0]},
        model={"kind": "linear_pendulum"},
    ),
    "options": of(
        {
            "schemes.central.arithmetic": ["compensated", "three_term"],
            "schemes.central.end_velocity": ["kick", "extrapolate", "backward"],
            "initial.theta": [0.5, 2.0],
        },
    ),
    "tolerance": of(
        {
            "initial.theta": [0.0, 1.0, 3.1415926],
            "schemes.central.end_velocity": ["kick", "extrapolate"],
        },
        levels=None,
        tolerance=1e-5,
    ).with_levels((4, 5, 6, 7)),
}


def cut(record: Record, start: int, stop: int) -> Record:
    """Return members start..stop-1 of a Record."""

    def part(table: Mapping[str, Variable]) -> dict[str, Variable]:
        return {name: _cut(variable, start, stop) for name, variable in table.items()}

    return Record(part(record.coords), part(record.variables), record.attrs)


def _cut(variable: Variable, start: int, stop: int) -> Variable:
    index = tuple(slice(start, stop) if d == "case" else slice(None) for d in variable.dims)
    return Variable(variable.dims, np.array(variable.values[index]), variable.attrs)


def in_parts(
    experiment: Experiment, records: Mapping[int, Record], size: int, processes: int = 1
) -> Record:
    readers = {
        level: lambda a, b, record=record: cut(record, a, b) for level, record in records.items()
    }
    return join_parts(list(analyse_parts(experiment, readers, size=size, processes=processes)))


def assert_same_bytes(found: Record, expected: Record) -> None:
    for table in ("coords", "variables"):
        a, b = getattr(found, table), getattr(expected, table)
        assert list(a) == list(b)
        for name in a:
            assert a[name].dims == b[name].dims, name
            assert a[name].values.dtype == b[name].values.dtype, name
            assert a[name].values.tobytes() == b[name].values.tobytes(), name
    assert dict(found.attrs) == dict(expected.attrs)
