"""Templates as Python code in the private cache: to compile those of one page takes longer than to fill them in."""

from __future__ import annotations

import hashlib
import sys

import jinja2
from jinja2.bccache import Bucket, BytecodeCache

from vibsim.core import private_cache

_KIND = "templates"


class TemplateCache(BytecodeCache):
    """Keeps compiled templates; what is missing or damaged is compiled again, and no cache is no fault."""

    def load_bytecode(self, bucket: Bucket) -> None:
        """Fill a bucket with the code of its template, if it is kept."""
        folder = private_cache.opened(_KIND)
        content = folder and folder.read(_name(bucket))
        if content:
            bucket.bytecode_from_string(content)

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Keep the code in a bucket."""
        if folder := private_cache.opened(_KIND):
            folder.write(_name(bucket), bucket.bytecode_to_string())


def _name(bucket: Bucket) -> str:
    """Name an entry by all that the code depends on: Python, jinja2, the place of the template and its text."""
    parts = (sys.version, jinja2.__version__, bucket.key, bucket.checksum)
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()
