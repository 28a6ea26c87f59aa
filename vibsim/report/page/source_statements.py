"""The statements of the source texts over all experiments, with their outcomes, by text and section."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from vibsim.core.vocabulary import is_trap
from vibsim.experiment import citation
from vibsim.report.tables.source_figures import order

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


def listed(
    experiments: Iterable[tuple[str, str, Iterable[Mapping[str, Any]]]],
) -> list[tuple[str, list[Statement]]]:
    """Return the statements by section or exercise, in the order of the texts.

    Parameters
    ----------
    experiments
        Name, link to the page, and checks of the summary of every experiment.
    """
    found: dict[tuple[str, str, str], list[Statement]] = {}
    for name, link, checks in experiments:
        for check in checks:
            # summaries of older versions have no source
            source = check.get("source")
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
