"""The tables of a page: each is a file, and the page shows the first rows as long as there is room."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.report import choice, words
from vibsim.report.choice import CheckedLadder
from vibsim.report.figures import work
from vibsim.report.page.page_figures import Sources
from vibsim.report.tables import (
    best,
    checks,
    degrees,
    levels,
    members,
    published,
    source_figures,
    theory,
)
from vibsim.report.tables.latex import to_latex
from vibsim.report.tables.scales import table as scales_table
from vibsim.report.tables.table import Table, to_csv

MOST_ROWS = 8  # of a table in the page; the CSV file holds all
ROOM = 220  # most cells of all tables of numbers in the page; further tables are files only
COPIED = 40_000  # most characters of a table that a page holds whole, for copying
OWNERS = ("scheme", "member")  # headers of the columns that say whose numbers a row has
LONG_HEADING = 90  # most characters of a heading; longer captions are shortened


def collect(
    summary: Mapping[str, Any], lead: CheckedLadder, sources: Sources
) -> tuple[dict[str, dict[str, str]], dict[str, Any]]:
    """Return the texts of all tables, and the content of the page by the names that its template uses.

    The quantity of `lead` comes first; `sources` are the figures of the source with their pictures.
    """
    record = lead.record
    everyone = members.table(record)
    listed, others = _of_numbers(everyone, lead)
    printed = published.tables(record, summary)
    scales = scales_table(record)
    broken = checks.failures(summary, record)
    every = [*printed, *listed, *others, scales, checks.checks(summary), broken]
    every += [source_figures.table(sources), everyone]
    texts = texts_of(table for table in every if table is not None)
    failures, count = words.broken(summary), len(summary["failures"])
    return texts, {
        "failures": broken and cut(broken),
        "unlisted": f"{failures} runs broke down; the first {count} are listed." * (failures > count),
        "numbers_shown": [headed(*cut(table)) for table in listed],
        # for the copy buttons, which a very long table does not have
        "tables": {
            table.name: texts[table.name] if max(map(len, texts[table.name].values())) <= COPIED else {}
            for table in (*printed, *listed)
        },
        "scales": scales,
        "printed": printed,
        "printed_sentence": published.sentence(printed),
        "digits": members.digits(record),
    }  # fmt: skip


def _of_numbers(everyone: Table | None, lead: CheckedLadder) -> tuple[list[Table], list[Table]]:
    """Return the tables of numbers that the page has room for, and those that are files only.

    The tables of the quantity and of the member of `lead` come first.
    """
    record = lead.record
    model = record.model
    found = sorted(choice.quantities(record), key=lambda quantity: quantity != lead.quantity)
    members_of = choice.members(record, choice.first(record), lead.member)
    shown = choice.with_levels(record, members_of)
    norms = [name for name in record.words("norm") if name != TYPICAL_NORM]
    orders = [levels.orders(record, quantity, shown) for quantity in found]
    checked = [check.value for check in choice.asked_values(record)]
    wanted = [
        *orders[:1], best.table(record, shown, checked), theory.schemes(record), *orders[1:],
        degrees.table(record.experiment), levels.scalars(record, shown), levels.events(record),
        *theory.predictions(record),
        # energy changed by damping or a force is not an error of the scheme
        *((levels.velocities(record), levels.maxima(record, shown)) if model.conservative else ()),
        None if record.is_lean else work.table(record),
    ]  # fmt: skip
    if everyone is not None and len(everyone.rows) <= MOST_ROWS:
        wanted.append(everyone)
    listed, room = list[Table](), ROOM
    others = [levels.orders(record, quantity, shown, norm) for quantity in found for norm in norms]
    for table in wanted:
        if table is None:
            continue
        room -= len(table.columns) * min(len(table.rows), MOST_ROWS)
        (listed if room >= 0 or not listed else others).append(table)
    return listed, others


def cut(table: Table) -> tuple[str, Table, str]:
    """Return the heading of a table, its first rows in whole blocks, and a sentence on the remaining rows."""
    shown = table.rows[:MOST_ROWS]
    if len(shown) < len(table.rows) and (heads := table.heads):
        # drop a block that does not fit, unless it is the first
        last = table.rows[len(shown)][:heads]
        shown = tuple(row for row in shown if row[:heads] != last) or shown
    more = len(table.rows) - len(shown)
    note = f"{more} more {'row is' if more == 1 else 'rows are'} in tables/{table.name}.csv." * (
        more > 0
    )
    return _heading(table.caption), replace(table, rows=shown).without_empty(), note


def headed(heading: str, table: Table, note: str) -> tuple[str, Table, str]:
    """Move the scheme and the member that all rows of a table share from their columns to its heading."""
    common = [
        i
        for i, column in enumerate(table.columns)
        if column.header in OWNERS and i >= table.heads and len({row[i] for row in table.rows}) == 1
    ]
    others = [i for i in range(len(table.columns)) if i not in common]
    return ", ".join([heading, *(str(table.rows[0][i]) for i in common)]), table.only(others), note


def _heading(caption: str) -> str:
    """Return the heading of a table: its caption, or the beginning of a long one."""
    found = (re.split(end, caption, maxsplit=1)[0] for end in ("$", r"; |\. ", r": | \("))
    return next((text for text in found if len(text) <= LONG_HEADING), caption)


def texts_of(tables: Iterable[Table]) -> dict[str, dict[str, str]]:
    """Return each table as text, by its name and the name of the format."""
    return {table.name: {"CSV": to_csv(table), "LaTeX": to_latex(table)} for table in tables}


def files_of(written: Mapping[str, Mapping[str, str]]) -> dict[str, bytes]:
    """Return the files of tables by name, from their `texts_of`."""
    found = {}
    for name, texts in written.items():
        found[f"{name}.csv"] = texts["CSV"].encode()
        found[f"{name}.tex"] = texts["LaTeX"].encode()
    return found
