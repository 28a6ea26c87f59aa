"""Labelled arrays in memory, without xarray.

Jobs use plain arrays, because importing xarray costs more than a short simulation. A `Record` has the content of an
`xarray.Dataset` (dimensions, coordinates, variables, attributes), and can be converted to one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray

Attribute = str | int | float | list[int] | list[float] | NDArray[Any]


@dataclass(frozen=True)
class Variable:
    """An array with the names of its dimensions and its attributes (``long_name``, ``units``, ...)."""

    dims: tuple[str, ...]
    values: NDArray[Any]
    attrs: Mapping[str, Attribute] = field(default_factory=dict)
    group: str = ""
    """The netCDF group of the variable; empty for the root."""

    def __post_init__(self) -> None:
        if len(self.dims) != np.ndim(self.values):
            raise ValueError(
                f"{len(self.dims)} names {self.dims} for {np.ndim(self.values)} dimensions"
            )

    @classmethod
    def of(
        cls, dims: tuple[str, ...], values: NDArray[Any], words: str, units: str = "1", **more: Any
    ) -> Variable:
        """Return a variable with `words` as its ``long_name``; `more` are further attributes."""
        return cls(dims, values, attributes(words, units, **more))


def attributes(long_name: str, units: str, **more: Any) -> dict[str, Any]:
    """Return the attributes of a variable."""
    return {"long_name": long_name, "units": units, **more}


def flags(words: Sequence[str]) -> dict[str, Any]:
    """Return the additional attributes of a variable that holds indices into a list of words."""
    return {"flag_values": np.arange(len(words), dtype=np.int8), "flag_meanings": " ".join(words)}


@dataclass(frozen=True)
class Record:
    """Coordinates, variables and attributes that belong together."""

    coords: Mapping[str, Variable]
    variables: Mapping[str, Variable]
    attrs: Mapping[str, Attribute] = field(default_factory=dict)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the values of the variable or coordinate `name`."""
        return self.variable(name).values

    def variable(self, name: str) -> Variable:
        """Return the variable or coordinate `name`."""
        return self.variables[name] if name in self.variables else self.coords[name]

    def words(self, name: str) -> list[str]:
        """Return a coordinate of strings (schemes, norms, checks), also where a file has bytes."""
        entries = self[name].tolist()
        return [entry.decode() if isinstance(entry, bytes) else str(entry) for entry in entries]

    def meanings(self, name: str) -> dict[int, str]:
        """Return the word for every value of a flag variable."""
        attrs = self.variable(name).attrs
        values = np.ravel(np.asarray(attrs["flag_values"])).tolist()
        return dict(zip(values, str(attrs["flag_meanings"]).split(), strict=True))

    def whole(self, name: str) -> int:
        """Return an attribute that is an integer, also where a file has an array."""
        return int(np.asarray(self.attrs[name]).item())

    def place(self, dim: str, value: int) -> int:
        """Return the index of a value in a coordinate of whole numbers."""
        return int(np.flatnonzero(np.asarray(self[dim]) == value)[0])

    def step(self, level: int, case: int) -> float:
        """Return dt of a member at a level [s], both given by index, from a convergence Record."""
        dt = np.asarray(self["dt"])[level]
        return float(dt[case] if dt.ndim else dt)

    def __contains__(self, name: str) -> bool:
        return name in self.variables or name in self.coords

    @property
    def sizes(self) -> dict[str, int]:
        """Length of every dimension."""
        sizes: dict[str, int] = {}
        for name, variable in (*self.coords.items(), *self.variables.items()):
            for dim, size in zip(variable.dims, np.shape(variable.values), strict=True):
                if sizes.setdefault(dim, size) != size:
                    raise ValueError(
                        f"{name}: dimension {dim} has {size} points, elsewhere {sizes[dim]}"
                    )
        return sizes

    def to_xarray(self) -> xarray.Dataset:
        """Return the same content as an `xarray.Dataset`, without copying the arrays."""
        import xarray

        def convert(table: Mapping[str, Variable]) -> dict[str, xarray.Variable]:
            return {n: xarray.Variable(v.dims, v.values, dict(v.attrs)) for n, v in table.items()}

        return xarray.Dataset(convert(self.variables), convert(self.coords), dict(self.attrs))

    @staticmethod
    def from_xarray(dataset: xarray.Dataset) -> Record:
        """Return the content of `dataset`, without copying the arrays."""
        convert = {
            str(name): Variable(tuple(map(str, array.dims)), array.values, dict(array.attrs))
            for name, array in dataset.variables.items()
        }
        coords = {name: convert.pop(name) for name in map(str, dataset.coords)}
        return Record(coords, convert, dict(dataset.attrs))
