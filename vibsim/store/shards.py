"""Put the shards of a level together again: arrays side by side along ``case``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vibsim.core.record import Record, Variable


def join(records: Sequence[Record]) -> Record:
    """Return one Record of all members.

    Parameters
    ----------
    records
        Shards of one level, in the order of their members: the same variables, schemes and times.

    Raises
    ------
    ValueError
        When the shards do not belong together.
    """
    first = records[0]
    if len(records) == 1:
        return first
    coords = _join([record.coords for record in records])
    variables = _join([record.variables for record in records])
    return Record(coords, variables, first.attrs)


def _join(tables: Sequence[Mapping[str, Variable]]) -> dict[str, Variable]:
    if any(list(table) != list(tables[0]) for table in tables):
        raise ValueError("shards of one level hold different variables")
    return {name: _join_one(name, [table[name] for table in tables]) for name in tables[0]}


def _join_one(name: str, parts: Sequence[Variable]) -> Variable:
    first = parts[0]
    if any(part.dims != first.dims for part in parts):
        raise ValueError(f"{name}: shards of one level have different dimensions")
    if "case" in first.dims:
        values = np.concatenate([part.values for part in parts], axis=first.dims.index("case"))
        return Variable(first.dims, values, first.attrs)
    if any(not np.array_equal(part.values, first.values) for part in parts):
        raise ValueError(f"{name}: shards of one level differ where they must agree")
    return first
