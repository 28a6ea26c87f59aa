"""Coordinates of all levels in the unit of the coarsest one: many programs choose that of times for each file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from vibsim.convergence.study.grid_values import GridValues
from vibsim.convergence.study.refusal import refused

_NAMES = {
    **{1e-9: "ns nanosecond", 1e-6: "us microsecond", 1e-3: "ms millisecond"},
    **{1.0: "s sec second", 60.0: "min minute", 3600.0: "h hr hour", 86400.0: "d day"},
}
SECONDS: Mapping[str, float] = MappingProxyType(
    {
        f"{name}{end}": length
        for length, names in _NAMES.items()
        for name in names.split()
        for end in ("", "s")
    }
)
"""Seconds of a unit of time, by the names that CF conventions and xarray give it."""
SINCE = " since "
"""Between the unit of a date and the date that it is counted from."""


def in_common_units(levels: Sequence[GridValues]) -> list[GridValues]:
    """Return levels, the coarsest first, with coordinates in its units: times are converted.

    Raises
    ------
    InputError
        Where other coordinates, or the values, have other units than those of the coarsest level.
    """
    first, found = levels[0], []
    for i, level in enumerate(levels):
        if first.units and level.units and level.units != first.units:
            raise _other_units(i, level.name or "values", level.units, first.units)
        coords = dict(level.coords)
        for dim, unit in level.units_of_coords.items():
            of_first = first.units_of_coords.get(dim, unit)
            if unit == of_first or not (unit[0] and of_first[0]):
                continue
            change = _change(unit, of_first)
            if change is None:
                raise _other_units(i, dim, unit[0], of_first[0])
            factor, shift = change
            coords[dim] = np.asarray(coords[dim], dtype=np.float64) * factor + shift
        found.append(replace(level, coords=coords))
    return found


def _change(unit: tuple[str, str], other: tuple[str, str]) -> tuple[float, float] | None:
    """Return by which factor and then by how much times change from a unit, with its calendar, to another; or None."""
    (length, _, date), (other_length, _, other_date) = (
        text.partition(SINCE) for text, _ in (unit, other)
    )
    seconds, of_other = (SECONDS.get(text.strip().lower()) for text in (length, other_length))
    later = _seconds_between(other_date.strip(), date.strip())
    if seconds is None or of_other is None or later is None or unit[1] != other[1]:
        return None
    return seconds / of_other, later / of_other


def _seconds_between(first: str, second: str) -> float | None:
    """Return how many seconds later the second date is; None where one of them is no date."""
    if first == second:
        return 0.0
    if not (first and second):
        return None
    try:
        return float(
            (np.datetime64(second, "us") - np.datetime64(first, "us")) / np.timedelta64(1, "s")
        )
    except ValueError:
        return None


def _other_units(level: int, name: str, units: str, of_first: str) -> Exception:
    rule = f"has the unit {units}, the coarsest level has {of_first}"
    return refused(
        f"level {level} (from the coarsest)", name, rule, "give all levels the same units"
    )
