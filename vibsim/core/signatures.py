"""Whether a function of a user can be called with some arguments, without calling it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Any


def misfit(function: Callable[..., Any], *args: Any, **named: Any) -> tuple[str, str] | None:
    """Return what a function takes and why it cannot be called so; None where it can, or does not tell."""
    try:
        takes = inspect.signature(function)
    except (TypeError, ValueError):
        return None  # functions of extension modules may not tell
    try:
        takes.bind(*args, **named)
    except TypeError as error:
        return str(takes), str(error)
    return None


def takes_by_name(function: Callable[..., Any], names: Sequence[str]) -> bool:
    """Say whether a function has parameters of all these names, and needs no others."""
    try:
        known = inspect.signature(function).parameters
    except (TypeError, ValueError):
        return False
    return set(names) <= set(known) and misfit(function, **dict.fromkeys(names)) is None
