"""What a terminal can show: its width, colours where they are wanted, and text without control characters.

Colours are left out where the output is no terminal, where ``NO_COLOR`` is set (https://no-color.org) and where the
terminal says that it has none (``TERM=dumb``).
"""

from __future__ import annotations

import os
import shutil
import sys
from typing import TextIO

UNCUT = 10_000
"""Width of what goes to a file, which is not cut."""
_COLOURS = {"PASS": "32", "FAIL": "31", "INCONCLUSIVE": "33", "faint": "2", "bold": "1"}


def columns() -> int:
    """Return how many characters a line of the output may have."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else UNCUT


def has_colours(stream: TextIO) -> bool:
    """Tell whether colours are shown and wanted."""
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    return stream.isatty() and not plain


def painted(text: str, colour: str, stream: TextIO | None = None) -> str:
    """Return a text in the colour of a status, or as it is; `colour` may also be ``faint`` or ``bold``."""
    if colour not in _COLOURS or not has_colours(stream or sys.stdout):
        return text
    return f"\033[{_COLOURS[colour]}m{text}\033[0m"


def clean(text: str) -> str:
    """Return a text that came from a file without the characters that a terminal would obey."""
    return "".join(char if char.isprintable() else " " for char in text)
