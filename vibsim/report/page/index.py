"""The index: every experiment with its verdict, on one page and in one table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any
from urllib.parse import quote

from vibsim import store
from vibsim.core.errors import FileError
from vibsim.core.vocabulary import SEVERITY, worst
from vibsim.report.page.page import environment
from vibsim.report.tables.checks import error_of, measured_order, number_of
from vibsim.report.tables.table import Column, Table, to_csv
from vibsim.report.text import words

UNREADABLE = ("DAMAGED", "MISSING")
"""Words for an experiment whose verdict cannot be read: it counts as failed."""
ORDER = ("FAIL", *UNREADABLE, "INCONCLUSIVE", "PASS")
"""The order in which the sentence counts experiments."""
HEADERS = (
    "collection", "experiment", "title", "experiment status", "check", "kind", "text", "quantity", "expected",
    "status", "reason", "scheme", "case", "order", "order_low", "order_high", "levels", "value",
    "error", "error_bound", "relative_error", "advice", "failures",
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One experiment in the index."""

    collection: str
    name: str
    title: str
    status: str
    why: str  # text and reason of the worst check, or what is wrong with the file
    counts: str = "–"
    failures: str = "–"
    link: str = ""
    thumbnail: str = ""
    checks: Sequence[Mapping[str, Any]] = ()
    broken: int = 0  # number of runs that broke down


def write_index(results: Path) -> None:
    """Write ``index.html`` and ``summary.csv`` over all experiments below a results folder.

    It holds ``<collection>/<experiment>/summary.json``. A damaged summary, and an experiment with results but without a
    summary, have a row of their own: what is not known to be right is not passed over.
    """
    patterns = ("*/*/summary.json", "*/*/convergence.nc", "*/*/level_*")
    folders = {path.parent for pattern in patterns for path in results.glob(pattern)}
    rows = [_row(results, folder) for folder in sorted(folders)]
    grouped = [(key, list(group)) for key, group in groupby(rows, key=lambda row: row.collection)]
    status = worst("FAIL" if row.status in UNREADABLE else row.status for row in rows)
    context = {"status": status, "sentence": _sentence(rows), "collections": grouped}
    page = environment().get_template("index.html").render(context)
    store.write_text(results / "index.html", page)
    cells = tuple(line for row in rows for line in _lines(row))
    table = Table("summary", "All checks", tuple(map(Column, HEADERS)), cells)
    store.write_text(results / "summary.csv", to_csv(table))


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
    checks, broken = summary["checks"], words.broken(summary)
    passed = sum(check["status"] == "PASS" for check in checks)
    return Row(
        collection, name, summary["title"], summary["status"], _why(checks), f"{passed} of {len(checks)}",
        str(broken), relative("report.html"), relative("figures/thumbnail.svg"), checks, broken,
    )  # fmt: skip


def _why(checks: Sequence[Mapping[str, Any]]) -> str:
    """Return the worst check and its reason."""
    if not checks:
        return "no checks"
    first = max(checks, key=lambda check: SEVERITY[check["status"]])
    if first["status"] == "PASS":
        return ", ".join(dict.fromkeys(str(check["reason"]) for check in checks))
    # what is conserved goes by its name on its page, too
    quantity = None if first["kind"] == "conserves" else first["quantity"]
    return f"{first['reason']}: {words.labelled(first['text'], quantity)}"


def _sentence(rows: Sequence[Row]) -> str:
    if not rows:
        return "There is no experiment here yet."
    statuses = [row.status for row in rows]
    told = [f"{statuses.count(word)} {word}" for word in ORDER if word in statuses]
    whole = "experiment" if len(rows) == 1 else "experiments"
    return f"{len(rows)} {whole}: {', '.join(told)}."


def _lines(row: Row) -> Iterator[tuple[Any, ...]]:
    """Yield one line per check, with the worst of its results; one line for an experiment that cannot be read."""
    head = (row.collection, row.name, row.title, row.status)
    if not row.checks:
        yield (*head, *[None] * 5, row.status, row.why, *[None] * 11, row.broken)
    of_check = ("id", "kind", "text", "quantity", "expected", "status", "reason")
    for check in row.checks:
        results = check.get("results") or [{}]
        decides = max(results, key=lambda r: SEVERITY[r.get("status") or "PASS"])
        measured = (
            decides.get("scheme"),
            decides.get("case"),
            *measured_order(decides),
            number_of(decides),
            *error_of(decides),
        )
        yield (*head, *map(check.get, of_check), *measured, check.get("advice"), row.broken)
