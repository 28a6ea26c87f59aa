"""Verdicts for a terminal: a line for each experiment, and below it the checks that did not pass, or all checks."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from vibsim.cli.terminal import clean, painted
from vibsim.core.decimals import order_interval
from vibsim.core.set_option import set_options
from vibsim.core.vocabulary import SEVERITY, is_trap

Entry = Mapping[str, Any]
"""The summary of an experiment, or an entry with an ``error`` in its place; or one of its checks; or a failed job."""
_NARROWEST = 30  # smallest width of a text, however narrow the terminal


def in_lines(summaries: Sequence[Entry], columns: int) -> Iterator[str]:
    """Yield a line for each experiment, with its headline; below it the checks that did not pass, with advice."""
    names = [_name(entry) for entry in summaries]
    width = max(map(len, names), default=0)
    badge = max((len(entry["status"]) for entry in summaries), default=0)
    for entry, name in zip(summaries, names, strict=True):
        status = painted(entry["status"].ljust(badge), entry["status"])
        line = headline(entry, max(columns - badge - width - 4, _NARROWEST))
        yield f"{status}  {name.ljust(width)}  {line}".rstrip()
        yield from checks([row for row in entry["checks"] if row["status"] != "PASS"], columns)


def in_full(summaries: Sequence[Entry], columns: int) -> Iterator[str]:
    """Yield every check of every experiment: one that passed has one line, any other its whole text."""
    for entry in summaries:
        yield f"{_name(entry)}  {painted(entry['status'], entry['status'])}"
        if "error" in entry:
            yield f"  {clean(entry['error'])}"
        else:
            yield from checks(entry["checks"], columns)


def of_failures(failures: Sequence[Entry]) -> Iterator[str]:
    """Yield the failed jobs with the ends of their logs; jobs with the same end are only counted."""
    ends = [tuple(failure["tail"]) for failure in failures]
    for i, failure in enumerate(failures):
        if ends[i] and ends[i] in ends[:i]:
            continue
        yield f"\nfailed: {failure['job']} (log: {failure['log']})"
        yield from (f"  {clean(line)}" for line in failure["tail"])
        if ends[i] and (more := ends.count(ends[i]) - 1):
            yield f"  {more} more {'job' if more == 1 else 'jobs'} failed with the same message"


def count(summaries: Sequence[Entry], status: str) -> str:
    """Return the numbers of experiments and of passed checks, with the status of the whole run."""
    statuses = [check["status"] for entry in summaries for check in entry["checks"]]
    experiments = "1 experiment" if len(summaries) == 1 else f"{len(summaries)} experiments"
    passed = "no check was judged"
    if statuses:
        passed = f"{statuses.count('PASS')} of {len(statuses)} checks passed"
    return f"{experiments}, {passed}: {painted(status, status)}"


def checks(rows: Sequence[Entry], columns: int) -> Iterator[str]:
    """Yield the lines of checks: a passed check has one line, any other its whole text and advice."""
    fields = ("status", "reason", "id")
    table = [[str(check[field] or "") for field in fields] for check in rows]
    widths = [max((len(row[i]) for row in table), default=0) for i in range(3)]
    for row, check in zip(table, rows, strict=True):
        cells = [cell.ljust(width) for cell, width in zip(row, widths, strict=True)]
        plain = "  " + "  ".join(cells)
        head = plain.replace(cells[0], painted(cells[0], row[0]), 1)
        if check["status"] == "PASS":
            room = max(columns - len(plain) - 2, _NARROWEST)
            text = textwrap.shorten(clean(check["text"]), room, placeholder=" ...")
            yield f"{head}  {text}"
            continue
        yield head.rstrip()
        for text in filter(None, (check["text"], check["advice"])):
            filled = textwrap.fill(clean(text), max(columns - 6, _NARROWEST))
            yield textwrap.indent(filled, " " * 6)


def decisive(rows: Sequence[Entry]) -> Entry | None:
    """Return the worst check; of equals one that is no trap, then one with an order, then the first; None of none."""

    def rank(row: Entry) -> tuple[int, bool, bool]:
        return -SEVERITY[row["status"]], is_trap(row), not numbers(row)

    return min(rows, key=rank, default=None)


def headline(entry: Entry, columns: int) -> str:
    """Return the result of an experiment in at most `columns` characters: order and error, or why it did not pass."""
    rows: Sequence[Entry] = entry["checks"]
    first = decisive(rows)
    if first is None:
        candidates = [str(entry.get("error") or "no checks")]
    elif first["status"] == "PASS":
        candidates = numbers(first) or [str(first["text"])]
    else:
        missed = sum(row["status"] != "PASS" for row in rows)
        reason = str(first["reason"])
        candidates = [f"{reason} ({missed} of {len(rows)} checks did not pass)", reason]
    fitting = next((text for text in candidates if len(text) <= columns), candidates[-1])
    return textwrap.shorten(clean(fitting), columns, placeholder=" ...")


def numbers(check: Entry) -> list[str]:
    """Return the order of a check, its interval and the error of the finest level, in texts from long to short.

    The list is empty for a check without an order.
    """
    facts = check["results"][0]["facts"] if check["results"] else {}
    order, low, high = (facts.get(name) for name in ("order", "order_low", "order_high"))
    if order is None:
        return []
    head = f"{check['quantity']}: order {order:.3f}"
    ends = order_interval(low, high)
    between = f" ({' to '.join(ends)})" if len(ends) > 1 else ""
    error = facts.get("relative_error")
    error_text = "" if error is None else f", relative error {error:.2g}"
    total = sum(check["counts"].values())
    hardest = f", the hardest of {total}" if total > 1 else ""
    full = head + between + error_text
    return [full + hardest, full, head + error_text, head]


def _name(entry: Entry) -> str:
    """Return the name of an experiment, with the settings of the command line."""
    settings = set_options(entry.get("settings", ()))
    return clean(f"{entry['collection']}/{entry['experiment']}{settings}")
