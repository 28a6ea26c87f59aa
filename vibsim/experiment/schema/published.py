"""Tables of numbers printed in a source: every row is a claim, and the report shows it next to the computed number."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from decimal import Decimal
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple

from pydantic import BeforeValidator, Field, StrictBool, WithJsonSchema

from vibsim.experiment.schema.checks import At, ClaimCheck, LevelOrBest, PublishedAt, ValueCheck
from vibsim.experiment.schema.citation import Citation
from vibsim.experiment.schema.fields import MAX_ENTRIES, Section, Text, refused, short

_POWER = r"(?:\s*(?:[x*·×]|\\cdot)?\s*10\s*\^\s*(?:\{\s*([-+]?\d{1,3})\s*\}|([-+]?\d{1,3}))|[eE]([-+]?\d{1,3}))"
_PRINTED = re.compile(rf"\s*([-+]?(?:\d+\.?\d*|\.\d+)){_POWER}?\s*", re.ASCII)
_MAX_LENGTH = 60


class PrintedNumber(NamedTuple):
    """The value of a printed number, and half a unit of its last digit."""

    number: float
    half_unit: float


def read_printed(text: str) -> PrintedNumber | None:
    """Return the number in `text`; None if it is not a number, or outside the range of floats."""
    match = _PRINTED.fullmatch(text.replace("\N{MINUS SIGN}", "-")[: _MAX_LENGTH + 1])
    if match is None or len(text) > _MAX_LENGTH:
        return None
    mantissa = Decimal(match[1])
    power = int(match[2] or match[3] or match[4] or 0)
    # exponent of the last digit; 0 for a number without a decimal point
    last = int(mantissa.as_tuple().exponent) + power
    printed = PrintedNumber(float(mantissa.scaleb(power)), float(Decimal(5).scaleb(last - 1)))
    is_float = math.isfinite(printed.number) and 0.0 < printed.half_unit < math.inf
    return printed if is_float else None


def _as_text(value: Any) -> str:
    """Return a number as text; in a file it has its original digits (`vibsim.experiment.validation`)."""
    text = repr(value) if isinstance(value, int | float) and not isinstance(value, bool) else value
    if not isinstance(text, str) or read_printed(text) is None:
        raise refused("must be a number as printed, such as 1.120e8, 1.120 10^8 or 4.93")
    return text


PrintedText = Annotated[
    str, BeforeValidator(_as_text), WithJsonSchema({"type": ["number", "string"]})
]


class PublishedRow(Section):
    """A printed number."""

    scheme: Text
    """Name of the scheme."""
    level: LevelOrBest | None = None
    """A level, or `best` for the Richardson-extrapolated solution; the finest level when left out."""
    at: PublishedAt = PublishedAt()
    """Time, event or members of the number."""
    printed: PrintedText
    """The number as printed: `1.120e8`, `1.120 10^8`, `4.93`. Its last digit defines its precision."""
    holds: StrictBool = True
    """Whether the computed number is expected to agree to half a unit of the last printed digit."""
    note: Text | None = None
    """A remark for readers of the report, such as why it does not agree."""

    @property
    def meaning(self) -> PrintedNumber:
        """The printed number, and half a unit of its last digit."""
        number = read_printed(self.printed)
        assert number is not None
        return number


class PublishedTable(Section):
    """A printed table."""

    stand_ins = MappingProxyType({"title": None, "value": None, "rows": ()})

    title: Text
    """What the table shows."""
    source: Citation | None = None
    """The source of the table; the experiment's `source` when left out."""
    value: Text
    """The printed value, one of those of a `value` check."""
    quantity: Text | None = None
    """The quantity of the value, if it has one."""
    beside: Annotated[tuple[Text, ...], short(MAX_ENTRIES)] = ()
    """Further values, shown next to each row without a claim."""
    rows: Annotated[tuple[PublishedRow, ...], Field(min_length=1), short(MAX_ENTRIES)]
    """The printed numbers."""


def row_id(table: int, row: int) -> str:
    """Return the id of the claim of row `row` of table `table`, both counted from 1."""
    return f"published_{table}_{row}"


def row_at(row: PublishedRow) -> At:
    """Return the scheme, level, time and members of a row as the section ``at`` of a check."""
    return At(scheme=row.scheme, level=row.level, **dict(row.at))


def claims(tables: Iterable[PublishedTable]) -> tuple[ClaimCheck, ...]:
    """Return the claim of every row."""
    return tuple(
        _claim(table, row, row_id(i, j))
        for i, table in enumerate(tables, 1)
        for j, row in enumerate(table.rows, 1)
    )


def _claim(table: PublishedTable, row: PublishedRow, id_: str) -> ClaimCheck:
    places = [f"scheme {row.scheme}"]
    if row.level is not None:
        places.append("extrapolated" if row.level == "best" else f"level {row.level}")
    entries = row.at.model_dump(exclude_none=True)
    places += [f"{k} {v if isinstance(v, str) else f'{v:g}'}" for k, v in entries.items()]
    fields = {"id": id_, "value": table.value, "quantity": table.quantity, "at": row_at(row)}
    that = ValueCheck(**fields, equals=row.meaning.number, atol=row.meaning.half_unit)
    return ClaimCheck(
        id=id_,
        claim=f"{table.title}: {', '.join(places)}: {row.printed}",
        source=table.source,
        that=that,
        holds=row.holds,
        note=row.note,
    )
