"""Conversion of coordinates to the units of the coarsest level: many programs choose the unit of times per file."""

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
"""Length of units of time [s], by their names in CF conventions and xarray."""
_ALIASES: Mapping[str, str] = MappingProxyType(
    {"gregorian": "standard", "365_day": "noleap", "366_day": "all_leap"}
)
"""Other names of calendars in CF conventions."""
SINCE = " since "
"""Separates the unit of a date from its reference date."""


def in_common_units(levels: Sequence[GridValues]) -> list[GridValues]:
    """Return the levels, the coarsest first, with all times converted to its units.

    Raises
    ------
    InputError
        If the values, or coordinates that are not times, differ in their units from the coarsest level.
    """
    first, converted = levels[0], []
    for i, level in enumerate(levels):
        if first.units and level.units and level.units != first.units:
            name = level.name or "values"
            raise _other_units(level.place(i), name, level.units, first.units)
        coords = dict(level.coords)
        for dim, unit in level.units_of_coords.items():
            common_unit = first.units_of_coords.get(dim, unit)
            if unit == common_unit or not (unit[0] and common_unit[0]):
                continue
            change = _change(unit, common_unit)
            if change is None:
                raise _other_units(level.place(i), dim, *map(_described, (unit, common_unit)))
            factor, shift = change
            coords[dim] = np.asarray(coords[dim], dtype=np.float64) * factor + shift
        converted.append(replace(level, coords=coords))
    return converted


def _change(unit: tuple[str, str], other: tuple[str, str]) -> tuple[float, float] | None:
    """Return the factor and the shift that convert times from a unit and calendar to another; None if impossible."""
    (length, _, date), (other_length, _, other_date) = (
        text.partition(SINCE) for text, _ in (unit, other)
    )
    seconds, other_seconds = (SECONDS.get(text.strip().lower()) for text in (length, other_length))
    calendar, other_calendar = (
        _ALIASES.get(name, name) for name in (unit[1].lower(), other[1].lower())
    )
    if seconds is None or other_seconds is None or calendar != other_calendar:
        return None
    later = _seconds_between(other_date.strip(), date.strip(), calendar)
    return None if later is None else (seconds / other_seconds, later / other_seconds)


def _seconds_between(first: str, second: str, calendar: str) -> float | None:
    """Return the second date minus the first [s]; None if one of them is not a date of the calendar."""
    if first == second:
        return 0.0
    if not (first and second):
        return None
    import cftime

    try:
        begin, end = (
            cftime.num2date(0, f"seconds{SINCE}{date}", calendar) for date in (first, second)
        )
    except (KeyError, OverflowError, ValueError):
        return None
    return float((end - begin).total_seconds())


def _described(unit: tuple[str, str]) -> str:
    """Return a unit, that of dates with its calendar."""
    return f"{unit[0]} (calendar {unit[1]})" if SINCE in unit[0] else unit[0]


def _other_units(place: str, name: str, units: str, coarsest: str) -> Exception:
    rule = f"has the unit {units}, the coarsest level has {coarsest}"
    return refused(place, name, rule, "give all levels the same units")
