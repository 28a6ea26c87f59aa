"""The figures of the source texts and their places on a page, as a table that the index reads."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from vibsim.core import regular_files
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


FILE = "tables/figures.csv"  # path within the results of an experiment
PAGE = "report.html"
_NUMBER = re.compile(r"(\d+)")


@dataclass(frozen=True)
class Place:
    """A figure on the page of an experiment."""

    name: str  # name of the experiment
    shows: str
    link: str


def listed(results: Path, folders: Iterable[Path]) -> list[tuple[str, list[Place]]]:
    """Return the figures of the texts in order, with their places on the pages of experiments.

    A table that cannot be read, or has other columns, counts as missing, since no verdict depends on it.
    """
    by_figure: dict[str, list[Place]] = {}
    for folder in folders:
        rows: list[dict[str, str]] = []
        with (
            suppress(OSError, ValueError, csv.Error),
            regular_files.reading(folder / FILE) as stream,
        ):
            rows = list(csv.DictReader(stream.read().decode().splitlines()))
        page = quote((folder / PAGE).relative_to(results).as_posix())
        for row in rows:
            figure, shows, place = (row.get(name) or "" for name in HEADERS)
            places = by_figure.setdefault(figure, [])
            # the link leads to the first of several pictures
            if place and (folder.name, shows) not in {(p.name, p.shows) for p in places}:
                places.append(Place(folder.name, shows, f"{page}#{quote(place)}"))
    return sorted(((f, p) for f, p in by_figure.items() if f and p), key=lambda row: order(row[0]))


def order(figure: str) -> list[tuple[int, str]]:
    """Return a sort key that orders figures by number: figure 2 before figure 10."""
    return [
        (int(part), "") if part.isdigit() else (0, part) for part in _NUMBER.split(figure.lower())
    ]
