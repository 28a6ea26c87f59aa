"""What a check measures, as variables of its own: ``check_<id>_<field>`` of ``convergence.nc``.

Each kind of check says which fields it has, with their type, their unit and their meaning.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.record import Record, Variable, attributes

GROUP = "checks"
"""Group of ``convergence.nc`` that holds what the checks measured."""
MEMBERS = ("scheme", "case")


@dataclass(frozen=True)
class Field:
    """A number that a kind of check measures."""

    meaning: str
    type: type[np.generic] = np.float64
    words: tuple[str, ...] = ()
    """Of a position in a list of words, the list."""
    none: int | None = None
    """The number that stands for none."""
    dims: tuple[str, ...] = MEMBERS
    of_figure: bool = False
    """Whether only its figure needs it: it is left out where no series are stored."""


def flags(words: tuple[str, ...]) -> dict[str, Any]:
    """Return the attributes of a variable that holds positions in a list of words."""
    return {"flag_values": np.arange(len(words), dtype=np.int8), "flag_meanings": " ".join(words)}


def name_of(check: str, field: str) -> str:
    """Return the name of a variable."""
    return f"check_{check}_{field}"


def variables(
    check: str, fields: Mapping[str, Field], found: Mapping[str, Any], lean: bool
) -> dict[str, Variable]:
    """Return what a check measured as variables.

    Parameters
    ----------
    check
        Its id.
    fields, found
        The fields of its kind, and their values, of the shape that the field has.
    lean
        Whether no series are stored.
    """
    table = {}
    for name, field in fields.items():
        if lean and field.of_figure:
            continue
        attrs = attributes(f"check {check}: {field.meaning}", "1")
        attrs |= flags(field.words) if field.words else {}
        values = np.asarray(found[name], dtype=field.type)
        table[name_of(check, name)] = Variable(field.dims, values, attrs, GROUP)
    return table


Facts = Mapping[str, tuple[Field, NDArray[Any]]]
"""Name of a fact to what it is, and its values: of every scheme and member, or one for all."""


def facts(record: Record, check: str, fields: Mapping[str, Field]) -> Facts:
    """Return what a check measured, but for what only its figure needs and what every result has."""
    names = [name for name, field in fields.items() if not field.of_figure]
    return {
        name: (fields[name], measured(record, check, name))
        for name in names
        if name not in ("status", "reason")
    }


def facts_of(table: Facts, scheme: int, case: int) -> dict[str, Any]:
    """Return the facts of one scheme and member as plain data; None where there is none, or it is not finite."""
    return {
        name: _plain(field, values[scheme, case] if field.dims[:2] == MEMBERS else values)
        for name, (field, values) in table.items()
    }


def _plain(field: Field, value: NDArray[Any]) -> Any:
    if np.ndim(value):
        several = [_plain(field, one) for one in value]
        return None if None in several else several
    if field.words:
        return field.words[int(value)]
    if np.issubdtype(field.type, np.bool_):
        return bool(value)
    if np.issubdtype(field.type, np.integer):
        return None if value == field.none else int(value)
    return float(value) if np.isfinite(value) else None


def measured(record: Record, check: str, field: str) -> NDArray[Any]:
    """Return the values of a field of a check."""
    return record[name_of(check, field)]
