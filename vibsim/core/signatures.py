"""Whether a function of a user can be called with some arguments, without calling it."""

from __future__ import annotations

import inspect
from collections.abc import Callable
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
