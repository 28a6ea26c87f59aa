"""Terminal output: width, colours, and text without control characters.

No colours are used if the output is not a terminal, if ``NO_COLOR`` is set (https://no-color.org), or if the terminal
has none (``TERM=dumb``).
"""

from __future__ import annotations

import os
import shutil
import sys

UNCUT = 10_000  # width of output that goes to a file, so that it is never cut
FRAME = 6  # lines around a plot: title, heads, what it leaves out, empty lines and the prompt
_COLOURS = {"PASS": "32", "FAIL": "31", "INCONCLUSIVE": "33", "faint": "2", "bold": "1"}


def columns() -> int:
    """Return the width of a line of the output [characters]."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else UNCUT


def rows(taken: int = 0) -> int:
    """Return how many lines of a plot fit on the screen beside its frame and `taken` other lines; 40 in a file."""
    if not sys.stdout.isatty():
        return 40
    return max(shutil.get_terminal_size().lines - taken - FRAME, 10)


def painted(text: str, colour: str) -> str:
    """Return a text in the colour of a status, or ``faint`` or ``bold``; any other `colour` leaves it unchanged."""
    is_plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    if is_plain or colour not in _COLOURS or not sys.stdout.isatty():
        return text
    return f"\033[{_COLOURS[colour]}m{text}\033[0m"


def clean(text: str) -> str:
    """Replace the control characters of a text from a file, which a terminal would obey, by spaces."""
    return "".join(char if char.isprintable() else " " for char in text)
