"""Coordinates whose unit differs from level to level, as programs choose it for each file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray

from vibsim.convergence import judge
from vibsim.core.errors import InputError
from vibsim.experiment.schema.solver import QuantitySection
from vibsim.solver import level_output

STEPS = [60.0, 30.0, 15.0, 5.0]
RATE = 1.0 / 3600.0
BEGIN = np.datetime64("2000-01-01", "ns")


def euler(dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and values of Euler's method for u' = -u/3600 s over two hours."""
    n = round(7200.0 / dt)
    return dt * np.arange(n + 1), (1.0 - dt * RATE) ** np.arange(n + 1)


def level(dt: float, unit: str, seconds: float, later: float = 0.0) -> xarray.DataArray:
    """Return a level with times in a unit of so many seconds, counted from a date that comes so much later."""
    t, u = euler(dt)
    return xarray.DataArray(u, {"t": ("t", (t - later) / seconds, {"units": unit})}, ["t"])


def error_at_all_points(dt: float) -> float:
    t, u = euler(dt)
    every = round(STEPS[0] / dt)
    return float(np.sqrt(np.mean((u - np.exp(-RATE * t))[::every] ** 2)))


@pytest.mark.parametrize(
    "units",
    [
        [("min", 60.0), ("s", 1.0), ("seconds", 1.0), ("ms", 1e-3)],
        [("hours since 2000-01-01", 3600.0), *[("seconds since 2000-01-01", 1.0)] * 3],
        [
            *[("days since 2000-01-01", 86400.0)] * 3,
            ("minutes since 1999-12-31 12:00:00", 60.0, -43200.0),
        ],
    ],
    ids=["durations", "dates", "references"],
)
def test_times_in_several_units_are_compared_at_the_same_time(units: list[tuple]) -> None:
    levels = [level(dt, *unit) for dt, unit in zip(STEPS, units, strict=True)]
    found = judge(STEPS, levels, order=1)
    assert found.status == "PASS"
    assert found.error == pytest.approx(error_at_all_points(STEPS[-1]), rel=0.02)
    assert len(found.coords["t"]) == 121


def test_dates_that_xarray_writes_are_compared_through_stored_levels(tmp_path: Path) -> None:
    wanted, levels = {"u": QuantitySection(coordinates=("time",))}, []
    for i, dt in enumerate(STEPS):
        t, u = euler(dt)
        times = BEGIN + (1e9 * t).astype("timedelta64[ns]")
        file = tmp_path / f"{i}.nc"
        xarray.Dataset({"u": ("time", u)}, {"time": times}).to_netcdf(file)
        levels.append(level_output.read(file, wanted)["u"])
    assert len({one.units_of_coords["time"] for one in levels}) > 1
    found = judge(STEPS, levels, order=1)
    assert found.error == pytest.approx(error_at_all_points(STEPS[-1]), rel=0.02)


@pytest.mark.parametrize(
    ("calendar", "date", "days"),
    [
        ("noleap", "2000-3-1", 59),
        ("365_day", "2000-03-01 00:00:00 UTC", 59),
        ("360_day", "2000-02-30T00:00:00Z", 59),
        ("gregorian", "2000-03-01 02:00:00 +02:00", 60),
    ],
)
def test_dates_count_in_their_calendar(
    recwarn: pytest.WarningsRecorder, calendar: str, date: str, days: int
) -> None:
    levels = [level(dt, "days since 2000-01-01", 86400.0) for dt in STEPS]
    levels[1:] = [level(dt, f"days since {date}", 86400.0, days * 86400.0) for dt in STEPS[1:]]
    for one in levels:
        one.t.attrs["calendar"] = calendar
    found = judge(STEPS, levels, order=1)
    assert len(found.coords["t"]) == 121
    assert found.error == pytest.approx(error_at_all_points(STEPS[-1]), rel=0.02)
    assert not recwarn.list
    levels[0].t.attrs["calendar"] = "julian"
    rule = (
        rf"\(calendar {calendar}\), the coarsest level has days since 2000-01-01 \(calendar julian"
    )
    with pytest.raises(InputError, match=rule):
        judge(STEPS, levels)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("km", "m"),
        ("s", "seconds since 2000-01-01"),
        ("days since 2000-01-01", "days since the flood"),
        ("months since 2000-01-01", "days since 2000-01-01"),
    ],
)
def test_other_units_are_refused(first: str, second: str) -> None:
    levels = [level(dt, first if dt == STEPS[0] else second, 1.0) for dt in STEPS]
    with pytest.raises(
        InputError, match=f"t: has the unit {second}.*, the coarsest level has {first}"
    ):
        judge(STEPS, levels)


def test_values_in_other_units_are_refused() -> None:
    levels = [level(dt, "s", 1.0).assign_attrs(units="K") for dt in STEPS]
    levels[1].attrs["units"] = "degC"
    with pytest.raises(InputError, match="values: has the unit degC, the coarsest level has K"):
        judge(STEPS, levels)
