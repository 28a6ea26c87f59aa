"""A picture as a file or as part of a page: the same bytes every time, no dates, text that stays text."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence

from vibsim.report.style import Picture
from vibsim.report.types import Bbox, Figure

MARGIN = 0.05  # between words and the border of a figure [inch]


def box(figure: Figure) -> Bbox:
    """Return what is saved of a figure [inch]: all of it, and the words that leave it."""
    from matplotlib.transforms import Bbox

    return Bbox.union([figure.bbox_inches, figure.get_tightbbox().padded(MARGIN)])


def svg(figure: Figure, name: str) -> str:
    """Return the SVG document of a figure; the ids in it begin with `name`, which is unique on the page."""
    from vibsim.report.figures.svg import document

    return document(figure, name)


def inline(document: str, alt: str, *, is_scaled: bool = True) -> str:
    """Return the ``<svg>`` element of an SVG document for use within HTML, with its accessible name `alt`.

    It takes the width that the page has where it `is_scaled`, else its own.
    """
    from markupsafe import escape

    element = document[document.index("<svg") :]
    element = re.sub(r' xmlns(:xlink)?="[^"]*"', "", element).replace("xlink:href", "href")
    if is_scaled:
        element = re.sub(r'(<svg[^>]*?) width="[^"]*" height="[^"]*"', r"\1", element, count=1)
    # the paper is that of the page
    element = re.sub(r"<rect [^>]*/>\n", "", element, count=1)
    return element.replace("<svg", f'<svg class="plot" role="img" aria-label="{escape(alt)}"', 1)


def element(picture: Picture) -> str:
    """Return the SVG element of a picture in the size it was drawn in; empty without a figure."""
    if picture.figure is None:
        return ""
    return inline(svg(picture.figure, picture.name), picture.alt, is_scaled=False)


def files(picture: Picture, formats: Sequence[str]) -> dict[str, bytes]:
    """Return a picture as files by their names: SVG, whatever the formats, and what else is among them."""
    assert picture.figure is not None
    found = {f"{picture.name}.svg": svg(picture.figure, picture.name).encode()}
    for form in formats:
        if form != "svg":
            found[f"{picture.name}.{form}"] = binary(picture.figure, form)
    return found


def binary(figure: Figure, form: str) -> bytes:
    """Return a figure as PNG or PDF, free of dates."""
    stream = io.BytesIO()
    dates = {"pdf": ["CreationDate", "Creator", "Producer"]}.get(form, ["Software"])
    metadata = dict.fromkeys(dates)
    figure.savefig(stream, format=form, metadata=metadata, bbox_inches=box(figure))
    return stream.getvalue()
