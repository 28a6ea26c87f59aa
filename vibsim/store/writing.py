"""Write Records as netCDF files: CF conventions, no clock time, the same bytes for the same content.

In files of moderate size, series are compressed, which saves about half of the space. All other data are contiguous and
uncompressed, because compression takes ten times as long as writing. Each file states its job (``digest``) and what the
job used (``provenance``), and ends with a seal over all its bytes.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim import __version__
from vibsim.core import netcdf
from vibsim.core.record import Attribute, Record, Variable
from vibsim.core.vocabulary import FORMAT
from vibsim.experiment.cost import PACKED_FROM, PACKED_UP_TO
from vibsim.store import seal
from vibsim.store.atomic import check_room, replacing

CONVENTIONS = "CF-1.11"
_CHUNK = 2**18
"""Size of the chunks of compressed variables [bytes]: as many whole members as fit, at least one."""
_OURS = (
    *("Conventions", "history", "vibsim_format", "digest", "provenance", "integrity"),
    "coordinates",
)


def write(path: Path, record: Record, *, digest: str, provenance: Mapping[str, Any]) -> None:
    """Write `record` to the netCDF file `path`, in one step; see `write_parts`."""
    cases = record.sizes.get("case", 0)
    write_parts(path, [record], cases=cases, digest=digest, provenance=provenance)


def write_parts(
    path: Path,
    parts: Iterable[Record],
    *,
    cases: int,
    digest: str,
    provenance: Mapping[str, Any],
) -> None:
    """Write `parts`, consecutive ranges of members, to one netCDF file, in one step.

    The bytes of the file do not depend on the division into parts. An old file stays until the new one is complete.

    Parameters
    ----------
    parts
        In the order of their members, consumed one by one. All parts have the same variables, with the same dimensions
        and types. Variables without the dimension ``case`` are taken from the last part, so that they may depend on all
        parts; the attributes, which need a ``title``, are taken from the first part. Each variable needs a
        ``long_name``, and ``units`` unless it holds strings or flags. The type of strings along ``case`` must be wide
        enough for the strings of all parts.
    cases
        Total number of members.
    digest
        Digest of the job that made the parts.
    provenance
        What the job used, JSON-able.

    Raises
    ------
    ValueError
        Where a name, a unit or the title is missing, values have no netCDF type, or the parts do not belong together or
        do not have `cases` members in total.
    OSError
        Where the file cannot be written, with the cause.
    """
    with replacing(path) as temporary:
        part = None
        try:
            with netcdf.create(temporary) as dataset:
                dataset.set_fill_off()
                start = 0
                for number, part in enumerate(parts):
                    if number == 0:
                        _define(dataset, path.name, part, cases, digest, provenance)
                    stop = start + part.sizes.get("case", 0)
                    _put_all(dataset, part, slice(start, stop))
                    start = stop
                if part is None or start != cases:
                    text = f"{path.name}: {start} members where {cases} are to be written"
                    raise ValueError(text)
                _put_all(dataset, part, None)
        except (OSError, RuntimeError) as error:
            # an error from the computation of a part needs no explanation
            if netcdf.is_from_library(error):
                check_room(temporary, _size(part, cases))
            raise
        seal.attach(temporary)


def _rows(record: Record) -> dict[str, Variable]:
    return {**record.coords, **record.variables}


def _size(part: Record | None, cases: int) -> int:
    """Return the approximate size of a file of `cases` members like those of `part` [bytes]."""
    if part is None:
        return 0
    share = cases / max(part.sizes.get("case", cases), 1)
    return sum(
        round(np.asarray(row.values).nbytes * (share if "case" in row.dims else 1))
        for row in _rows(part).values()
    )


def _global_attributes(
    record: Record, digest: str, provenance: Mapping[str, Any]
) -> dict[str, Attribute]:
    # CF: auxiliary coordinates of no data variable are named in the global attribute ``coordinates``
    used = {c for n, v in record.variables.items() for c in _auxiliary(record, n, v)}
    leftover = [n for n, v in record.coords.items() if (n,) != v.dims and n not in used]
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
    """Return the names of the auxiliary coordinates of a data variable."""
    if name in record.coords:
        return []
    return [
        coord
        for coord, values in record.coords.items()
        if (coord,) != values.dims and set(values.dims) <= set(variable.dims)
    ]


def _define(
    dataset: Any,
    name: str,
    record: Record,
    cases: int,
    digest: str,
    provenance: Mapping[str, Any],
) -> None:
    """Write the global attributes, the dimensions, and every variable without its values."""
    if not record.attrs.get("title"):
        raise ValueError(f"{name}: a stored record needs a title")
    dataset.setncatts(_global_attributes(record, digest, provenance))
    for dim, size in record.sizes.items():
        dataset.createDimension(dim, cases if dim == "case" else size)
    # lean storage has no series, only scalars of many members
    packed = record.attrs.get("storage") != "lean" and _size(record, cases) <= PACKED_UP_TO
    for key, variable in _rows(record).items():
        _define_variable(dataset, key, variable, _auxiliary(record, key, variable), packed)


def _define_variable(
    dataset: Any, name: str, variable: Variable, auxiliary: list[str], packed: bool
) -> None:
    values = np.asarray(variable.values)
    attrs = _attributes(name, variable, values)
    dims, kind = variable.dims, values.dtype
    if kind.kind in "UO":
        width = _width(values)
        attrs["_Encoding"] = "utf-8"
        dims, kind = (*dims, f"string{width}"), np.dtype("S1")
        if dims[-1] not in dataset.dimensions:
            dataset.createDimension(dims[-1], width)
    elif kind.kind not in "fiu":
        raise ValueError(f"{name}: values of type {kind} cannot be stored")
    storage = _storage(dataset, variable.dims, kind, packed) if values.size and dims else {}
    group = dataset.createGroup(variable.group) if variable.group else dataset
    target = group.createVariable(name, kind, dims, fill_value=False, **storage)
    target.set_auto_maskandscale(False)
    target.set_auto_chartostring(False)
    target.setncatts(attrs)
    if auxiliary:
        target.coordinates = " ".join(auxiliary)


def _storage(
    dataset: Any, dims: tuple[str, ...], kind: np.dtype[Any], packed: bool
) -> dict[str, Any]:
    """Return the storage options of a variable that has values.

    (A dimension of size 0 would be unlimited in netCDF, and contiguous storage impossible.)
    """
    sizes = [len(dataset.dimensions[dim]) for dim in dims]
    size = math.prod(sizes) * kind.itemsize
    if not packed or kind.kind != "f" or size < PACKED_FROM:
        return {"contiguous": True}
    members = sizes[dims.index("case")] if "case" in dims else 1
    chunk = max(1, min(members, _CHUNK * members // size))
    return {
        "compression": "zlib",
        "complevel": 1,
        "shuffle": True,
        # chunks hold whole members and stay in the cache until the file is closed, so that the bytes do not depend on
        # the division into parts
        "chunksizes": [chunk if d == "case" else n for d, n in zip(dims, sizes, strict=True)],
        "chunk_cache": 2 * size,
    }


def _put_all(dataset: Any, part: Record, cases: slice | None) -> None:
    """Write the variables along ``case`` for the members `cases`, or for None those without this dimension."""
    table = _rows(part)
    if set(table) != {name for name, _, _ in netcdf.variables(dataset)}:
        raise ValueError("parts of one file hold different variables")
    for name, variable in table.items():
        if ("case" in variable.dims) == (cases is not None):
            path = f"{variable.group}/{name}" if variable.group else name
            _put(dataset[path], name, variable, cases)


def _put(target: Any, name: str, variable: Variable, cases: slice | None) -> None:
    values = np.asarray(variable.values)
    dims = target.dimensions
    if values.dtype.kind in "UO":
        values = _characters(name, values, target.shape[-1])
        dims = dims[:-1]
    if dims != variable.dims or values.dtype != target.dtype:
        raise ValueError(f"{name}: parts of one file have different dimensions or types")
    if values.size:
        target[tuple(cases if dim == "case" else slice(None) for dim in dims)] = values


def _width(values: NDArray[Any]) -> int:
    """Return the number of bytes of the longest string: the width of the type, or of these strings if larger."""
    declared = values.dtype.itemsize // 4 if values.dtype.kind == "U" else 1
    encoded = np.char.encode(values.astype(str), "utf-8")
    return max(declared, encoded.dtype.itemsize, 1)


def _characters(name: str, values: NDArray[Any], width: int) -> NDArray[Any]:
    """Return strings as `width` bytes along one more dimension, because the CF checker fails on netCDF strings."""
    encoded = np.char.encode(values.astype(str), "utf-8")
    if encoded.dtype.itemsize > width:
        raise ValueError(f"{name}: a text is longer than the {width} bytes of those before it")
    padded = np.ascontiguousarray(encoded.astype(f"S{width}"))
    return padded.view("S1").reshape(*values.shape, width)


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
    """Return an attribute value with a type that CF allows: integers become 32-bit where they fit."""
    array = np.asarray(value)
    if array.dtype.kind == "i" and np.all(np.abs(array) < 2**31):
        return array.astype(np.int32)
    return value
