"""A verdict as a labelled dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray

    from vibsim.convergence.study.verdict import LadderVerdict

COLUMNS = {
    "value": "value, or norm of the values",
    "difference": "this level minus the next finer one",
    "ratio": "this difference over the next one",
    "order": "order that belongs to this ratio",
    "error": "this level minus the exact or the extrapolated values",
}
"""Columns of the table of levels and their meanings."""


def dataset(verdict: LadderVerdict) -> xarray.Dataset:
    """Return a verdict as a dataset over the step sizes; missing numbers are NaN, missing facts are omitted."""
    import xarray

    # None becomes NaN
    table: dict[str, Any] = {
        name: (
            "h",
            np.array([getattr(row, name) for row in verdict.levels], float),
            {"long_name": text},
        )
        for name, text in COLUMNS.items()
    }
    dims = tuple(f"{dim}_" if dim == "h" else dim for dim in verdict.dims)
    coords: dict[str, Any] = {
        "h": ("h", [row.h for row in verdict.levels], {"long_name": "step size"})
    }
    coords |= {
        name: (name, verdict.coords[dim])
        for name, dim in zip(dims, verdict.dims, strict=True)
        if dim in verdict.coords
    }
    if verdict.dims:
        meaning = {"long_name": "values at the common points of the levels"}
        table["values"] = (("h", *dims), verdict.values, meaning)
        if verdict.best_values is not None:
            meaning = {"long_name": "values extrapolated over the levels"}
            table["best_values"] = (dims, verdict.best_values, meaning)
    facts = {key: value for key, value in verdict.to_dict().items() if value is not None}
    return xarray.Dataset(table, coords, facts)
