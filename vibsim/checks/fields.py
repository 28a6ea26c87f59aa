"""The measured fields of checks, stored as the variables ``check_<id>_<field>`` of ``convergence.nc``.

Each kind of check defines its fields with their types, units and meanings.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.record import Record, Variable, attributes, flags
from vibsim.core.vocabulary import MEMBER, REASON_NAMES, STATUSES

GROUP = "checks"
"""Group of ``convergence.nc`` that holds the fields."""


@dataclass(frozen=True)
class Field:
    """A number that a kind of check measures."""

    meaning: str
    type: type[np.generic] = np.float64
    words: tuple[str, ...] = ()
    """The list of words that the number is an index into, if any."""
    none: int | None = None
    """The number that represents None."""
    dims: tuple[str, ...] = MEMBER
    of_figure: bool = False
    """Whether only the figure needs it; it is omitted if no series are stored."""
    unit_of: str = ""
    """Whether it has the unit of the ``number`` or of the ``quantity`` of its check; empty for no unit."""


STATUS = Field("status", np.int8, STATUSES)
REASON = Field("reason", np.int8, REASON_NAMES)
MOTION = Field("whether anything moves", np.int8, ("moves", "rests"))
LEVEL = Field("level", np.int16, dims=())


def name_of(check: str, field: str) -> str:
    """Return the name of a variable."""
    return f"check_{check}_{field}"


def variables(
    check: str,
    fields: Mapping[str, Field],
    values: Mapping[str, Any],
    units: Mapping[str, str],
    lean: bool,
) -> dict[str, Variable]:
    """Return the values of the fields of a check as variables.

    Parameters
    ----------
    units
        Units of the number and the quantity of the check (`Field.unit_of`).
    lean
        Whether no series are stored; then fields that only a figure needs are omitted.
    """
    table = {}
    for name, field in fields.items():
        if not (lean and field.of_figure):
            attributes_of_words = flags(field.words) if field.words else {}
            unit = units.get(field.unit_of) or "1"
            attrs = attributes(f"check {check}: {field.meaning}", unit, **attributes_of_words)
            array = np.asarray(values[name], dtype=field.type)
            table[name_of(check, name)] = Variable(field.dims, array, attrs, GROUP)
    return table


def field_values(record: Record, check: str, field: str) -> NDArray[Any]:
    """Return the values of a field of a check."""
    return record[name_of(check, field)]


Measured = Mapping[str, Any]
"""Values of the fields of a check, by their names."""
Facts = Mapping[str, tuple[Field, NDArray[Any]]]
"""Field and values of each fact by its name; the values are one for each scheme and member, or one for all."""


def result_fields(fields: Mapping[str, Field]) -> dict[str, Field]:
    """Return the fields that a result states: not those of figures, and not status and reason."""
    return {
        name: field
        for name, field in fields.items()
        if not field.of_figure and name not in ("status", "reason")
    }


def facts_of(table: Facts, scheme: int, case: int) -> dict[str, Any]:
    """Return the facts of one scheme and member as plain data; None if missing or not finite."""
    return {
        name: _plain(field, values[scheme, case] if field.dims[:2] == MEMBER else values)
        for name, (field, values) in table.items()
    }


def _plain(field: Field, value: NDArray[Any]) -> Any:
    if np.ndim(value):
        entries = [_plain(field, entry) for entry in value]
        return None if None in entries else entries
    if field.words:
        return field.words[int(value)]
    if np.issubdtype(field.type, np.integer):
        return None if value == field.none else int(value)
    return float(value) if np.isfinite(value) else None
