"""A picture as a file or as part of a page: the same bytes every time, no dates, text that stays text."""

from __future__ import annotations

import io
import re

from vibsim.report.style import Picture
from vibsim.report.types import Bbox, Figure

FORMATS = ("svg", "png", "pdf")  # formats of figures
FAMILY = "'DejaVu Sans', Verdana, Arial, Helvetica, sans-serif"
MARGIN = 0.05  # between words and the border of a figure [inch]
_PLACES = re.compile(r' (?:d|x|y)="[^"]*"')
_DIGITS = re.compile(r"(\.\d\d)\d+")
_NOTHING = re.compile(
    r"<!--.*?-->\s*|<metadata>.*?</metadata>\s*|<!DOCTYPE.*?>\s*| transform=\"rotate\(-0 [^\"]*\"",
    flags=re.DOTALL,
)


def box(figure: Figure) -> Bbox:
    """Return what is saved of a figure [inch]: all of it, and the words that leave it."""
    from matplotlib.transforms import Bbox

    return Bbox.union([figure.bbox_inches, figure.get_tightbbox().padded(MARGIN)])


def svg(figure: Figure, name: str) -> str:
    """Return the SVG document of a figure; the ids in it begin with `name`, which is unique on the page."""
    import matplotlib

    stream = io.StringIO()
    nothing = {"Date": None, "Creator": None, "Format": None, "Type": None}
    with matplotlib.rc_context({"svg.hashsalt": name}):
        figure.savefig(stream, format="svg", metadata=nothing, bbox_inches=box(figure))
    return _tidy(stream.getvalue(), name)


def _tidy(text: str, name: str) -> str:
    """Make ids unique among the figures of one page, drop what says nothing, and let the reader's fonts serve."""
    used = set(re.findall(r'(?:url\(#|href="#)([^)"]+)', text))
    text = re.sub(r' id="([^"]*)"', lambda m: f' id="{name}-{m[1]}"' if m[1] in used else "", text)
    text = re.sub(r'(url\(#|href="#)', rf"\g<1>{name}-", text)
    # hundredths of a point are more than anyone sees
    text = _PLACES.sub(lambda match: _DIGITS.sub(r"\1", match[0]), text)
    text = _NOTHING.sub("", text).replace("<svg ", f'<svg font-family="{FAMILY}" ', 1)
    text = re.sub(r"<g ?/>", "", re.sub(r"; font-family: [^;\"]*", "", text))
    bare: list[bool] = []

    def without_bare_groups(match: re.Match[str]) -> str:
        if match[0] != "</g>":
            bare.append(match[0] == "<g>")
            return "" if bare[-1] else match[0]
        return "" if bare.pop() else match[0]

    return re.sub(r"\s*\n\s*", "\n", re.sub(r"<g(?: [^>]*[^/])?>|</g>", without_bare_groups, text))


def inline(document: str, alt: str, *, is_scaled: bool = True) -> str:
    """Return the ``<svg>`` element of an SVG document for use within HTML, with its accessible name `alt`.

    It takes the width that the page has where it `is_scaled`, else its own.
    """
    from markupsafe import escape

    element = document[document.index("<svg") :]
    element = re.sub(r' xmlns(:xlink)?="[^"]*"', "", element).replace("xlink:href", "href")
    if is_scaled:
        element = re.sub(r'(<svg[^>]*?) width="[^"]*" height="[^"]*"', r"\1", element, count=1)
    # a style sheet within the page would hold for all of it; the page has the same rule for its figures
    element = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>\s*", "", element, flags=re.DOTALL)
    return element.replace("<svg", f'<svg role="img" aria-label="{escape(alt)}"', 1)


def element(picture: Picture) -> str:
    """Return the SVG element of a picture in the size it was drawn in; empty without a figure."""
    if picture.figure is None:
        return ""
    return inline(svg(picture.figure, picture.name), picture.alt, is_scaled=False)


def binary(figure: Figure, form: str) -> bytes:
    """Return a figure as PNG or PDF, free of dates."""
    stream = io.BytesIO()
    dates = {"pdf": ["CreationDate", "Creator", "Producer"]}.get(form, ["Software"])
    metadata = dict.fromkeys(dates)
    figure.savefig(stream, format=form, metadata=metadata, bbox_inches=box(figure))
    return stream.getvalue()
