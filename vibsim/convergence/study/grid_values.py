"""The values of one level with the names of their dimensions and their coordinates, whatever a user gave them as."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.convergence.study.refusal import refused
from vibsim.core.array_types import Floats

DOUBLE = float(np.finfo(np.float64).eps)
NO_UNIT = "1"
"""The unit of a number without one, by CF conventions."""


@dataclass(frozen=True)
class GridValues:
    """Values of one level."""

    values: Floats
    dims: tuple[str, ...]
    coords: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    """Of those dimensions that have coordinates, shape (length,): numbers, or labels."""
    name: str = ""
    epsilon: float = DOUBLE
    """Distance of neighbouring numbers near 1 in the precision that the values were computed in."""
    units: str = ""
    """As the user gave them."""
    units_of_coords: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """Empty of coordinates without one; with the calendar of dates."""
    written: Decimal | None = None
    """A number with the digits that it was written with."""


def grid_values(value: Any, key: str) -> GridValues:
    """Return a number (a `Decimal` has its digits), a numpy array, an xarray object or `GridValues` as `GridValues`.

    Raises
    ------
    InputError
        Where it is none of them, or does not hold real numbers.
    """
    if isinstance(value, GridValues):
        return value
    if isinstance(value, Decimal):
        number = np.array(np.nan if value.is_nan() else float(value))
        return GridValues(number, (), written=value)
    if hasattr(value, "data_vars"):
        names = list(value.data_vars)
        if len(names) != 1:
            rule = f"is a dataset of {len(names)} variables"
            raise refused(key, str(names), rule, "give one of them, as dataset[name]")
        value = value[names[0]]
    if hasattr(value, "dims") and hasattr(value, "coords"):
        dims = tuple(map(str, value.dims))
        own = {str(n): c for n, c in value.coords.items() if tuple(map(str, c.dims)) == (str(n),)}
        coords = {name: plain_coordinate(np.asarray(own[name])) for name in dims if name in own}
        numbers, epsilon = real(np.asarray(value), key)
        return GridValues(
            numbers,
            dims,
            coords,
            str(value.name or ""),
            epsilon,
            units_in(getattr(value, "attrs", {}))[0],
            {name: units_in(own[name].attrs) for name in coords},
        )
    try:
        array = value if isinstance(value, np.ma.MaskedArray) else np.asarray(value)
    except ValueError:
        raise refused(key, value, "must be a number or an array of numbers") from None
    numbers, epsilon = real(array, key)
    return GridValues(numbers, tuple(f"axis {i}" for i in range(array.ndim)), {}, "", epsilon)


def units_in(attributes: Mapping[Any, Any]) -> tuple[str, str]:
    """Return unit and calendar of a variable with these attributes; empty without a unit."""
    unit = str(attributes.get("units", ""))
    return ("" if unit == NO_UNIT else unit), str(attributes.get("calendar", "standard"))


def real(array: NDArray[Any], key: str) -> tuple[Floats, float]:
    """Return an array as double-precision numbers, and the relative spacing of the precision that it had."""
    if array.dtype.kind == "c":
        raise refused(
            key, str(array.dtype), "must be real", "judge real and imaginary part separately"
        )
    if array.dtype.kind not in "fiu":
        raise refused(key, array.dtype.name, "must hold numbers")
    if array.size == 0:
        raise refused(key, f"shape {array.shape}", "must not be empty")
    of_floats = array.dtype.kind == "f" and array.dtype.itemsize <= 8
    epsilon = float(np.finfo(array.dtype).eps) if of_floats else DOUBLE
    return np.ma.filled(array.astype(np.float64), np.nan), epsilon


def plain_coordinate(coordinate: NDArray[Any]) -> NDArray[Any]:
    """Return a coordinate as numbers: times in nanoseconds, so that they can be compared; labels stay as they are."""
    if coordinate.dtype.kind in "mM":
        unit = "timedelta64[ns]" if coordinate.dtype.kind == "m" else "datetime64[ns]"
        return coordinate.astype(unit).astype(np.int64)
    return coordinate
