"""What a check measures, as variables of its own: ``check_<id>_<field>`` of ``convergence.nc``.

Each kind of check says which fields it has, with their type, their unit and their meaning.
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
"""Group of ``convergence.nc`` that holds what the checks measured."""


@dataclass(frozen=True)
class Field:
    """A number that a kind of check measures."""

    meaning: str
    type: type[np.generic] = np.float64
    words: tuple[str, ...] = ()
    """Of a position in a list of words, the list."""
    none: int | None = None
    """The number that stands for none."""
    dims: tuple[str, ...] = MEMBER
    of_figure: bool = False
    """Whether only its figure needs it: it is left out where no series are stored."""
    unit_of: str = ""
    """Whether it has the unit of the ``number`` or of the ``quantity`` of its check; empty where it has none."""


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
    found: Mapping[str, Any],
    units: Mapping[str, str],
    lean: bool,
) -> dict[str, Variable]:
    """Return what a check measured as variables: the values `found` of its fields.

    Parameters
    ----------
    units
        Of the number and the quantity of the check (`Field.unit_of`).
    lean
        Whether no series are stored. Then what only the figure of the check needs is left out.
    """
    table = {}
    for name, field in fields.items():
        if not (lean and field.of_figure):
            more = flags(field.words) if field.words else {}
            unit = units.get(field.unit_of) or "1"
            attrs = attributes(f"check {check}: {field.meaning}", unit, **more)
            values = np.asarray(found[name], dtype=field.type)
            table[name_of(check, name)] = Variable(field.dims, values, attrs, GROUP)
    return table


def field_values(record: Record, check: str, field: str) -> NDArray[Any]:
    """Return the values of a field of a check."""
    return record[name_of(check, field)]


Measured = Mapping[str, Any]
"""Values of the fields of a check, by their names."""
Facts = Mapping[str, tuple[Field, NDArray[Any]]]
"""Name of a fact to what it is, and its values: of every scheme and member, or one for all."""


def result_fields(fields: Mapping[str, Field]) -> dict[str, Field]:
    """Return the fields that a result states: not what its figure alone needs, nor what every result has."""
    return {
        name: field
        for name, field in fields.items()
        if not field.of_figure and name not in ("status", "reason")
    }


def facts_of(table: Facts, scheme: int, case: int) -> dict[str, Any]:
    """Return the facts of one scheme and member as plain data; None where there is none, or it is not finite."""
    return {
        name: _plain(field, values[scheme, case] if field.dims[:2] == MEMBER else values)
        for name, (field, values) in table.items()
    }


def _plain(field: Field, value: NDArray[Any]) -> Any:
    if np.ndim(value):
        several = [_plain(field, one) for one in value]
        return None if None in several else several
    if field.words:
        return field.words[int(value)]
    if np.issubdtype(field.type, np.integer):
        return None if value == field.none else int(value)
    return float(value) if np.isfinite(value) else None
