"""The one family of errors.

A message carries the value, the rule it broke, the nearest valid choice, and where it stands (file, line, key), so
that a user can mend the input without reading code.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path


class VibsimError(Exception):
    """Base of every error that vibsim raises on purpose.

    One that takes more than its message hands that on to ``Exception``: copies in other processes are made of it.
    """


@dataclass(frozen=True, order=True)
class Fault:
    """One fault of an input, with the place where it stands."""

    file: str
    """Name of the file as the user gave it."""
    line: int
    """Line number, from 1; 0 where the fault has no line of its own."""
    key: str
    """Dotted path of the key, e.g. ``initial.theta`` or ``checks[2].order``."""
    value: str
    """The value as written, shortened; empty where there is none."""
    rule: str
    """The rule that the value breaks."""
    hint: str = ""
    """The nearest valid choice, or the choices."""

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}" if self.line else self.file
        parts = [place, self.key, self.value, self.rule, self.hint]
        return ": ".join(part for part in parts if part)


class InputError(VibsimError):
    """Input that is refused: every fault that was found, at once, in the order of file and line."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults: tuple[Fault, ...] = tuple(sorted(faults))
        super().__init__(self.faults)

    def __str__(self) -> str:
        return "\n".join(map(str, self.faults))


class SimulationError(VibsimError):
    """A simulation that could not be run or compiled; a run that overflows is a result, not an error."""


class FileError(VibsimError):
    """A stored file that must not be used, and why."""

    def __init__(self, path: Path, reason: str) -> None:
        self.path, self.reason = path, reason
        super().__init__(path, reason)

    def __str__(self) -> str:
        return f"{self.path}: {self.reason}"


class DamagedFileError(FileError):
    """A file whose bytes are not those that were written."""


class StaleFileError(FileError):
    """A whole file that belongs to another job, another experiment or other code."""


MOST_CHOICES = 60
"""So many choices are listed; of more, the nearest are named."""
_NEAREST = 3
_CLOSE = 0.6
"""How alike two words are that may be meant for each other, from 0 to 1."""


def nearest(value: object, choices: Sequence[str]) -> str:
    """Name the choice nearest to what a user wrote; where none is near, list all, or of many the nearest."""
    if not choices:
        return ""
    written = str(value)
    return likely(value, choices) or listed(_with_part(written, choices) or choices, written)


def likely(value: object, choices: Sequence[str]) -> str:
    """Ask whether the choice nearest to what a user wrote was meant; empty where none is near."""
    written = str(value)
    close: Sequence[str] = difflib.get_close_matches(written, choices, n=1, cutoff=_CLOSE)
    if not close:
        # by capital letters alone
        small = {choice.casefold(): choice for choice in reversed(choices)}
        alike = difflib.get_close_matches(written.casefold(), list(small), n=1, cutoff=_CLOSE)
        close = [small[found] for found in alike]
    if not close:
        longer = _with_part(written, choices)
        close = longer if len(longer) == 1 else []
    return f"did you mean '{close[0]}'?" if close else ""


def _with_part(written: str, choices: Sequence[str]) -> list[str]:
    """Return the choices of which more than one letter was written."""
    part = written.casefold()
    return [choice for choice in choices if len(part) > 1 and part in choice.casefold()]


def listed(choices: Sequence[str], value: str = "") -> str:
    """List what there is to choose from; of many those that are nearest to a value, or the first."""
    if len(choices) <= MOST_CHOICES:
        return "choose from " + ", ".join(choices)
    near = difflib.get_close_matches(value, choices, n=_NEAREST, cutoff=0.0) if value else []
    return f"choose from {len(choices)}, such as " + ", ".join(near or choices[:_NEAREST])
