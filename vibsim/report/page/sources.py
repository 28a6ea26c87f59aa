"""What the index of results says of the source texts: their figures, their statements with outcomes, their sections."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from vibsim.core import regular_files
from vibsim.core.vocabulary import is_trap
from vibsim.experiment import citation
from vibsim.report.page.templates import source
from vibsim.report.tables.source_figures import HEADERS

FIGURES = "tables/figures.csv"  # path within the results of an experiment
PAGE = "report.html"
_NUMBER = re.compile(r"(\d+)")


@dataclass(frozen=True)
class Place:
    """A figure on the page of an experiment."""

    name: str  # name of the experiment
    shows: str
    link: str


def figures(results: Path, folders: Iterable[Path]) -> list[tuple[str, list[Place]]]:
    """Return the figures of the texts in order, with their places on the pages of experiments.

    A table that cannot be read, or has other columns, counts as missing, since no verdict depends on it.
    """
    by_figure: dict[str, list[Place]] = {}
    for folder in folders:
        rows: list[dict[str, str]] = []
        with (
            suppress(OSError, ValueError, csv.Error),
            regular_files.reading(folder / FIGURES) as stream,
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


CORRECTION = "correction of the "  # prefix of the source of a claim that corrects a wrong text
CONFIRMED, CORRECTED, OPEN = "CONFIRMED", "CORRECTED", "OPEN"


@dataclass(frozen=True)
class Statement:
    """A statement of a text and its outcome in a run."""

    place: str  # equation, figure and exercise, if it has a section; else empty
    text: str  # the statement and the measurement
    note: str  # the truth, if the statement is wrong
    badge: str
    experiment: str
    link: str  # the page of the experiment; empty if it has none


def statements(
    experiments: Iterable[tuple[str, str, Iterable[Mapping[str, Any]]]],
) -> list[tuple[str, list[Statement]]]:
    """Return the statements by section or exercise, in the order of the texts.

    `experiments` are the name, the link to the page and the checks of the summary of every experiment.
    """
    found: dict[tuple[str, str, str], list[Statement]] = {}
    for name, link, checks in experiments:
        for check in checks:
            source = check.get("source")  # summaries of older versions have no source
            if check["kind"] == "claim" and source and any(source[p] for p in citation.PLACES):
                for place in _places(source):
                    found.setdefault(place, []).append(_statement(check, source, name, link))
    ordered = sorted(found, key=lambda p: (p[0], citation.PLACES.index(p[1]), order(p[2])))
    return [(citation.line({"text": p[0], p[1]: p[2]}), found[p]) for p in ordered]


def _statement(
    check: Mapping[str, Any], source: Mapping[str, str | None], name: str, link: str
) -> Statement:
    is_ours = str(source["text"]).startswith(CORRECTION)
    badge = CORRECTED if is_ours or is_trap(check) else CONFIRMED
    return Statement(
        citation.place(source) if source["section"] else "",
        "What is right: " * is_ours + str(check["text"]).removeprefix("Claim: "),
        str(check["note"] or ""),
        badge if check["status"] == "PASS" else OPEN,
        name,
        link,
    )


def _places(source: Mapping[str, str | None]) -> Iterator[tuple[str, str, str]]:
    """Yield text, kind and number of every section that the source names, else of every equation and so on."""
    kind = next(kind for kind in citation.PLACES if source[kind])
    text = str(source["text"]).removeprefix(CORRECTION)
    for number in citation.numbers(str(source[kind])):
        yield text, kind, number


SECTIONS = "sections.json"  # a file among the templates, written by ``workflow/catalogue.py``


@dataclass(frozen=True)
class Section:
    """A section or an exercise of a text."""

    heading: str
    search: str  # the text that a search looks through, in lower case
    see: list[str]  # commands and pages of the documentation
    experiments: list[tuple[str, str]]
    """Name without the collection, and link to the page, which is empty if the experiment has not run."""


def sections(links: Mapping[str, str]) -> list[tuple[str, list[Section]]]:
    """Return the texts with their sections, in order; `links` are the pages by ``collection/name``."""
    found: dict[str, list[Section]] = {}
    for one in json.loads(source(SECTIONS)):
        heading = f"{one['place'].capitalize()} {one['title']}".rstrip()
        words = (one["text"], heading, *one["words"], *one["experiments"])
        experiments = [
            (name.rpartition("/")[2], links.get(name, "")) for name in one["experiments"]
        ]
        section = Section(heading, " ".join(words).lower(), one["see"], experiments)
        found.setdefault(one["text"], []).append(section)
    return list(found.items())
