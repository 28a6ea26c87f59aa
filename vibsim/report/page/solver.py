"""The page of an experiment with the user's own solver: a card for each check, the members of a sweep, the setup."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from vibsim import store
from vibsim.convergence import LadderVerdict
from vibsim.core.record import Record
from vibsim.experiment.solver import SolverExperiment, restore
from vibsim.report import style, words
from vibsim.report.figures import drawing, thumbnail
from vibsim.report.page import study
from vibsim.report.page.cards import provenance_rows
from vibsim.report.page.page import replace_files
from vibsim.report.page.page_tables import files_of, texts_of
from vibsim.report.page.templates import environment, sealed
from vibsim.report.tables import checks as check_tables
from vibsim.report.tables.table import Column, Filled, Table, filled, keyed
from vibsim.report.text.setting import not_in_file
from vibsim.report.types import Plan
from vibsim.solver import analysis


@style.applied()
def write(
    plan: Plan,
    convergence: Record,
    summary: Mapping[str, Any],
    directory: Path,
    formats: Sequence[str] = ("svg",),
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Write ``report.html``, ``figures/`` and ``tables/``; arguments as for `vibsim.report.write`."""
    experiment = restore(plan.content, plan.source_file, plan.settings)
    cards, tables = [], [check_tables.checks(summary)]
    figures: dict[str, bytes] = {}
    shown: dict[tuple[str, int], str] = {}
    for check, entry in zip(experiment.checks, summary["checks"], strict=True):
        verdict = analysis.restored(experiment, convergence, check, entry)
        card = _card(experiment, verdict, entry)
        # of one ladder the picture and the levels stand once
        first = shown.setdefault((verdict.quantity, entry["results"][0]["case"]), card["heading"])
        cards.append(card | {"above": "" if first == card["heading"] else first})
        tables += [table for table in (card["table"], card["members"]) if table]
        figures |= dict(_thumbnail(verdict)) if not figures else {}
        figures |= drawing.files(card["picture"], formats)
    replace_files(directory / "figures", figures)
    replace_files(directory / "tables", files_of(texts_of(tables)))
    context = {
        "status": summary["status"],
        "counts": words.passed([entry["status"] for entry in summary["checks"]]),
        "finding": study.finding([card["verdict"] for card in cards]),
        "path": f"{plan.collection} / {plan.name}",
        "title": plan.title,
        "source": plan.source or "",
        "home": "../../index.html",
        "cards": cards,
        "setup": list(_setup(experiment)),
        "provenance": list(provenance_rows(provenance or {})),
        "facts": "summary.json",
    }
    page = environment().get_template("study.html").render(context)
    store.write_text(directory / "report.html", sealed(page))


def _card(
    experiment: SolverExperiment, verdict: LadderVerdict, entry: Mapping[str, Any]
) -> dict[str, Any]:
    files = [] if experiment.sweep else [f"level_{level:02d}.nc" for level in experiment.levels]
    card = study.card(entry["id"], verdict, entry["expected"], files)
    caption = card["table"].caption
    if experiment.sweep:
        caption = f"Levels of member {entry['results'][0]['case']}{caption.removeprefix('Levels')}"
    return card | {
        "heading": f"{verdict.quantity}: {entry['expected']}",
        "verdict": replace(verdict, status=entry["status"], reason=entry["reason"]),
        "table": replace(card["table"], name=f"levels_{entry['id']}", caption=caption),
        "members": _members(entry) if experiment.sweep else None,
    }


def _members(entry: Mapping[str, Any]) -> Table:
    """Return the table of the members in the summary, the worst first."""
    results = entry["results"]
    forms = {"order": "order", "error": "small", "error_bound": "small", "best": "full"}

    def value(name: str) -> Filled:
        return Column(name), lambda result: str(result["values"][name])

    def fact(name: str) -> Filled:
        column = Column(name.replace("_", " "), form=forms[name])
        return column, lambda result: words.fact(result, name)

    columns: list[Filled] = [
        (Column("member", form="integer"), itemgetter("case")),
        *map(value, results[0]["values"]),
        (Column("measured"), itemgetter("status")),
        keyed("reason"),
        *(fact(name) for name in forms if name in results[0]["facts"]),
    ]
    caption = f"Members, the worst first: {len(results)} of {sum(entry['counts'].values())}"
    return filled(f"members_{entry['id']}", caption, columns, results)


def _thumbnail(verdict: LadderVerdict) -> Iterator[tuple[str, bytes]]:
    """Yield the thumbnail for the index: errors or differences over the levels, if there are at least two."""
    found = np.array([abs(level.error or level.difference or 0.0) for level in verdict.levels])
    places = np.flatnonzero(found)
    if places.size > 1:
        line = places.astype(np.float64), np.log10(found[places])
        yield "thumbnail.svg", thumbnail.document([line]).encode()


def _setup(experiment: SolverExperiment) -> Iterator[tuple[str, str]]:
    """Yield the setup of the solver as pairs of term and text."""
    kinds = {"command": "Command", "python": "Function", "files": "Files"}
    yield kinds[experiment.solver.kind], experiment.solver.text
    yield from not_in_file(experiment.settings)
    if experiment.solver.inputs:
        yield "Inputs", ", ".join(experiment.solver.inputs)
    for name, sizes in experiment.sizes.items():
        yield f"Size {name}", ", ".join(words.number(size, "step") for size in sizes)
    for name, value in experiment.values.items():
        yield f"Parameter {name}", str(value)
    if experiment.sweep:
        yield "Sweep", f"{experiment.members} members over {', '.join(experiment.sweep.keys)}"
    for name, row in experiment.quantities.items():
        over = f" over {', '.join(row.coordinates)}" if row.coordinates else ""
        yield f"Quantity {name}", f"compared by {row.restrict}{over}"
