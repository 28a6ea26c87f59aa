"""The report of one experiment: one page that opens anywhere, with its figures and tables as files beside it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim import store
from vibsim.core.errors import VibsimError, nearest
from vibsim.core.record import Record
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.report import choice, data, finest_level, style
from vibsim.report.data import Member
from vibsim.report.figures import drawing, gallery, thumbnail, time
from vibsim.report.figures.panels import Curve
from vibsim.report.page import cards
from vibsim.report.style import Picture
from vibsim.report.tables import (
    best,
    degrees,
    energy,
    events,
    members,
    orders,
    published,
    theory,
    work,
)
from vibsim.report.tables.scales import table as scales_table
from vibsim.report.tables.table import Table, to_csv, to_latex

if TYPE_CHECKING:
    from jinja2 import Environment

    from vibsim.experiment import Experiment
    from vibsim.plan import Plan

TEMPLATES = Path(__file__).parents[1] / "templates"
NOTHING: Mapping[str, Any] = {}
LONG = 24
"""Rows above which a table is folded away."""
FOLDED = 500
"""Most rows of members that the page itself holds; the CSV file holds more."""


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
    experiment = plan.experiment
    shown, left_out = gallery.choose(experiment, convergence)
    position = choice.position(experiment)
    with style.applied():
        pictures = gallery.pictures(experiment, convergence, shown)
        drawn = [(picture, drawing.svg(picture.figure, picture.name)) for picture in pictures]
        figures = dict(_figure_files(drawn, formats))
    figures["thumbnail.svg"] = _stamp(experiment, convergence, shown[0]).encode()
    listed, folded = _tables(experiment, convergence, summary)
    beside = [orders.checks(summary), orders.failures(summary, convergence)]
    beside.append(members.table(convergence, position))
    scales = scales_table(experiment, convergence)
    beside.append(scales)
    printed = published.tables(experiment, convergence, summary)
    everything = [*printed, *listed, *(table for _, group in folded for table in group)]
    everything += [table for table in beside if table is not None and table not in everything]
    _replace(directory / "figures", figures)
    tables = dict(_table_files(everything))
    if data.swept(convergence):
        members.write_csv(directory / "tables/members.csv", convergence, position)
        tables.pop("members.csv", None)
        _replace(directory / "tables", tables, ("members.csv",))
    else:
        _replace(directory / "tables", tables)
    context = cards.context(experiment, convergence, summary, provenance) | {
        "tables": listed,
        "scales": scales,
        "several": len(data.whole(convergence, "level")) > 1,
        "folded": folded,
        "printed": printed,
        "printed_sentence": published.sentence(printed),
        "shown": left_out,
        "digits": members.digits(convergence),
        "pictures": [
            (picture, _markup(drawing.inline(text, picture.alt))) for picture, text in drawn
        ],
    }
    store.write_text(
        directory / "report.html", environment().get_template("report.html").render(context)
    )


@cache
def environment() -> Environment:
    """Return the jinja2 environment of the templates, with escaping always on."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    loader = FileSystemLoader(TEMPLATES)
    made = Environment(
        loader=loader,
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["code"] = _code
    made.filters["drawn"] = _markup
    return made


def _code(text: str) -> str:
    """Escape a text, and set what stands between backticks as code."""
    from markupsafe import Markup, escape

    parts = text.split("`")
    if len(parts) % 2 == 0:
        return escape(text)
    pieces = [
        Markup("<code>{}</code>").format(p) if i % 2 else escape(p) for i, p in enumerate(parts)
    ]
    return Markup("").join(pieces)


def _markup(text: str) -> str:
    """Mark a drawing of our own as markup; its texts were escaped when it was drawn."""
    from markupsafe import Markup

    return Markup(text)


def _figure_files(
    drawn: Iterable[tuple[Picture, str]], formats: Sequence[str]
) -> Iterable[tuple[str, bytes]]:
    for picture, text in drawn:
        for form in dict.fromkeys(["svg", *formats]):
            content = text.encode() if form == "svg" else drawing.binary(picture.figure, form)
            yield f"{picture.name}.{form}", content


def _table_files(tables: Iterable[Table]) -> Iterable[tuple[str, bytes]]:
    for table in tables:
        yield f"{table.name}.csv", to_csv(table).encode()
        yield f"{table.name}.tex", to_latex(table).encode()


def _replace(directory: Path, files: Mapping[str, bytes], others: Sequence[str] = ()) -> None:
    """Write files, and remove those of an earlier report that are neither among them nor among the `others`."""
    for name, content in files.items():
        store.write_bytes(directory / name, content)
    for path in directory.iterdir() if directory.is_dir() else ():
        if path.is_file() and path.name not in {*files, *others}:
            path.unlink()


def _stamp(experiment: Experiment, record: Record, member: Member) -> str:
    """Return the small figure of the index: the rescaled differences; with a single level the solution.

    Without series it is the error, or what two levels say of it, against the level.
    """
    quantity = choice.position(experiment)
    if data.is_lean(record):
        levels = np.array(data.whole(record, "level"), dtype=np.float64)
        size = finest_level.norms(record, quantity, member)
        return thumbnail.draw(levels, [Curve("", np.log10(size))])
    t = data.times(record, member.case)
    if not data.whole(record, "pair"):
        return thumbnail.draw(t, [Curve("", data.at(record, f"{quantity}_finest", member))])
    return thumbnail.draw(t, time.differences(record, quantity, member))


LONG_HEADING = 90
"""Letters of a caption of which a heading has the first words only."""


def _heading(caption: str) -> str:
    """Return what stands above a table that is folded away."""
    for end in ("$", r"; |\. ", r": | \("):
        found = re.split(end, caption, maxsplit=1)[0]
        if len(found) <= LONG_HEADING:
            return found
    return caption


def _folded(tables: Sequence[Table]) -> list[tuple[str, list[Table]]]:
    """Return tables with their headings, which differ: of two that would be the same each says more."""
    short = [_heading(table.caption) for table in tables]
    whole = [re.split(r"[,;]|\. ", table.caption, maxsplit=1)[0] for table in tables]
    headings = [
        more if short.count(text) > 1 else text for text, more in zip(short, whole, strict=True)
    ]
    return [(text, [table]) for text, table in zip(headings, tables, strict=True)]


def _tables(
    experiment: Experiment, record: Record, summary: Mapping[str, Any]
) -> tuple[list[Table], list[tuple[str, list[Table]]]]:
    """Return the tables of the page, and those that it folds away under a heading."""
    found = choice.quantities(experiment, record)
    shown = choice.with_levels(experiment, choice.members(record, found[0]))
    schemes = theory.schemes(experiment, record)
    norms = [name for name in record.words("norm") if name != TYPICAL_NORM]
    found_orders = [orders.orders(record, quantity, shown) for quantity in found]
    beside = [degrees.table(experiment), *theory.predictions(record)]
    beside += [energy.velocities(record), events.table(record)]
    # what damping or a force changes says nothing of a scheme
    conserved = experiment.model.definition.conservative
    optional = [best.table(experiment.model.definition, record, shown)]
    optional.append(orders.maxima(record, shown) if conserved else None)
    optional.append(orders.scalars(record, shown))
    optional.append(None if data.is_lean(record) else work.table(experiment, record))
    if len(record["scheme"]) > gallery.FEW:
        # a row for each scheme says more than many for each
        order, kept = [schemes, *beside, *found_orders, *optional], 1 + len(beside)
    else:
        order = [schemes, *found_orders, *beside, *optional]
        kept = len(order)
    listed = [table for table in order[:kept] if table is not None]
    # the first table is what the page is about; a long one after it would push the figures away
    long = [table for table in listed[1:] if len(table.rows) > LONG]
    listed = [table for table in listed if table not in long]
    folded = _folded([table for table in [*long, *order[kept:]] if table is not None])
    other = [orders.orders(record, quantity, shown, norm) for quantity in found for norm in norms]
    if other:
        folded.append(("Norms and orders in the other norms", other))
    listed_members = members.table(record, found[0])
    if listed_members is not None and len(listed_members.rows) <= FOLDED:
        folded.append((f"All {len(record['case'])} members", [listed_members]))
    return listed, folded
