"""The index: every experiment with its verdict, on one page and in one table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any
from urllib.parse import quote

from vibsim import store
from vibsim.core.errors import FileError
from vibsim.core.vocabulary import SEVERITY, is_trap, worst
from vibsim.experiment import citation
from vibsim.experiment.collection import ADHOC, SITE
from vibsim.report import words
from vibsim.report.page import history, sources
from vibsim.report.page.templates import digest_of, environment, source
from vibsim.report.tables.table import Column, Table, to_csv

UNREADABLE = ("DAMAGED", "MISSING")  # statuses without a readable verdict, which count as failed
FILTERS = (
    ("PASS", "passed"),
    ("INCONCLUSIVE", "undecided"),
    ("FAIL", "failed"),
    ("UNREADABLE", "damaged or missing"),
    (words.TRAP, "with a trap caught"),
    (words.REFUTED, "with a statement shown to be false"),
)
"""Filters of the cards, with their words."""
HEADERS = (
    "collection", "experiment", "title", "source", *citation.PLACES, "experiment status",
    "check", "kind", "text", "quantity", "expected", "status", "reason", "scheme", "case", "order",
    "order_low", "order_high", "levels", "value", "error", "error_bound", "relative_error", "advice", "failures",
)  # fmt: skip
LONGEST = 90  # most characters of a finding in place of numbers


@dataclass(frozen=True)
class Headline:
    """The result of an experiment in two numbers or in words."""

    order: str = ""
    interval: str = ""
    error: str = ""
    text: str = ""  # the finding, if no check has an order or an error

    def __str__(self) -> str:
        """Return the number with which a later run is compared."""
        return f"order {self.order}" if self.order else self.error or self.text


@dataclass(frozen=True)
class Row:
    """One experiment in the index."""

    collection: str
    name: str
    title: str
    status: str
    why: str  # reason and text of the worst check, or the fault of the file; empty if all passed
    passed: int = 0
    link: str = ""
    picture: str = ""
    source: Mapping[str, str | None] | None = None  # its source, by `citation.FIELDS`
    checks: Sequence[Mapping[str, Any]] = ()
    broken: int = 0  # number of runs that broke down
    headline: Headline = field(default_factory=Headline)
    marks: Sequence[tuple[str, int]] = ()  # the `words.MARKS` of its checks, each with its number

    @property
    def key(self) -> str:
        """Name of its folder in the results."""
        return f"{self.collection}/{self.name}"

    @property
    def tags(self) -> list[str]:
        """The filters that it matches."""
        status = "UNREADABLE" if self.status in UNREADABLE else self.status
        return [status, *(mark for mark, _ in self.marks)]

    @property
    def counts(self) -> str:
        """How many checks passed."""
        return f"{self.passed} of {len(self.checks)}{' passed' * (self.passed < len(self.checks))}"

    @property
    def stands(self) -> str:
        """Its source in one line."""
        return citation.line(self.source) if self.source else ""

    @property
    def search(self) -> str:
        """The text that a search looks through, in lower case."""
        found = (result.get("scheme") for check in self.checks for result in check["results"])
        checked = (check["quantity"] for check in self.checks)
        known = dict.fromkeys(str(word) for word in (*found, *checked) if word)
        return " ".join((self.title, self.key, self.stands, *known)).lower()


def write_index(results: Path) -> None:
    """Write ``index.html`` and ``summary.csv`` over all experiments below a results folder.

    The folder holds ``<collection>/<experiment>/summary.json``. A damaged summary, and results without a summary, get a
    card as well, so that nothing unverified is overlooked. Data that differ between runs are in a separate file
    (`history`).
    """
    patterns = ("*/*/summary.json", "*/*/convergence.nc", "*/*/level_*")
    folders = {path.parent for pattern in patterns for path in results.glob(pattern)}
    rows = [_row(results, folder) for folder in sorted(folders)]
    status = worst("FAIL" if row.status in UNREADABLE else row.status for row in rows)
    shipped = [row for row in rows if row.collection != ADHOC]
    tags = [tag for row in rows for tag in row.tags]
    template = environment().get_template("index.html")
    context = {
        "status": status,
        "heading": _heading(rows),
        "filters": [(tag, word, tags.count(tag)) for tag, word in FILTERS],
        "own": [row for row in rows if row.collection == ADHOC],
        "shipped": [(key, list(group)) for key, group in groupby(shipped, lambda r: r.collection)],
        "figures": sources.figures(results, sorted(folders)),
        "statements": sources.statements((row.name, row.link, row.checks) for row in rows),
        "sections": sources.sections({row.key: row.link for row in rows if row.link}),
        "site": f"{SITE}/index.html" if (results / SITE / "index.html").is_file() else "",
        "history": history.FILE,
        "script": source("index.js"),
        "script_digest": digest_of(source("index.js")),
    }
    store.write_text(results / "index.html", template.render(context))
    cells = tuple(line for row in rows for line in _lines(row))
    table = Table("summary", "All checks", tuple(map(Column, HEADERS)), cells)
    store.write_text(results / "summary.csv", to_csv(table))
    history.update(results, {row.key: (row.status, str(row.headline)) for row in rows})


def _row(results: Path, folder: Path) -> Row:
    collection, name = folder.parent.name, folder.name

    def relative(part: str) -> str:
        path = folder / part
        return quote(path.relative_to(results).as_posix()) if path.is_file() else ""

    if not relative("summary.json"):
        why = "no summary: the run of this experiment has not come to its end"
        return Row(collection, name, name, "MISSING", why)
    try:
        summary = store.read_json(folder / "summary.json", name=f"{collection}/{name}")
    except FileError as error:
        return Row(collection, name, name, "DAMAGED", f"summary.json: {error.reason}")
    checks = summary["checks"]
    return Row(
        collection, name, summary["title"], summary["status"], _why(checks),
        sum(check["status"] == "PASS" for check in checks), relative("report.html"),
        relative("figures/thumbnail.svg"), summary.get("source"), checks, words.broken(summary), headline(checks),
        words.marks(checks),
    )  # fmt: skip


def _why(checks: Sequence[Mapping[str, Any]]) -> str:
    """Return the reason and the text of the worst check; empty if all passed."""
    if not checks:
        return "no checks"
    first = max(checks, key=lambda check: SEVERITY[check["status"]])
    if first["status"] == "PASS":
        return ""
    # a page names the conserved quantity in words
    quantity = None if first["kind"] == "conserves" else first["quantity"]
    return f"{first['reason']}: {words.labelled(first['text'], quantity)}"


def headline(checks: Sequence[Mapping[str, Any]]) -> Headline:
    """Return the numbers of the worst check that has any, else the finding of the first check that passed.

    Traps have no headline order; failures are described elsewhere.
    """
    ranked = sorted(checks, key=lambda check: -SEVERITY[check["status"]])
    found = [(check, _decides(check)) for check in ranked]
    wanted = [(check, result) for check, result in found if not is_trap(check)]
    for _, result in wanted:
        order, relative = (words.fact(result, name) for name in ("order", "relative_error"))
        if result.get("status") == "INCONCLUSIVE":
            order = None  # at most an estimate
        if order is not None or relative is not None:
            interval = words.interval(words.interval_of(result))
            return Headline(
                "" if order is None else words.number(order, "order"),
                "" if interval == "–" else interval,
                _share(relative),
            )
    passed = [] if ranked and ranked[0]["status"] != "PASS" else wanted or found
    for check, result in passed:
        sentence = str(result.get("sentence") or "").partition("; ")[0].rstrip(".")
        text = words.PAGE.powers(words.labelled(sentence, check["quantity"]))
        named, space, rest = text.partition(" ")
        if rest.startswith(("is ", "of ")):
            text = f"{words.PAGE.value(named)}{space}{rest}"
        if text:
            return Headline(text=f"{text[: LONGEST - 1]}…" if len(text) > LONGEST else text)
    return Headline()


def _share(relative: float | None) -> str:
    """Write a relative error; empty where it is not known."""
    if relative is None:
        return ""
    return f"{words.number(relative, 'brief')} of its size" if relative else "0, in every digit"


def _heading(rows: Sequence[Row]) -> str:
    """Return the finding over all experiments."""
    if not rows:
        return "There is no experiment here yet"
    whole = "experiment" if len(rows) == 1 else "experiments"
    total, passed = sum(len(row.checks) for row in rows), sum(row.passed for row in rows)
    return f"{len(rows)} {whole}, {passed} of {total} checks passed"


def _decides(check: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the worst result of a check."""
    results = check.get("results") or [{}]
    found: Mapping[str, Any] = max(results, key=lambda r: SEVERITY[r.get("status") or "PASS"])
    return found


def _lines(row: Row) -> Iterator[tuple[Any, ...]]:
    """Yield one line per check, with the worst of its results; one line for an experiment that cannot be read."""
    of_check = ("id", "kind", "text", "quantity", "expected", "status", "reason")
    for check in row.checks or [{"status": row.status, "reason": row.why}]:
        decides = _decides(check)
        yield (
            row.collection, row.name, row.title, *_source(row, check), row.status, *map(check.get, of_check),
            decides.get("scheme"), decides.get("case"), *words.measured(decides), check.get("advice"), row.broken,
        )  # fmt: skip


def _source(row: Row, check: Mapping[str, Any]) -> tuple[str | None, ...]:
    """Return the source of a check, by `citation.FIELDS`: its own, else that of its experiment."""
    found = check.get("source") or row.source or {}
    return tuple(found.get(name) for name in citation.FIELDS)
