"""The error for a faulty argument: its value, the rule that it breaks, and a hint."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from vibsim.core.errors import Fault, InputError

_LONGEST = 60


def refused(key: str, value: Any, rule: str, hint: str = "") -> InputError:
    """Return the error for an argument of `judge`."""
    text = value if isinstance(value, str) else repr(value)
    shown = text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
    return InputError([Fault("judge", 0, key, shown, rule, hint)])


def chosen(key: str, value: Any, choices: Sequence[str]) -> str:
    """Return the value if it is one of the choices; otherwise raise InputError."""
    if not isinstance(value, str) or value not in choices:
        raise refused(key, value, f"must be one of {', '.join(choices)}")
    return value


def finite_number(
    key: str, value: Any, *, above: float | None = None, least: float | None = None
) -> float:
    """Return the value as a finite number within the bounds; otherwise raise InputError."""
    bound = f"above {above:g}" if above is not None else f"from {least:g}"
    rule = f"must be a finite number {bound}"
    if isinstance(value, bool | str) or value is None:
        raise refused(key, value, rule)
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise refused(key, value, rule) from None
    is_within = (above is None or number > above) and (least is None or number >= least)
    if not abs(number) < float("inf") or not is_within:
        raise refused(key, number, rule)
    return number
