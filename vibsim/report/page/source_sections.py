"""The sections and exercises of the source texts, each with its experiments, for the index of results."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

from vibsim.report.page.templates import source

FILE = "sections.json"  # a file among the templates, written by ``workflow/catalogue.py``


@dataclass(frozen=True)
class Section:
    """A section or an exercise of a text."""

    heading: str
    search: str  # the text that a search looks through, in lower case
    see: list[str]  # commands and pages of the documentation
    experiments: list[tuple[str, str]]
    """Name without the collection, and link to the page, which is empty if the experiment has not run."""


def listed(links: Mapping[str, str]) -> list[tuple[str, list[Section]]]:
    """Return the texts with their sections, in order.

    Parameters
    ----------
    links
        The pages of the experiments that have run, by ``collection/name``.
    """
    found: dict[str, list[Section]] = {}
    for one in json.loads(source(FILE)):
        heading = f"{one['place'].capitalize()} {one['title']}".rstrip()
        words = (one["text"], heading, *one["words"], *one["experiments"])
        experiments = [
            (name.rpartition("/")[2], links.get(name, "")) for name in one["experiments"]
        ]
        section = Section(heading, " ".join(words).lower(), one["see"], experiments)
        found.setdefault(one["text"], []).append(section)
    return list(found.items())
