"""How the option ``--set`` of the command line is written: in messages, commands and pages."""

from __future__ import annotations

from collections.abc import Sequence
from shlex import quote

OPTION = "--set"


def set_options(settings: Sequence[str]) -> str:
    """Return what a command has behind the name of an experiment with settings, with a blank before each."""
    return "".join(f" {OPTION} {quote(str(text))}" for text in settings)


def command_to_run(word: str, settings: Sequence[str] = ()) -> str:
    """Return the command that runs what a command line names by a word."""
    return f"vibsim run {quote(word)}{set_options(settings)}"


def set_in(file: str, setting: str) -> str:
    """Return what a message names as the place of a value that is given in place of one of a file."""
    return f"{file}, {OPTION} {setting}"
