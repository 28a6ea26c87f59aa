"""A picture as a file or as part of a page: reproducible bytes without dates, text kept as text."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence

from vibsim.report.style import Picture
from vibsim.report.types import Bbox, Figure

MARGIN = 0.05  # between text and the border of a figure [inch]


def box(figure: Figure) -> Bbox:
    """Return the saved area of a figure [inch]: all of it, and text that extends beyond it."""
    from matplotlib.transforms import Bbox

    return Bbox.union([figure.bbox_inches, figure.get_tightbbox().padded(MARGIN)])


def svg(figure: Figure, name: str) -> str:
    """Return the SVG document of a figure; its ids begin with `name`, which is unique on the page."""
    from vibsim.report.figures.svg import document

    return document(figure, name)


def inline(document: str, alt: str, *, is_scaled: bool = True) -> str:
    """Return the ``<svg>`` element of an SVG document for use in HTML, with the accessible name `alt`.

    If it `is_scaled`, it fills the width of the page, else it keeps its own.
    """
    from markupsafe import escape

    element = document[document.index("<svg") :]
    element = re.sub(r' xmlns(:xlink)?="[^"]*"', "", element).replace("xlink:href", "href")
    if is_scaled:
        element = re.sub(r'(<svg[^>]*?) width="[^"]*" height="[^"]*"', r"\1", element, count=1)
    # without its background, which the page provides
    element = re.sub(r"<rect [^>]*/>\n", "", element, count=1)
    return element.replace("<svg", f'<svg class="plot" role="img" aria-label="{escape(alt)}"', 1)


def element(picture: Picture) -> str:
    """Return the SVG element of a picture in its own size; empty without a figure."""
    if picture.figure is None:
        return ""
    return inline(svg(picture.figure, picture.name), picture.alt, is_scaled=False)


def files(picture: Picture, formats: Sequence[str]) -> dict[str, bytes]:
    """Return the files of a picture by name: always SVG, and the other `formats`."""
    assert picture.figure is not None
    contents = {f"{picture.name}.svg": svg(picture.figure, picture.name).encode()}
    for form in formats:
        if form != "svg":
            contents[f"{picture.name}.{form}"] = binary(picture.figure, form)
    return contents


def binary(figure: Figure, form: str) -> bytes:
    """Return a figure as PNG or PDF, without dates."""
    stream = io.BytesIO()
    removed = {"pdf": ["CreationDate", "Creator", "Producer"]}.get(form, ["Software"])
    metadata = dict.fromkeys(removed)
    figure.savefig(stream, format=form, metadata=metadata, bbox_inches=box(figure))
    return stream.getvalue()
