"""The templates of pages, and what they may use."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from vibsim.report.text import glossary
from vibsim.report.types import Environment

if TYPE_CHECKING:
    from vibsim.report.style import Picture

TEMPLATES = Path(__file__).parents[1] / "templates"


@cache
def environment() -> Environment:
    """Return the jinja2 environment of the templates, with escaping always on."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    from vibsim.report.page.template_cache import TemplateCache

    # without `optimized`, the code depends on the text of a template alone, and on nothing that a filter returns
    made = Environment(
        loader=FileSystemLoader(TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, optimized=False, bytecode_cache=TemplateCache(),
    )  # fmt: skip
    made.filters |= {"code": _code, "drawn": _drawn, "explained": glossary.explained}
    made.globals |= {"term": glossary.term}
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
    from vibsim.report import style
    from vibsim.report.figures import drawing

    with style.applied():
        return markup(drawing.element(picture))
