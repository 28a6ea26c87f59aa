"""The sweep section: parameters that vary, counted before they are written out."""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from typing import Any

from vibsim.errors import nearest
from vibsim.models import Model, Parameter
from vibsim.spec.document import Linspace, TimeSection
from vibsim.spec.experiment import TimeSpec
from vibsim.spec.faults import Report
from vibsim.spec.members import end_varies

_FIXED = {
    "levels": "levels cannot be swept: they are what is compared",
    "time.base_steps": "step counts cannot be swept: every member has the same steps",
    "time.base_dt": "step counts cannot be swept: every member has the same steps",
    "time.steps_per_period": "step counts cannot be swept: every member has the same steps",
    "time.periods": "step counts cannot be swept: every member has the same steps",
}


@dataclass(frozen=True)
class Axis:
    """One swept parameter, as written."""

    key: str
    values: tuple[float, ...] | Linspace

    def __len__(self) -> int:
        return len(self.values) if isinstance(self.values, tuple) else self.values.linspace[2]

    @property
    def ends(self) -> tuple[float, ...]:
        """Values that have the least and the largest among them."""
        return self.values if isinstance(self.values, tuple) else self.values.linspace[:2]


def axes(
    section: dict[str, Any], time: TimeSection | None, model: Model | None, report: Report
) -> tuple[Axis, ...]:
    """Check the sweep's keys and the bounds of its values; nothing is written out."""
    known = known_keys(model)
    for key, values in section.items():
        path = ("sweep", key)
        if key in _FIXED or key.split(".")[0] == "levels":
            report.add(path, _FIXED.get(key, _FIXED["levels"]), at_key=True)
        elif model is not None and key not in known:
            report.add(path, "cannot be swept", nearest(key, known), at_key=True)
        elif key == "time.end" and time is not None and (time.end is None or time.base_dt):
            rule = "the end can be swept only where time has an end, and base_steps if anything"
            report.add(path, rule, at_key=True)
        if isinstance(values, Linspace) and values.linspace[2] < 2:
            rule = "linspace needs at least 2 values"
            report.add((*path, "linspace", 2), rule, "give a single value as a list")
        _check_bounds(path, values, _bound(key, model), report)
    return tuple(Axis(key, values) for key, values in section.items())


def known_keys(model: Model | None) -> list[str]:
    """Name everything that can be swept."""
    if model is None:
        return ["time.end"]
    states = (f"initial.{state.name}" for state in model.states)
    return [*states, *(f"model.{row.name}" for row in model.parameters), "time.end"]


def _bound(key: str, model: Model | None) -> Parameter | None:
    if key == "time.end":
        return Parameter("end", 1.0, "s", "", minimum=0.0, exclusive=True)
    rows = {f"model.{row.name}": row for row in model.parameters} if model else {}
    return rows.get(key)


def _check_bounds(
    path: tuple[str, str], values: Any, row: Parameter | None, report: Report
) -> None:
    if row is None or row.minimum is None:
        return
    # a line is as far down as its lower end
    ends = values.linspace[:2] if isinstance(values, Linspace) else values
    inner = (*path, "linspace") if isinstance(values, Linspace) else path
    for i, value in enumerate(ends):
        if value < row.minimum or (row.exclusive and value == row.minimum):
            word = "greater than" if row.exclusive else "at least"
            report.add((*inner, i), f"must be {word} {row.minimum:g}", value=value)


def count(found: tuple[Axis, ...]) -> int:
    """Return the number of members, 1 without a sweep."""
    return prod(len(axis) for axis in found)


def fixed_end(found: tuple[Axis, ...], time: TimeSpec) -> float | None:
    """Return the end that every member has, None where the end varies."""
    swept = ((axis.key, min(axis.ends) < max(axis.ends)) for axis in found)
    if end_varies(swept, time.periods is not None):
        return None
    return next((axis.ends[0] for axis in found if axis.key == "time.end"), time.end)


def expand(found: tuple[Axis, ...]) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """Write every axis out."""
    return tuple(
        (axis.key, axis.values if isinstance(axis.values, tuple) else line(*axis.values.linspace))
        for axis in found
    )


def line(first: float, last: float, n: int) -> tuple[float, ...]:
    """Return n equally spaced values, ``first + (last - first)*i/(n - 1)``, with exact ends."""
    span, parts = last - first, n - 1
    return (*(first + span * i / parts for i in range(parts)), last)
