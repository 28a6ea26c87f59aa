"""The values of one level with the names and coordinates of their dimensions, from any input that `judge` accepts."""

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
"""CF conventions: the unit of a dimensionless number."""


@dataclass(frozen=True)
class GridValues:
    """Values of one level."""

    values: Floats
    dims: tuple[str, ...]
    coords: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    """Numbers or labels, shape (length,), of each dimension that has coordinates."""
    name: str = ""
    epsilon: float = DOUBLE
    """Machine epsilon of the precision of the values."""
    units: str = ""
    """Unit from the attributes."""
    units_of_coords: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """Unit (empty if there is none) and calendar of each coordinate."""
    written: Decimal | None = None
    """A number with the digits that it was written with."""
    spacing: float = 0.0
    """Distance of neighbouring values if these were packed into integers; else 0."""
    file: str = ""
    """The file that the values come from, for messages."""

    def place(self, level: int) -> str:
        """Name the file, or else the position of the level from the coarsest one, from 0."""
        return self.file or f"level {level} (from the coarsest)"


def grid_values(value: Any, key: str) -> GridValues:
    """Return a number (a `Decimal` has its digits), a numpy array, an xarray object or `GridValues` as `GridValues`.

    Raises
    ------
    InputError
        If it is none of these, or does not hold real numbers.
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
        axes = {str(n): c for n, c in value.coords.items() if tuple(map(str, c.dims)) == (str(n),)}
        coords = {name: plain_coordinate(np.asarray(axes[name])) for name in dims if name in axes}
        numbers, epsilon = real(np.asarray(value), key)
        return GridValues(
            numbers,
            dims,
            coords,
            # xarray names an array of dask after its task
            "" if value.name == getattr(value.data, "name", None) else str(value.name or ""),
            epsilon,
            units_in(getattr(value, "attrs", {}))[0],
            {name: units_in(axes[name].attrs) for name in coords},
            spacing=spacing_in(getattr(value, "encoding", {})),
        )
    if hasattr(value, "iloc"):
        hint = "its index is a coordinate in value.to_xarray(), and left out in value.to_numpy()"
        raise refused(key, type(value).__name__, "must not be an object of pandas", hint)
    try:
        array = value if isinstance(value, np.ma.MaskedArray) else np.asarray(value)
    except ValueError:
        raise refused(key, value, "must be a number or an array of numbers") from None
    numbers, epsilon = real(array, key)
    return GridValues(numbers, tuple(f"axis {i}" for i in range(array.ndim)), {}, "", epsilon)


def units_in(attributes: Mapping[Any, Any]) -> tuple[str, str]:
    """Return the unit, empty if there is none, and the calendar from the attributes of a variable."""
    unit = str(attributes.get("units", ""))
    return ("" if unit == NO_UNIT else unit), str(attributes.get("calendar", "standard"))


def spacing_in(packing: Mapping[Any, Any]) -> float:
    """Return the distance of neighbouring values of a variable with this ``dtype`` and ``scale_factor`` in its file.

    It is 0 if the file does not hold integers that stand for other numbers.
    """
    scale = packing.get("scale_factor")
    if scale is None or np.dtype(packing.get("dtype", np.float64)).kind not in "iu":
        return 0.0
    return abs(float(np.asarray(scale).ravel()[0]))


def real(array: NDArray[Any], key: str) -> tuple[Floats, float]:
    """Return an array in double precision, and the machine epsilon of its original precision."""
    if array.dtype.kind == "c":
        raise refused(
            key, str(array.dtype), "must be real", "judge real and imaginary part separately"
        )
    if array.dtype.kind not in "fiu":
        shown = array.item() if array.size == 1 else f"type {array.dtype.name}"
        raise refused(key, shown, "must hold numbers")
    if array.size == 0:
        raise refused(key, f"shape {array.shape}", "must not be empty")
    is_float = array.dtype.kind == "f" and array.dtype.itemsize <= 8
    epsilon = float(np.finfo(array.dtype).eps) if is_float else DOUBLE
    return np.ma.filled(array.astype(np.float64), np.nan), epsilon


def plain_coordinate(coordinate: NDArray[Any]) -> NDArray[Any]:
    """Return a coordinate that can be compared: times become integers, all else is unchanged."""
    if coordinate.dtype.kind in "mM":
        unit = "timedelta64[ns]" if coordinate.dtype.kind == "m" else "datetime64[ns]"
        return coordinate.astype(unit).astype(np.int64)
    if coordinate.dtype == object and coordinate.size and hasattr(coordinate[0], "calendar"):
        import cftime

        return np.asarray(cftime.date2num(coordinate, "microseconds since 1970-01-01"))
    return coordinate
