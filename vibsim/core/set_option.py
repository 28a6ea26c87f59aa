"""The text of the command-line option ``--set`` in messages, commands and pages."""

from __future__ import annotations

from collections.abc import Sequence
from shlex import quote

OPTION = "--set"


def set_options(settings: Sequence[str]) -> str:
    """Return the options ``--set`` for settings as text, each after a blank."""
    return "".join(f" {OPTION} {quote(str(text))}" for text in settings)


def command_to_run(word: str, settings: Sequence[str] = ()) -> str:
    """Return the command that runs the experiment named by `word`."""
    return f"vibsim run {quote(word)}{set_options(settings)}"


def set_in(file: str, setting: str) -> str:
    """Return the place of a setting of the command line, for messages."""
    return f"{file}, {OPTION} {setting}"
