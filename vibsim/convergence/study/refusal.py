"""The refusal of an argument, with the value, the rule that it breaks and what would keep it."""

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
    """Return one of some words; InputError where it is none of them."""
    if not isinstance(value, str) or value not in choices:
        raise refused(key, value, f"must be one of {', '.join(choices)}")
    return value


def finite_number(
    key: str, value: Any, *, above: float | None = None, least: float | None = None
) -> float:
    """Return a finite number; InputError where it is none, or not within its bounds."""
    bound = f"above {above:g}" if above is not None else f"from {least:g}"
    rule = f"must be a finite number {bound}"
    if isinstance(value, bool | str) or value is None:
        raise refused(key, value, rule)
    try:
        found = float(value)
    except (TypeError, ValueError):
        raise refused(key, value, rule) from None
    is_within = (above is None or found > above) and (least is None or found >= least)
    if not abs(found) < float("inf") or not is_within:
        raise refused(key, found, rule)
    return found
