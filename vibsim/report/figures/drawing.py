"""A picture as a file or as part of a page: the same bytes every time, no dates, text that stays text."""

from __future__ import annotations

import io
import re

from vibsim.report.style import Picture

FORMATS = ("svg", "png", "pdf")
"""Formats of figures."""
FAMILY = "'DejaVu Sans', Verdana, Arial, Helvetica, sans-serif"
_PLACES = re.compile(r' (?:d|x|y)="[^"]*"')
_DIGITS = re.compile(r"(\.\d\d)\d+")


def svg(picture: Picture) -> str:
    """Return the SVG document of a picture: no date, and the same bytes every time."""
    import matplotlib

    stream = io.StringIO()
    nothing = {"Date": None, "Creator": None, "Format": None, "Type": None}
    with matplotlib.rc_context({"svg.hashsalt": picture.name}):
        picture.figure.savefig(stream, format="svg", metadata=nothing)
    return _tidy(stream.getvalue(), picture.name)


def _tidy(text: str, name: str) -> str:
    """Make ids unique among the figures of one page, drop unused ones, and let the reader's fonts serve."""
    used = set(re.findall(r'(?:url\(#|href="#)([^)"]+)', text))
    text = re.sub(r' id="([^"]*)"', lambda m: f' id="{name}-{m[1]}"' if m[1] in used else "", text)
    text = re.sub(r'(url\(#|href="#)', rf"\g<1>{name}-", text)
    # hundredths of a point are more than anyone sees
    text = _PLACES.sub(lambda match: _DIGITS.sub(r"\1", match[0]), text)
    text = re.sub(
        r"<!--.*?-->\s*|<metadata>.*?</metadata>\s*|<!DOCTYPE.*?>\s*", "", text, flags=re.DOTALL
    )
    return text.replace("'DejaVu Sans'", FAMILY)


def inline(document: str, alt: str) -> str:
    """Return the ``<svg>`` element of an SVG document for use within HTML, with `alt` as its accessible name."""
    from markupsafe import escape

    element = document[document.index("<svg") :]
    element = re.sub(r' xmlns(:xlink)?="[^"]*"', "", element).replace("xlink:href", "href")
    element = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", element, count=1)
    element = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", element, count=1)
    # a style sheet within the page would hold for all of it; the page has the same rule for its figures
    element = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>\s*", "", element, flags=re.DOTALL)
    return element.replace("<svg", f'<svg role="img" aria-label="{escape(alt)}"', 1)


def binary(picture: Picture, form: str) -> bytes:
    """Return a picture as PNG or PDF, free of dates."""
    stream = io.BytesIO()
    metadata = {"pdf": {"CreationDate": None, "Creator": None, "Producer": None}}.get(
        form, {"Software": None}
    )
    picture.figure.savefig(stream, format=form, metadata=metadata)
    return stream.getvalue()
