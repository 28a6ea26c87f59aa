"""Which figure of the source stands where on a page, as a table that the index reads."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from vibsim.report.tables.table import Column, Table

if TYPE_CHECKING:
    from vibsim.experiment.schema.figures import FigureOfSource
    from vibsim.report.style import Picture

PLAYER = "player"
"""What is shown by the player of the page and not drawn."""
HEADERS = ("figure", "shows", "place")
"""The place is the id of an element of the page."""


def table(found: Iterable[tuple[FigureOfSource, Sequence[Picture]]]) -> Table | None:
    """Return which figure of the source stands where on the page; None where none is asked for."""
    rows = []
    for asked, drawn in found:
        places = [picture.name for picture in drawn] or [PLAYER] * (asked.shows == PLAYER)
        rows += [(asked.source, asked.shows.replace("_", " "), place) for place in places]
    columns = tuple(map(Column, HEADERS))
    return Table("figures", "Figures of the source", columns, tuple(rows)) if rows else None
