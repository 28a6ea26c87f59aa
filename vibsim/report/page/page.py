"""The report of one experiment: one page that opens anywhere, with its figures and tables as files beside it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from vibsim import store
from vibsim.core.errors import VibsimError, nearest
from vibsim.core.record import Record
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.report import choice, data, style
from vibsim.report.figures import drawing, gallery, thumbnail
from vibsim.report.page import cards, player
from vibsim.report.style import Picture
from vibsim.report.tables import best, checks, degrees, levels, members, published, theory, work
from vibsim.report.tables.scales import table as scales_table
from vibsim.report.tables.table import Table, to_csv, to_latex
from vibsim.report.types import Environment, Experiment, Plan

TEMPLATES = Path(__file__).parents[1] / "templates"
NOTHING: Mapping[str, Any] = {}
LONG_TABLE = 24  # rows above which a table is folded away
FOLDED = 500  # most rows of members that the page itself holds; the CSV file holds more
LONG_HEADING = 90  # letters of a caption of which a heading has the first words only


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
    drawn, files = [], dict[str, bytes]()
    with style.applied():
        for picture in gallery.pictures(experiment, convergence, shown):
            if picture.figure is None:
                continue
            text = drawing.svg(picture.figure, picture.name)
            drawn.append((picture, markup(drawing.inline(text, picture.alt))))
            files[f"{picture.name}.svg"] = text.encode()
            for form in (form for form in formats if form != "svg"):
                files[f"{picture.name}.{form}"] = drawing.binary(picture.figure, form)
    small = thumbnail.thumbnail(experiment, convergence, shown[0])
    replace_files(directory / "figures", {**files, "thumbnail.svg": small.encode()})
    listed, folded = _tables(experiment, convergence)
    scales = scales_table(experiment, convergence)
    printed = published.tables(experiment, convergence, summary)
    every = [*printed, *listed, *(table for _, group in folded for table in group), scales]
    every += [checks.checks(summary), checks.failures(summary, convergence)]
    every.append(members.table(convergence, position))
    files = {}
    for table in every:
        if table is not None:
            files[f"{table.name}.csv"] = to_csv(table).encode()
            files[f"{table.name}.tex"] = to_latex(table).encode()
    kept = ("members.csv",) if data.swept(convergence) else ()
    if kept:
        members.write_csv(directory / "tables/members.csv", convergence, position)
        files.pop("members.csv", None)
    replace_files(directory / "tables", files, kept)
    context = cards.context(experiment, convergence, summary, provenance) | {
        "tables": listed,
        "scales": scales,
        "several": len(data.whole(convergence, "level")) > 1,
        "folded": folded,
        "printed": printed,
        "printed_sentence": published.sentence(printed),
        "shown": left_out,
        "digits": members.digits(convergence),
        "pictures": drawn,
        "player": markup(player.element(experiment, convergence, environment())),
    }
    page = environment().get_template("report.html").render(context)
    store.write_text(directory / "report.html", page)


@cache
def environment() -> Environment:
    """Return the jinja2 environment of the templates, with escaping always on."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    made = Environment(
        loader=FileSystemLoader(TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    made.filters |= {"code": _code, "drawn": _drawn}
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


def markup(text: str) -> str:
    """Mark a drawing of our own as markup; its texts were escaped when it was drawn."""
    from markupsafe import Markup

    return Markup(text)


def _drawn(picture: Picture) -> str:
    """Return the SVG element of the picture of a check."""
    with style.applied():
        return markup(drawing.element(picture))


def replace_files(directory: Path, files: Mapping[str, bytes], others: Sequence[str] = ()) -> None:
    """Write files, and remove those of an earlier report that are neither among them nor among the `others`."""
    for name, content in files.items():
        store.write_bytes(directory / name, content)
    for path in directory.iterdir() if directory.is_dir() else ():
        if path.is_file() and path.name not in {*files, *others}:
            path.unlink()


def _tables(
    experiment: Experiment, record: Record
) -> tuple[list[Table], list[tuple[str, list[Table]]]]:
    """Return the tables of the page, and those that it folds away under a heading."""
    found, model = choice.quantities(experiment, record), experiment.model.definition
    shown = choice.with_levels(experiment, choice.members(record, found[0]))
    norms = [name for name in record.words("norm") if name != TYPICAL_NORM]
    first = [theory.schemes(experiment, record)]
    orders = [levels.orders(record, quantity, shown) for quantity in found]
    beside = [degrees.table(experiment), *theory.predictions(record)]
    beside += [levels.velocities(record), levels.events(record)]
    optional = [
        best.table(model, record, shown),
        # what damping or a force changes says nothing of a scheme
        levels.maxima(record, shown) if model.conservative else None,
        levels.scalars(record, shown),
        None if data.is_lean(record) else work.table(experiment, record),
    ]
    if len(record["scheme"]) > gallery.FEW_SCHEMES:
        # a row for each scheme says more than many for each
        kept, rest = [*first, *beside], [*orders, *optional]
    else:
        kept, rest = [*first, *orders, *beside, *optional], []
    listed = [table for table in kept if table is not None]
    # the first table is what the page is about; a long one after it would push the figures away
    long = [table for table in listed[1:] if len(table.rows) > LONG_TABLE]
    listed = [table for table in listed if table not in long]
    folded = _folded([table for table in [*long, *rest] if table is not None])
    other = [levels.orders(record, quantity, shown, norm) for quantity in found for norm in norms]
    if other:
        folded.append(("Other norms", other))
    everyone = members.table(record, found[0])
    if everyone is not None and len(everyone.rows) <= FOLDED:
        folded.append((f"All {len(record['case'])} members", [everyone]))
    return listed, folded


def _folded(tables: Sequence[Table]) -> list[tuple[str, list[Table]]]:
    """Return tables with their headings, which differ: of two that would be the same each says more."""
    short = [_heading(table.caption) for table in tables]
    more = [re.split(r"[,;]|\. ", table.caption, maxsplit=1)[0] for table in tables]
    headings = (b if short.count(a) > 1 else a for a, b in zip(short, more, strict=True))
    return [(text, [table]) for text, table in zip(headings, tables, strict=True)]


def _heading(caption: str) -> str:
    """Return what stands above a table that is folded away."""
    found = (re.split(end, caption, maxsplit=1)[0] for end in ("$", r"; |\. ", r": | \("))
    return next((text for text in found if len(text) <= LONG_HEADING), caption)
