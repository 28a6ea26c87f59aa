"""Whether level data belong together, and to the experiment: a comparison of strangers would still give numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.errors import VibsimError
from vibsim.core.record import Record
from vibsim.observe.thresholds import SAME_START

if TYPE_CHECKING:
    from vibsim.experiment import Experiment


SAME_AT_EVERY_LEVEL = frozenset({"natural_frequency", "exact_period"})
"""What the levels hold of every member and does not depend on the step."""


NEEDED = (
    "omega_dt",
    "natural_frequency",
    "status",
    "energy_initial",
    "period",
    "period_count",
    "first_peak",
    "last_peak",
)
"""What the analysis needs of every member at every level, besides the states and the extrema of the position."""


def check_belonging(experiment: Experiment, records: Mapping[int, Record]) -> None:
    """Refuse level Records that are not those of `experiment`, or not of one and the same problem.

    Raises
    ------
    VibsimError
        With every fault: a level that the experiment does not have, another model, other schemes, members, numbers of
        steps, end times or parameters than the other levels or the experiment, other values at t = 0, a variable that
        is missing.
    """
    faults = [
        f"level {level}: {fault}"
        for level, record in sorted(records.items())
        for fault in _faults(experiment, level, record, records[max(records)])
    ]
    if faults:
        raise VibsimError("levels that do not belong together:\n" + "\n".join(faults))


def _faults(experiment: Experiment, level: int, record: Record, other: Record) -> Iterator[str]:
    model = experiment.model.definition
    if level not in experiment.levels:
        yield f"the experiment has levels {list(experiment.levels)}"
        return
    steps = int(np.asarray(record.attrs["steps"]).item())
    if steps != experiment.steps(level):
        yield f"{steps} steps instead of {experiment.steps(level)}"
    if str(record.attrs.get("model", model.kind)) != model.kind:
        yield f"model {record.attrs['model']} instead of {model.kind}"
    names = [scheme.name for scheme in experiment.schemes]
    if record.words("scheme") != names:
        yield f"schemes {record.words('scheme')} instead of {names}"
        return
    if not np.array_equal(record["case"], other["case"]):
        yield "other members than the finest level"
        return
    position = model.position
    needed = [state.name for state in model.states]
    needed += [f"{position}_min", f"{position}_max", *NEEDED]
    missing = [name for name in needed if name not in record]
    if missing:
        yield f"{', '.join(missing)} {'are' if len(missing) > 1 else 'is'} missing"
        return
    for name in _of_members(record):
        if name not in other or not _equal(record, other, name):
            yield f"{name} differs from the finest level's"
    if not np.isclose(record["t"][-1], other["t"][-1], rtol=1e-12, atol=0.0):
        yield f"it ends at {record['t'][-1]:g}, the finest level at {other['t'][-1]:g}"
    for state in model.states:
        yield from _start(record, other, state.name)


def _of_members(record: Record) -> list[str]:
    """Name what belongs to a member and not to a level: parameters, period, end time."""
    constants = [name for name, variable in record.coords.items() if variable.dims == ("case",)]
    return [name for name in (*constants, *sorted(SAME_AT_EVERY_LEVEL)) if name in record]


def _equal(record: Record, other: Record, name: str) -> bool:
    a, b = record[name], other[name]
    return bool(np.array_equal(a, b, equal_nan=a.dtype.kind == b.dtype.kind == "f"))


def _start(record: Record, other: Record, name: str) -> Iterator[str]:
    compared = [(name, other, "the finest level's")]
    if f"{name}_exact" in record:
        compared.append((f"{name}_exact", record, "the exact solution's"))
    own = np.asarray(record[name], dtype=np.float64)
    for other_name, source, words in compared:
        known = np.asarray(source[other_name], dtype=np.float64)
        # a level that blows up is larger than the motion
        size = np.maximum(np.abs(known[..., 0]), np.fmin(_largest(own), _largest(known)))
        if np.any(np.abs(own[..., 0] - known[..., 0]) > SAME_START * size):
            yield f"{name} at t = 0 differs from {words}"


def _largest(values: Floats) -> Floats:
    """Return the largest absolute value over time; infinite where a level overflows, NaN where it has no value."""
    return np.asarray(np.fmax.reduce(np.abs(values), axis=-1))
