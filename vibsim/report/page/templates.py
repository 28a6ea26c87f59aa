"""The templates of pages: their filters, their compiled code in the cache, and the scripts that a page may run.

Templates are cached as Python code in the private cache, since compiling those of a page takes longer than rendering.
A page runs only its own scripts, which its Content-Security-Policy names by their digests.
"""

from __future__ import annotations

import base64
import hashlib
import re
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import jinja2
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from jinja2.bccache import Bucket, BytecodeCache
from markupsafe import Markup, escape

from vibsim.core import private_cache
from vibsim.report import words
from vibsim.report.text import glossary

if TYPE_CHECKING:
    from vibsim.report.style import Picture

TEMPLATES = Path(__file__).parents[1] / "templates"


@cache
def environment() -> Environment:
    """Return the jinja2 environment of the templates, with escaping always on."""
    # without `optimized`, the code depends only on the text of a template, not on results of filters
    made = Environment(
        loader=FileSystemLoader(TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, optimized=False, bytecode_cache=TemplateCache(),
    )  # fmt: skip
    made.filters |= {
        "code": _code,
        "drawn": _drawn,
        "explained": glossary.explained,
        "swept": words.swept,
    }
    made.globals |= {"term": glossary.term}
    return made


_RAISED = re.compile(r"(?<=[\w)])\^(?:\(([^()]*)\)|(-?\w+))")
_LOWERED = re.compile(r"(?<!\w)([A-Za-z])_(?:\(([^()]*)\)|([A-Za-z0-9]{1,2}))(?!\w)")
"""An exponent, and the index of a letter, such as those of ``4^k`` and ``u_(l+1)``."""


def _code(text: str) -> str:
    """Escape a text; what stands between backticks becomes code, elsewhere powers, exponents and indices are set."""
    parts = text.split("`")
    if len(parts) % 2 == 0:
        return escape(text)
    pieces = [
        Markup("<code>{}</code>").format(p) if i % 2 else _shifted(p) for i, p in enumerate(parts)
    ]
    return Markup("").join(pieces)


def _shifted(text: str) -> str:
    """Escape a text and set its powers of ten, exponents and indices as a page has them."""
    powers = escape(words.PAGE.powers(text))
    raised = _RAISED.sub(lambda found: f"<sup>{found[1] or found[2]}</sup>", powers)
    return Markup(
        _LOWERED.sub(lambda found: f"{found[1]}<sub>{found[2] or found[3]}</sub>", raised)
    )


def source(name: str) -> str:
    """Return a file of the templates unchanged, for a script or a style."""
    loader = environment().loader
    assert loader is not None
    return markup(loader.get_source(environment(), name)[0])


def markup(text: str) -> str:
    """Mark one of our drawings as safe markup; its texts are already escaped."""
    return Markup(text)


def _drawn(picture: Picture) -> str:
    """Return the SVG element of the picture of a check."""
    from vibsim.report.figures import drawing

    return markup(drawing.element(picture))


_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
_ANY = "script-src 'unsafe-inline'"


def sealed(page: str) -> str:
    """Return a page whose policy allows only its own scripts, whereas that of `page` allows any.

    Source: Content Security Policy Level 3, section 2.3.1 (hash-source).
    """
    own = dict.fromkeys(map(digest_of, _SCRIPT.findall(page))) or {"none": None}
    return page.replace(_ANY, "script-src " + " ".join(f"'{source}'" for source in own), 1)


def digest_of(script: str) -> str:
    """Return the digest of a script in the notation of a policy."""
    return f"sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}"


_KIND = "templates"


class TemplateCache(BytecodeCache):
    """Caches compiled templates; missing or damaged ones are compiled again, also without any cache."""

    def load_bytecode(self, bucket: Bucket) -> None:
        """Fill a bucket with the code of its template, if it is cached."""
        folder = private_cache.opened(_KIND)
        content = folder and folder.read(_name(bucket))
        if content:
            bucket.bytecode_from_string(content)

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Cache the code in a bucket."""
        if folder := private_cache.opened(_KIND):
            folder.write(_name(bucket), bucket.bytecode_to_string())


def _name(bucket: Bucket) -> str:
    """Name an entry by everything that the code depends on: Python, jinja2, path and text of the template."""
    parts = (sys.version, jinja2.__version__, bucket.key, bucket.checksum)
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()
