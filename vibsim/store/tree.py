"""Results as one tree of xarray: every file of an experiment is a node under the name of the file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import xarray as xr

from vibsim.core.errors import VibsimError
from vibsim.store import reading
from vibsim.store.summary import read_json

SUMMARY = "summary.json"
FILES = "level_*", "convergence.nc", "best.nc"
"""What holds data in the folder of an experiment."""
STATED = "title", "collection", "experiment", "status"
"""What the node of an experiment has as attributes, from its summary."""


def open(  # noqa: A001
    path: str | Path, *, chunks: Mapping[str, int] | None = None
) -> xr.DataTree:
    """Open the results of one experiment, or of all experiments below a folder, as one tree.

    An experiment has the nodes ``level_06``, ``level_07``, ..., one for each level, ``convergence`` with its group
    ``checks``, and ``best`` where it has been made: what stands in the files of these names. The files of a sweep's
    level are joined along `case`. Values are read when they are used; close the tree, or use it in a ``with`` block.

    Parameters
    ----------
    path
        The folder of an experiment, such as ``results/pendulum_lab/theta_convergence``, or one above it.
    chunks
        Sizes of chunks by dimension: arrays are then those of dask, which must be installed. Without them the files of
        a level that has several are read at once.

    Raises
    ------
    VibsimError
        Where there is no folder with results.
    DamagedFileError
        Where a file is not as it was written.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise VibsimError(f"{folder}: no such folder")
    nodes = dict(_nodes(folder, chunks))
    if not nodes:
        raise VibsimError(f"{folder}: no results lie in this folder")
    return xr.DataTree.from_dict(nodes, name=folder.resolve().name)


def _nodes(folder: Path, chunks: Mapping[str, int] | None) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield the nodes below a folder by their paths; nothing where no results are."""
    named = [part for name in FILES for part in folder.glob(name)]
    # level_30.yaml, for one, is an experiment file
    found = sorted(part for part in named if part.is_dir() or part.suffix == ".nc")
    if not found:
        for part in sorted(part for part in folder.iterdir() if part.is_dir()):
            for name, dataset in _nodes(part, chunks):
                yield f"/{part.name}{name}", dataset
        return
    summary = folder / SUMMARY
    # there is none before the analysis
    content = read_json(summary) if summary.exists() else {}
    yield "/", xr.Dataset(attrs={name: content[name] for name in STATED if name in content})
    for part in found:
        files = sorted(part.glob("shard_*.nc")) if part.is_dir() else [part]
        if not files:
            continue
        for file in files:
            reading.check(file)
        name = f"/{part.stem}"
        if len(files) == 1:
            for group, dataset in xr.open_groups(files[0], chunks=chunks).items():
                yield name + group.rstrip("/"), dataset
        else:
            parts = [xr.open_dataset(file, chunks=chunks) for file in files]
            yield name, _joined(parts)


def _joined(parts: list[xr.Dataset]) -> xr.Dataset:
    """Join the files of a level along the member; what does not depend on it is the same in all."""
    if all("case" not in part.dims for part in parts):  # a file of a solver holds one member
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
