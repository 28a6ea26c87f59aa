"""The report of one experiment: one page that opens anywhere, with its figures and tables as files beside it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from vibsim import store
from vibsim.core.errors import VibsimError, nearest
from vibsim.core.home import called, home, is_installed
from vibsim.core.record import Record
from vibsim.core.set_option import command_to_run
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.experiment.collection import ADHOC, ENDINGS
from vibsim.report import choice, data, style, words
from vibsim.report.figures import drawing, gallery, of_source, thumbnail, work
from vibsim.report.figures.sweeps.view import View
from vibsim.report.page import cards, explorer, hero, player
from vibsim.report.page.templates import environment, markup, sealed
from vibsim.report.style import Picture
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
from vibsim.report.text import equation, experiment_file, setting
from vibsim.report.types import Experiment, Plan

NOTHING: Mapping[str, Any] = {}
MOST_ROWS = 8  # of a table that the page itself holds; the CSV file holds all
ROOM = 220  # cells of all tables of numbers together; a table beyond is a file only
BYTES = 1_000_000  # of all figures behind tabs; figures beyond are files only
FIGURES = 6  # most figures behind the tabs of a section
COPIED = 40_000  # letters of a table that a page holds whole, to be copied; a longer one is a file
LONG_HEADING = 90  # letters of a caption of which a heading has the first words only
PYTHON = """\
from vibsim import Experiment, analyse, simulate, verdicts

