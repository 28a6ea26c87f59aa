"""The table of characteristic scales and dimensionless numbers."""

from __future__ import annotations

import numpy as np

from vibsim.experiment.sweep_columns import recorded_columns
from vibsim.models.shared.scales import dimensionless, scales
from vibsim.report import data
from vibsim.report.data import Results
from vibsim.report.style import finite
from vibsim.report.tables.table import Cell, Column, Table


def table(record: Results) -> Table | None:
    """Return the ranges of scales and dimensionless numbers over the members; None if the model defines none."""
    model, scaling = record.model, record.experiment.scaling
    if model.scales is None:
        return None
    if scaling is None:
        swept = recorded_columns(record)
        parameters, initial = (
            {key: swept.get(f"{section}.{key}", value) for key, value in values.items()}
            for section, values in (
                ("model", record.experiment.model.parameters),
                ("initial", record.experiment.initial),
            )
        )
    else:
        parameters, initial = dict(scaling.parameters), dict(scaling.initial)
    sizes, numbers = scales(model, parameters, initial), dimensionless(model, parameters, initial)
    if scaling is None and all(np.all(np.asarray(row.value) == 1.0) for row in sizes):
        # the numbers of the file are dimensionless already, and the scaled initial values are those of the file
        sizes, numbers = (), tuple(row for row in numbers if not row.name.endswith("(0)"))
    listed = [(f"{row.name}_c", f"scale of the {row.words}", row) for row in sizes]
    listed += [(row.name, row.words, row) for row in numbers]
    if not listed:
        return None
    ends = []
    for _, _, row in listed:
        shown = finite(np.asarray(row.value))
        ends.append((float(shown.min()), float(shown.max())) if shown.size else (np.nan, np.nan))
    values = ("least", "largest") if any(low < high for low, high in ends) else ("value",)
    rows: list[tuple[Cell, ...]] = [
        (name, words, row.formula, *span[: len(values)], data.pretty_unit(row.unit) or "1")
        for (name, words, row), span in zip(listed, ends, strict=True)
    ]
    columns = (
        *map(Column, ("name", "what it is", "formula")),
        *(Column(value, form="value") for value in values),
        Column("unit"),
    )
    caption = "Scales and dimensionless numbers"
    if scaling is not None:
        caption += "; the run uses these scales, and its numbers times them are those of the file"
    return Table("scales", caption, columns, tuple(rows))
