"""Results as an `xarray.DataTree`: every file of an experiment is a node with the name of the file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import xarray as xr

from vibsim.core.errors import VibsimError
from vibsim.store import reading
from vibsim.store.summary import read_json

SUMMARY = "summary.json"
FILES = "level_*", "convergence.nc", "best.nc"
"""Patterns of the data files and folders of an experiment."""
ATTRIBUTES = "title", "collection", "experiment", "status"
"""Fields of the summary that become attributes of the node of an experiment."""


def open(  # noqa: A001
    path: str | Path, *, chunks: Mapping[str, int] | None = None
) -> xr.DataTree:
    """Open the results of one experiment, or of all experiments below a folder, as one tree.

    The nodes of an experiment have the names and the content of its files: ``level_06``, ``level_07``, ..., one for
    each level, ``convergence`` with its group ``checks``, and ``best`` if it was made. The files of a level of a sweep
    are joined along `case`. Values are loaded lazily: close the tree, or use it in a ``with`` block.

    Parameters
    ----------
    path
        The folder of an experiment, such as ``results/pendulum_lab/theta_convergence``, or a folder above it.
    chunks
        Sizes of chunks by dimension: arrays are then dask arrays, and dask must be installed. Without it, a level of
        several files is loaded at once.

    Raises
    ------
    VibsimError
        Where the folder does not exist or has no results.
    DamagedFileError
        Where a file was changed after it was written.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise VibsimError(f"{folder}: no such folder")
    nodes = dict(_nodes(folder, chunks))
    if not nodes:
        raise VibsimError(f"{folder}: there are no results in this folder")
    return xr.DataTree.from_dict(nodes, name=folder.resolve().name)


def _nodes(folder: Path, chunks: Mapping[str, int] | None) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield path and dataset of every node below a folder; nothing if it has no results."""
    matches = [path for pattern in FILES for path in folder.glob(pattern)]
    # level_30.yaml, for example, is an experiment file
    results = sorted(path for path in matches if path.is_dir() or path.suffix == ".nc")
    if not results:
        for subfolder in sorted(path for path in folder.iterdir() if path.is_dir()):
            for name, dataset in _nodes(subfolder, chunks):
                yield f"/{subfolder.name}{name}", dataset
        return
    summary = folder / SUMMARY
    # the analysis writes it
    content = read_json(summary) if summary.exists() else {}
    yield "/", xr.Dataset(attrs={name: content[name] for name in ATTRIBUTES if name in content})
    for path in results:
        files = sorted(path.glob("shard_*.nc")) if path.is_dir() else [path]
        if not files:
            continue
        for file in files:
            reading.check(file)
        name = f"/{path.stem}"
        if len(files) == 1:
            for group, dataset in xr.open_groups(files[0], chunks=chunks).items():
                yield name + group.rstrip("/"), dataset
        else:
            parts = [xr.open_dataset(file, chunks=chunks) for file in files]
            yield name, _joined(parts)


def _joined(parts: list[xr.Dataset]) -> xr.Dataset:
    """Join the files of a level along `case`; variables without this dimension are the same in all files."""
    if all("case" not in part.dims for part in parts):  # a file of a user's solver holds one member
        numbered = [part.assign_coords(case=number) for number, part in enumerate(parts)]
        return xr.concat(
            numbered,
            "case",
            data_vars="all",
            coords="different",
            compat="equals",
            join="outer",
            combine_attrs="drop_conflicts",
        )
    return xr.concat(
        parts,
        "case",
        data_vars="minimal",
        coords="minimal",
        compat="override",
        join="exact",
        combine_attrs="drop_conflicts",
    )
