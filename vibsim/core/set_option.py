"""The text of commands to run, and of their options, in messages and on pages."""

from __future__ import annotations

from collections.abc import Sequence
from shlex import quote

OPTION = "--set"
ALLOW = "--allow-commands"
"""Option that allows programs of the user to run."""


def set_options(settings: Sequence[str]) -> str:
    """Return the options ``--set`` for settings as text, each after a blank."""
    return "".join(f" {OPTION} {quote(str(text))}" for text in settings)


def command_to_run(word: str, settings: Sequence[str] = (), *, has_program: bool = False) -> str:
    """Return the command that runs the experiment named by `word`, which may have a program of the user."""
    return f"vibsim run {quote(word)}{set_options(settings)}{f' {ALLOW}' * has_program}"


def set_in(file: str, setting: str) -> str:
    """Return the place of a setting of the command line, for messages."""
    return f"{file}, {OPTION} {setting}"
