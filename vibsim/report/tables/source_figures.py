"""The figures of the source texts and their places on a page, as a table that the index reads."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from vibsim.report.tables.table import Column, Table

if TYPE_CHECKING:
    from vibsim.experiment.schema.figures import FigureOfSource
    from vibsim.report.style import Picture

PLAYER = "player"  # kind of figure that the player of the page shows
HEADERS = ("figure", "shows", "place")  # the place is the id of an element of the page


def table(drawn: Iterable[tuple[FigureOfSource, Sequence[Picture]]]) -> Table | None:
    """Return the places of the figures of the source on the page; None if the file names none."""
    rows = []
    for figure, pictures in drawn:
        places = [picture.name for picture in pictures] or [PLAYER] * (figure.shows == PLAYER)
        rows += [(figure.source, figure.shows.replace("_", " "), place) for place in places]
    columns = tuple(map(Column, HEADERS))
    return Table("figures", "Figures of the source", columns, tuple(rows)) if rows else None
