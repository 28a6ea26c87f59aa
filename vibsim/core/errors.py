"""The exceptions of vibsim.

A message states the place (file, line, key), the value, the rule that it breaks, and the nearest valid choice, so that
a user can correct the input without reading code.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path


class VibsimError(Exception):
    """Base of every error that vibsim raises on purpose.

    A subclass must pass all its arguments to ``Exception.__init__``, so that it can be copied to another process.
    """


@dataclass(frozen=True, order=True)
class Fault:
    """One fault of an input, with its place."""

    file: str
    """Name of the file as the user gave it."""
    line: int
    """Line number, from 1; 0 if the fault belongs to no line."""
    key: str
    """Dotted path of the key, e.g. ``initial.theta`` or ``checks[2].order``."""
    value: str
    """The value as written, shortened; empty if there is none."""
    rule: str
    """The rule that the value breaks."""
    hint: str = ""
    """The nearest valid choice, or all choices."""

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}" if self.line else self.file
        parts = [place, self.key, self.value, self.rule, self.hint]
        return ": ".join(part for part in parts if part)


class InputError(VibsimError):
    """Invalid input, with all its faults, sorted by file and line."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults: tuple[Fault, ...] = tuple(sorted(faults))
        super().__init__(self.faults)

    def __str__(self) -> str:
        return "\n".join(map(str, self.faults))


class SimulationError(VibsimError):
    """A simulation that could not be compiled or run; an overflow is a result, not an error."""


class FileError(VibsimError):
    """A stored file that must not be used, with the reason."""

    def __init__(self, path: Path, reason: str) -> None:
        self.path, self.reason = path, reason
        super().__init__(path, reason)

    def __str__(self) -> str:
        return f"{self.path}: {self.reason}"


class DamagedFileError(FileError):
    """A file whose bytes are not those that were written."""


class StaleFileError(FileError):
    """An intact file of another job, another experiment or other code."""


MOST_CHOICES = 60
"""Most choices that are listed; of more, only the nearest are."""
_NEAREST = 3
_CLOSE = 0.6
"""Similarity, from 0 to 1, above which a word may be a misspelling of another."""


def nearest(value: object, choices: Sequence[str]) -> str:
    """Return a hint at the choice nearest to a user's text; if none is near, the list of choices, shortened if long."""
    if not choices:
        return ""
    written = str(value)
    return likely(value, choices) or listed(_with_part(written, choices) or choices, written)


def likely(value: object, choices: Sequence[str]) -> str:
    """Return a question whether the user meant the choice nearest to their text; empty if none is near."""
    written = str(value)
    close: Sequence[str] = difflib.get_close_matches(written, choices, n=1, cutoff=_CLOSE)
    if not close:
        # ignore upper and lower case
        folded = {choice.casefold(): choice for choice in reversed(choices)}
        matches = difflib.get_close_matches(written.casefold(), list(folded), n=1, cutoff=_CLOSE)
        close = [folded[match] for match in matches]
    if not close:
        longer = _with_part(written, choices)
        close = longer if len(longer) == 1 else []
    return f"did you mean '{close[0]}'?" if close else ""


def _with_part(written: str, choices: Sequence[str]) -> list[str]:
    """Return the choices that contain the text, if it has more than one letter."""
    part = written.casefold()
    return [choice for choice in choices if len(part) > 1 and part in choice.casefold()]


def listed(choices: Sequence[str], value: str = "") -> str:
    """Return a list of the choices as text; of many, those nearest to a value, or the first ones."""
    if len(choices) <= MOST_CHOICES:
        return "choose from " + ", ".join(choices)
    near = difflib.get_close_matches(value, choices, n=_NEAREST, cutoff=0.0) if value else []
    return f"choose from {len(choices)}, such as " + ", ".join(near or choices[:_NEAREST])
