"""Tables of numbers that a source printed: every row is a claim, and a report shows their digits beside ours."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated

from pydantic import Field, StrictBool

from vibsim.experiment.schema.checks import At, ClaimCheck, LevelOrBest, ValueCheck
from vibsim.experiment.schema.fields import MAX_ENTRIES, Index, Number, Section, Text, short
from vibsim.experiment.schema.printed_numbers import PrintedText, read_printed


class PublishedAt(Section):
    """Where else a printed number is taken, beside its scheme and level."""

    t: Number | None = None
    """A stored sample time; where the end differs between members, the fraction 0 to 1 of it."""
    step: Index | None = None
    """A stored step of the level, from 0."""
    case: Index | None = None
    """Index of a member of the sweep, from 0."""


class PublishedRow(Section):
    """One printed number."""

    scheme: Text
    """Name of the scheme."""
    level: LevelOrBest | None = None
    """A level, or `best` for the Richardson-extrapolated solution; the finest level when left out."""
    at: PublishedAt = PublishedAt()
    """Where else it is taken."""
    printed: PrintedText
    """The number as printed: `1.120e8`, `1.120 10^8`, `4.93`. Its last digit says how exact it is meant."""
    holds: StrictBool = True
    """Whether ours is expected to agree to half a unit of the last printed digit."""
    note: Text | None = None
    """What a reader of the report should know of it, such as why it does not agree."""

    @property
    def number(self) -> float:
        """The printed number."""
        found = read_printed(self.printed)
        assert found is not None
        return found.number

    @property
    def half_unit(self) -> float:
        """Half a unit of the last printed digit."""
        found = read_printed(self.printed)
        assert found is not None
        return found.half_unit


class PublishedTable(Section):
    """A printed table."""

    title: Text
    """What the table shows."""
    source: Text | None = None
    """Where it stands; the experiment's `source` when left out."""
    value: Text
    """The value that is printed, one of those of a `value` check."""
    quantity: Text | None = None
    """The quantity that it is of, where it is of one."""
    beside: Annotated[tuple[Text, ...], short(MAX_ENTRIES)] = ()
    """Further values, shown beside each row without a claim."""
    rows: Annotated[tuple[PublishedRow, ...], Field(min_length=1), short(MAX_ENTRIES)]
    """The printed numbers."""


def row_id(table: int, row: int) -> str:
    """Return the id of the claim of row number `row` of table number `table`, both from 1."""
    return f"published_{table}_{row}"


def row_at(row: PublishedRow) -> At:
    """Return where the number of a row is taken."""
    at = row.at
    return At(scheme=row.scheme, level=row.level, t=at.t, step=at.step, case=at.case)


def claims(tables: Iterable[PublishedTable], source: str | None) -> tuple[ClaimCheck, ...]:
    """Return the claim of every row; `source` is that of the experiment."""
    return tuple(
        _claim(table, row, row_id(i, j), source)
        for i, table in enumerate(tables, 1)
        for j, row in enumerate(table.rows, 1)
    )


def _claim(table: PublishedTable, row: PublishedRow, id_: str, source: str | None) -> ClaimCheck:
    that = ValueCheck(
        id=id_,
        value=table.value,
        quantity=table.quantity,
        at=row_at(row),
        equals=row.number,
        atol=row.half_unit,
    )
    return ClaimCheck(
        id=id_,
        claim=_statement(table, row),
        source=table.source or source,
        that=that,
        holds=row.holds,
        note=row.note,
    )


def _statement(table: PublishedTable, row: PublishedRow) -> str:
    places = [f"scheme {row.scheme}"]
    if row.level is not None:
        places.append("extrapolated" if row.level == "best" else f"level {row.level}")
    given = row.at.model_dump(exclude_none=True)
    places += [f"{name} {value:g}" for name, value in given.items()]
    return f"{table.title}: {', '.join(places)}: {row.printed}"