experiment = Experiment.from_yaml("{file}"{given}){alone}
convergence = analyse(experiment, {{level: simulate(experiment, level) for level in experiment.levels}})
for verdict in verdicts(experiment, convergence):
    print(verdict.id, verdict.status, verdict.reason)"""


@style.applied()
def write(
    plan: Plan,
    convergence: Record,
    summary: Mapping[str, Any],
    directory: Path,
    formats: Sequence[str] = ("svg",),
    provenance: Mapping[str, Any] = NOTHING,
) -> None:
    """Write ``report.html``, ``figures/`` and ``tables/`` of one experiment.

    Parameters
    ----------
    plan
        The plan of the experiment; its ``experiment`` is read.
    convergence
        What the analysis found, as stored in ``convergence.nc``.
    summary
        The verdicts, as stored in ``summary.json``.
    directory
        Folder of the experiment's results.
    formats
        Of ``svg``, ``png``, ``pdf``; SVG is always written, the others are written beside it.
    provenance
        What the results came from: digests, versions, the part of the experiment that the job used.

    Raises
    ------
    VibsimError
        For a format that does not exist.
    """
    unknown = [form for form in formats if form not in drawing.FORMATS]
    if unknown:
        raise VibsimError(f"figure format '{unknown[0]}': {nearest(unknown[0], drawing.FORMATS)}")
    experiment, position = plan.experiment, choice.position(plan.experiment)
    shown, left_out = gallery.choose(experiment, convergence)
    decisive = choice.find_lead(experiment, convergence, summary)
    drawn = _Drawn(formats)
    first = [drawn.add(one) for one in hero.pictures(experiment, convergence, decisive)]
    sources = of_source.pictures(experiment, convergence, decisive)
    sourced = [drawn.add(picture) for _, found in sources for picture in found]
    names = [picture.name for picture, _ in (*first, *sourced)]
    below = gallery.pictures(experiment, convergence, shown, decisive, names)
    moving = [drawn.add(picture) for picture in below.motion]
    drawings = {"hero": first, "source": sourced, "motion": moving}
    belief, views = drawn.tabs(below.belief), drawn.views(below.members)
    small = thumbnail.thumbnail(experiment, convergence, shown[0])
    replace_files(directory / "figures", {**drawn.files, "thumbnail.svg": small.encode()})
    everyone = members.table(convergence, position)
    listed, others = _tables(experiment, convergence, everyone, decisive.quantity)
    scales = scales_table(experiment, convergence)
    printed = published.tables(experiment, convergence, summary)
    broken = checks.failures(summary, convergence)
    every = [*printed, *listed, *others, scales, checks.checks(summary), broken]
    every += [source_figures.table(sources), everyone]
    written = {table.name: texts_of(table) for table in every if table is not None}
    files = files_of(written)
    kept = ("members.csv",) if data.swept(convergence) else ()
    if kept:
        members.write_csv(directory / "tables/members.csv", convergence, position)
        files.pop("members.csv", None)
    replace_files(directory / "tables", files, kept)
    played = player.element(experiment, convergence)
    made = cards.cards(experiment, convergence, summary)
    lead = decisive.entry["id"] if decisive.entry else None
    if "hero_evidence" in names:
        made = [c | {"picture": None} if c["id"] == lead else c for c in made]
    alone, alike = cards.gathered(made, lead)
    failures, more = words.broken(summary), len(summary.get("failures") or [])
    page = environment().get_template("report.html").render(
        hero.context(experiment, convergence, summary, decisive)
        | {
            "collection": experiment.collection,
            "name": experiment.name,
            "title": experiment.title,
            "status": summary["status"],
            "lead": next((c for c in made if c["id"] == lead), None),
            "figures": drawings | {"belief": belief, "members": views},
            "reading": {name: _captions(group) for name, group in drawings.items()}
            | {"belief": _captions(one for _, group in belief for one in group)}
            | {"members": _readings(view.picture for view, _ in views)},
            "members": explorer.content(experiment, convergence, [view for view, _ in views]),
            "worst": explorer.worst(experiment, convergence, [view for view, _ in views]),
            "shared": below.shared,
            "checks": alone,
            "alike": alike,
            "reading_of_checks": _reading_of_checks(alone),
            "failures": broken and cut(broken),
            "unlisted": f"In all {failures} runs broke down; listed are the first {more}." * (failures > more),
            "numbers_shown": [cut(table) for table in listed],
            "tables": {table.name: copied(written[table.name]) for table in (*printed, *listed)},
            "scales": scales,
            "undrawn": of_source.undrawn(sources, has_player=bool(played)),
            "player_source": of_source.of_player(experiment),
            "player": markup(played),
            "printed": printed,
            "printed_sentence": published.sentence(printed),
            "shown": left_out,
            "more_figures": ", ".join(drawn.left_out),
            "digits": members.digits(convergence),
            "equation": equation.mathml(experiment.model.definition.equation),
            "setup": list(setting.setup(experiment, convergence)),
            "experiment_file": experiment_file.text(experiment),
            "experiment_shown": experiment_file.shown(experiment),
            "provenance": list(cards.provenance_rows(provenance)),
            "command": called(command_to_run(experiment.word, experiment.settings)),
            "python": _python(experiment),
        }
    )  # fmt: skip
    store.write_text(directory / "report.html", sealed(page))


class _Drawn:
    """Pictures as markup for the page, and as files beside it."""

    def __init__(self, formats: Sequence[str]) -> None:
        self.formats = formats
        self.files: dict[str, bytes] = {}
        self.room = BYTES
        self.left_out: list[str] = []
        """Labels of tabs that are files only."""

    def add(self, picture: Picture) -> tuple[Picture, str]:
        """Return a picture with its markup, and keep its files."""
        files = drawing.files(picture, self.formats)
        self.files |= files
        text = files[f"{picture.name}.svg"].decode()
        return picture, markup(drawing.inline(text, picture.alt))

    def tabs(self, tabs: Sequence[gallery.Tab]) -> list[tuple[str, list[tuple[Picture, str]]]]:
        """Return the labels of tabs with their pictures, as long as the page has room; the others are files only."""
        found, most = [], FIGURES
        for tab in tabs:
            added = [self.add(picture) for picture in tab.pictures]
            most -= len(added)
            self.room -= sum(len(text) for _, text in added)
            if most >= 0 and self.room >= 0:
                found.append((tab.label, added))
            else:
                self.left_out.append(tab.label)
        return found

    def views(self, views: Sequence[View]) -> list[tuple[View, str]]:
        """Return the views of members with their markup, as long as the page has room; the others are files only."""
        found = []
        for view in views:
            picture, text = self.add(view.picture)
            self.room -= len(text)
            if self.room >= 0:
                found.append((view, text))
            else:
                self.left_out.append(picture.title)
        return found


def _captions(drawn: Iterable[tuple[Picture, str]]) -> list[tuple[str, str]]:
    """Return how to read each kind of picture, once: what stands before the first colon of its title, and a caption.

    A caption that several kinds share stands once, too.
    """
    found: dict[str, Picture] = {}
    for picture, _ in drawn:
        kind = picture.title.partition(":")[0].partition("?")[0]
        found.setdefault(kind + "?" * ("?" in picture.title), picture)
    return _readings(replace(picture, title=kind) for kind, picture in found.items())


def _readings(pictures: Iterable[Picture]) -> list[tuple[str, str]]:
    """Return how to read pictures, each caption once, by the title of the first that has it."""
    found: dict[str, str] = {}
    for picture in pictures:
        if picture.caption:
            found.setdefault(picture.caption, picture.title)
    return [(title, caption) for caption, title in found.items()]


def _reading_of_checks(made: Iterable[Mapping[str, Any]]) -> list[tuple[str, str]]:
    """Return how to read the picture of each kind of check that passed, once."""
    found: dict[str, str] = {}
    for check in made:
        if check["picture"] and check["status"] == "PASS":
            found.setdefault(check["measures"], check["picture"].caption)
    return list(found.items())


def cut(table: Table) -> tuple[str, Table, str]:
    """Return the heading of a table, its first rows in whole blocks, and a sentence on the rows of its file alone."""
    shown = table.rows[:MOST_ROWS]
    if len(shown) < len(table.rows) and (heads := table.heads):
        # a block is shown whole, but the first
        last = table.rows[len(shown)][:heads]
        shown = tuple(row for row in shown if row[:heads] != last) or shown
    more = len(table.rows) - len(shown)
    told = f"{more} more rows are in tables/{table.name}.csv." if more else ""
    return _heading(table.caption), replace(table, rows=shown).without_empty(), told


def texts_of(table: Table) -> dict[str, str]:
    """Return a table as text by the name of the format."""
    return {"CSV": to_csv(table), "LaTeX": to_latex(table)}


def files_of(written: Mapping[str, Mapping[str, str]]) -> dict[str, bytes]:
    """Return the files of tables by their names, from the `texts_of` each table."""
    found = {}
    for name, texts in written.items():
        found[f"{name}.csv"] = texts["CSV"].encode()
        found[f"{name}.tex"] = texts["LaTeX"].encode()
    return found


def copied(texts: Mapping[str, str]) -> Mapping[str, str]:
    """Return what buttons copy of a table, its texts; nothing of a very long one."""
    return texts if max(map(len, texts.values())) <= COPIED else {}


def replace_files(directory: Path, files: Mapping[str, bytes], others: Sequence[str] = ()) -> None:
    """Write files, and remove those of an earlier report that are neither among them nor among the `others`."""
    for name, content in files.items():
        store.write_bytes(directory / name, content)
    for path in directory.iterdir() if directory.is_dir() else ():
        if path.is_file() and path.name not in {*files, *others}:
            path.unlink()


def _tables(
    experiment: Experiment, record: Record, everyone: Table | None, first: str
) -> tuple[list[Table], list[Table]]:
    """Return the tables that the page shows, as far as it has room for them, and those that are files only.

    The quantity `first` comes first, if there are tables of it.
    """
    model = experiment.model.definition
    found = sorted(choice.quantities(experiment, record), key=lambda quantity: quantity != first)
    shown = choice.with_levels(experiment, choice.members(record, choice.first(experiment, record)))
    norms = [name for name in record.words("norm") if name != TYPICAL_NORM]
    orders = [levels.orders(record, quantity, shown) for quantity in found]
    wanted = [
        *orders[:1], best.table(model, record, shown), theory.schemes(experiment, record), *orders[1:],
        degrees.table(experiment), levels.scalars(record, shown), levels.events(record), *theory.predictions(record),
        # what damping or a force changes says nothing of a scheme
        *((levels.velocities(record), levels.maxima(record, shown)) if model.conservative else ()),
        None if data.is_lean(record) else work.table(experiment, record),
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


def _heading(caption: str) -> str:
    """Return what stands above a table."""
    found = (re.split(end, caption, maxsplit=1)[0] for end in ("$", r"; |\. ", r": | \("))
    return next((text for text in found if len(text) <= LONG_HEADING), caption)


def _python(experiment: Experiment) -> str:
    """Return the lines of Python that do the same as the command."""
    word, is_ours = experiment.word, experiment.collection != ADHOC
    file, at, case = word.rpartition("@")
    if not at or word.endswith(ENDINGS):
        file, case = word, ""
    named = f"configs/{file}.yaml" if is_ours else file
    if is_ours and is_installed():
        named = str(home() / named)
    settings = experiment.settings
    given = f", settings={json.dumps(settings, ensure_ascii=False)}" if settings else ""
    return PYTHON.format(file=named, given=given, alone=f".alone({case})" if case else "")
