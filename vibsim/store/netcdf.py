"""Records as netCDF files: CF conventions, no clock time, the same bytes for the same content.

The data are contiguous and uncompressed: measured, compression takes ten times as long and saves a
quarter of the space. Each file says which job made it (``digest``) and from what (``provenance``),
and ends with a seal over all its bytes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim import __version__
from vibsim.errors import DamagedFileError
from vibsim.record import Attribute, Record, Variable
from vibsim.store import identity, seal
from vibsim.store.atomic import replacing
from vibsim.vocabulary import FORMAT

CONVENTIONS = "CF-1.11"
_OURS = (
    *("Conventions", "history", "vibsim_format", "digest", "provenance", "integrity"),
    "coordinates",
)


def write(path: Path, record: Record, *, digest: str, provenance: Mapping[str, Any]) -> None:
    """Write `record` to the netCDF file `path`, in one step.

    Parameters
    ----------
    path
        The target; the old file stays until the new one is whole.
    record
        What to store. Each variable needs a ``long_name``, each but texts and flags also
        ``units``; the attributes need a ``title``.
    digest
        Digest of the job that made the record.
    provenance
        What the job used, JSON-able.

    Raises
    ------
    ValueError
        When a name, a unit or the title is missing, or when values have no netCDF type.
    """
    import netCDF4

    if not record.attrs.get("title"):
        raise ValueError(f"{path.name}: a stored record needs a title")
    with replacing(path) as temporary:
        with netCDF4.Dataset(temporary, "w", format="NETCDF4") as dataset:
            dataset.set_fill_off()
            dataset.setncatts(_global_attributes(record, digest, provenance))
            for name, size in record.sizes.items():
                dataset.createDimension(name, size)
            for name, variable in (*record.coords.items(), *record.variables.items()):
                _write_variable(dataset, name, variable, _auxiliary(record, name, variable))
        seal.attach(temporary)


def read(path: Path, *, digest: str | None = None) -> Record:
    """Read what `write` wrote.

    Parameters
    ----------
    path
        The file.
    digest
        Digest of the job whose result is wanted; None takes any.

    Raises
    ------
    DamagedFileError
        When a single bit differs from what was written, or when no vibsim wrote it.
    StaleFileError
        When the file is whole but another job's.
    """
    import netCDF4

    seal.check(path)
    try:
        with netCDF4.Dataset(path, "r") as dataset:
            dataset.set_auto_maskandscale(False)
            dataset.set_auto_chartostring(False)
            form, job = (getattr(dataset, name, None) for name in ("vibsim_format", "digest"))
            identity.check(path, form, str(job), digest)
            return _read_record(dataset)
    except (OSError, RuntimeError) as error:
        raise DamagedFileError(path, f"the netCDF library cannot read it: {error}") from error


def _global_attributes(
    record: Record, digest: str, provenance: Mapping[str, Any]
) -> dict[str, Attribute]:
    leftover = _leftover(record)
    return {
        "Conventions": CONVENTIONS,
        **{name: _plain(value) for name, value in record.attrs.items() if name not in _OURS},
        **({"coordinates": " ".join(leftover)} if leftover else {}),
        "history": f"computed by vibsim {__version__}",
        "vibsim_format": np.array(FORMAT, dtype=np.int32),
        "digest": digest,
        "provenance": json.dumps(provenance, sort_keys=True, allow_nan=False),
        "integrity": f"sha256 of all bytes before the last {seal.LENGTH}, which hold it",
    }


def _auxiliary(record: Record, name: str, variable: Variable) -> list[str]:
    """Name the coordinates of a data variable that are not those of its own dimensions."""
    if name in record.coords:
        return []
    return [
        coord
        for coord, values in record.coords.items()
        if (coord,) != values.dims and set(values.dims) <= set(variable.dims)
    ]


def _leftover(record: Record) -> list[str]:
    """Name the auxiliary coordinates that belong to no data variable."""
    used = {c for n, v in record.variables.items() for c in _auxiliary(record, n, v)}
    return [n for n, v in record.coords.items() if (n,) != v.dims and n not in used]


def _write_variable(dataset: Any, name: str, variable: Variable, auxiliary: list[str]) -> None:
    values = np.asarray(variable.values)
    attrs = _attributes(name, variable, values)
    dims = variable.dims
    if values.dtype.kind in "UO":
        values = _characters(values)
        attrs["_Encoding"] = "utf-8"
        dims = (*dims, f"string{values.shape[-1]}")
        if dims[-1] not in dataset.dimensions:
            dataset.createDimension(dims[-1], values.shape[-1])
    elif values.dtype.kind not in "fiu":
        raise ValueError(f"{name}: values of type {values.dtype} have no place in a file")
    # A dimension without points is an unlimited one in netCDF, which excludes contiguous storage.
    contiguous = {"contiguous": True} if values.size and values.ndim else {}
    target = dataset.createVariable(name, values.dtype, dims, fill_value=False, **contiguous)
    target.set_auto_maskandscale(False)
    target.set_auto_chartostring(False)
    target.setncatts(attrs)
    if auxiliary:
        target.coordinates = " ".join(auxiliary)
    if values.size:
        target[...] = values


def _characters(values: NDArray[Any]) -> NDArray[Any]:
    """Return texts as bytes along one more dimension: the CF checker stops at strings."""
    encoded = np.char.encode(values.astype(str), "utf-8")
    width = max(encoded.dtype.itemsize, 1)
    padded = np.ascontiguousarray(encoded.astype(f"S{width}"))
    return padded.view("S1").reshape(*values.shape, width)


def _texts(values: NDArray[Any]) -> NDArray[Any]:
    width = values.shape[-1]
    joined = np.ascontiguousarray(values).view(f"S{width}").reshape(values.shape[:-1])
    return np.char.decode(joined, "utf-8")


def _attributes(name: str, variable: Variable, values: NDArray[Any]) -> dict[str, Attribute]:
    attrs = {key: _plain(value) for key, value in variable.attrs.items() if key != "coordinates"}
    if values.dtype.kind in "UO" or "flag_values" in attrs:
        attrs.setdefault("units", "1")
    for wanted in ("long_name", "units"):
        if not attrs.get(wanted):
            raise ValueError(f"{name}: a stored variable needs {wanted}")
    if "flag_values" in attrs:
        attrs["flag_values"] = np.asarray(attrs["flag_values"], dtype=values.dtype)
    return attrs


def _plain(value: Attribute) -> Attribute:
    """Return `value` in the type that CF knows: integers of 32 bits where they fit."""
    array = np.asarray(value)
    if array.dtype.kind == "i" and np.all(np.abs(array) < 2**31):
        return array.astype(np.int32)
    return value


def _read_record(dataset: Any) -> Record:
    tables: tuple[dict[str, Variable], dict[str, Variable]] = ({}, {})
    auxiliary = set(getattr(dataset, "coordinates", "").split())
    for variable in dataset.variables.values():
        auxiliary.update(getattr(variable, "coordinates", "").split())
    for name, variable in dataset.variables.items():
        attrs = {key: _unpack(variable.getncattr(key)) for key in variable.ncattrs()}
        attrs.pop("coordinates", None)
        dims, values = variable.dimensions, np.asarray(variable[...])
        if attrs.pop("_Encoding", None):
            dims, values = dims[:-1], _texts(values)
        is_data = name not in auxiliary and name not in dataset.dimensions
        tables[is_data][name] = Variable(tuple(dims), values, attrs)
    attrs = {key: _unpack(dataset.getncattr(key)) for key in dataset.ncattrs()}
    attrs.pop("coordinates", None)
    return Record(tables[False], tables[True], attrs)


def _unpack(value: Any) -> Attribute:
    if isinstance(value, np.ndarray):
        numbers: list[Any] = value.tolist()
        return numbers
    plain: Attribute = value.item() if isinstance(value, np.generic) else value
    return plain
