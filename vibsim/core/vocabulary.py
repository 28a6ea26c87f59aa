"""The words and numbers that all of vibsim agrees on: statuses, reasons, norms, dimensions, and the file format.

This module imports nothing of vibsim and no library, so that any command may have it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Literal, get_args

Status = Literal["PASS", "FAIL", "INCONCLUSIVE"]
STATUSES: tuple[Status, ...] = get_args(Status)
"""Every status; files hold its position here."""
SEVERITY: Mapping[str, int] = MappingProxyType({"PASS": 0, "INCONCLUSIVE": 1, "FAIL": 2})
"""How bad each of `STATUSES` is, the mildest first."""

_REASONS: Mapping[Status, str] = {
    "PASS": "asymptotic exact match",
    "FAIL": "order_low order_high mismatch wrong_limit unstable non_finite",
    "INCONCLUSIVE": "pre_asymptotic round_off oscillating non_smooth too_few_levels not_applicable",
}
REASONS: Mapping[str, Status] = MappingProxyType(
    {reason: status for status, words in _REASONS.items() for reason in words.split()}
)
"""Every reason of a verdict, with the status that it belongs to."""
REASON_NAMES = tuple(REASONS)
"""The same without statuses; files hold a reason's position here."""

DRIFTS = ("none", "bounded", "linear", "quadratic", "exponential", "unclear")
"""How the error of an energy grows with time; files hold a position here."""

Norm = Literal["l1", "l2", "linf", "linf_interior"]
NORMS: tuple[Norm, ...] = get_args(Norm)
"""Every norm over time; ``linf_interior`` leaves the last point out."""
SECONDS_OF_NORM: dict[str, float] = {"l1": 1.0, "l2": 0.5, "linf": 0.0, "linf_interior": 0.0}
"""The power of s beside the unit of an error or a difference in each norm."""
TYPICAL_NORM: Norm = "l2"
"""The norm of a check that names none, and of the verdict on a quantity."""
MEMBER = ("scheme", "case")
"""Dimensions of a number of each scheme and member."""
SERIES = (*MEMBER, "t")
"""Dimensions of a series over the stored times."""
OF_LEVEL = (*MEMBER, "level")
"""Dimensions of a number of each level."""
Restriction = Literal["subset", "mean", "linear", "cubic"]
RESTRICTIONS: tuple[Restriction, ...] = get_args(Restriction)
"""Ways to bring the levels of a study to common points."""
ORDER_TOLERANCE = 0.1
"""How far from the promised order a measured one may be where a check does not say."""
LEVELS_OF_AN_ORDER = 3
"""Fewer levels show no order, and not how large their error is."""
BY_TOLERANCE = "tolerance"
"""Name and kind of the verdict that an experiment with a tolerance has beside those of its checks."""

DECISIVE: Mapping[str, str] = MappingProxyType(
    {
        "converges": "order",
        "value": "value",
        "stable": "growth",
        "conserves": "energy_error",
        "equal": "distance",
        "accurate": "error",
        BY_TOLERANCE: "error_bound",
    }
)
"""Kind of a check to the fact that decides it; no check has that of one before it in this order."""
ERROR_FACTS = ("error", "error_bound", "relative_error")
"""Facts on the error of the finest level, of every check that states it."""


def decisive_number(facts: Mapping[str, Any]) -> float | None:
    """Return the number that decides a result with these facts; None where an order does, or it is not finite."""
    found: float | None = next((facts[name] for name in DECISIVE.values() if name in facts), None)
    return None if DECISIVE["converges"] in facts else found


def order_interval(low: float, high: float) -> tuple[str, ...]:
    """Write the ends of the interval of an order with the decimals that tell them apart, 3 to 6; once if none do."""
    for decimals in range(3, 7):
        ends = f"{low:.{decimals}f}", f"{high:.{decimals}f}"
        if ends[0] != ends[1]:
            return ends
    return (f"{low:.3f}",)


FORMAT = 2
"""Version of the file format, ``vibsim_format`` in every file."""


def worst(statuses: Iterable[str]) -> str:
    """Return the status of a whole: FAIL before INCONCLUSIVE before PASS; of nothing, nothing is concluded.

    Raises
    ------
    KeyError
        For a word that is no status.
    """
    return max(statuses, key=SEVERITY.__getitem__, default="INCONCLUSIVE")


def jsonable(value: Any) -> Any:
    """Return plain data as JSON has them: lists and mappings, and None for numbers that are not finite."""
    if hasattr(value, "tolist"):  # numbers and arrays of numpy, which quick readers do not import
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): jsonable(entry) for key, entry in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [jsonable(entry) for entry in value]
    return value


FIGURE_FORMATS = ("svg", "png", "pdf")
"""Formats in which figures of a report are written."""
HIGHEST = "highest_omega_dt"
"""Name of the highest angular frequency of small oscillations times the step, where it is not that of a period."""
PHASE, AMPLITUDE = "_phase_error", "_amplitude_error"
"""What follows the name of the position in the names of the parts of its error."""
CENTRED = "_d2t"
"""Ends the name of a velocity or an energy that is made with the centred difference ``[D_2t u]`` of the position."""


def plain_name(name: str) -> str:
    """Return the name of a quantity without the mark of the velocity that it is made with."""
    return name.removesuffix(CENTRED)


def is_error_part(name: str) -> bool:
    """Tell whether a quantity is a part of a position's error."""
    return name.endswith((PHASE, AMPLITUDE))


def whole_of(name: str) -> str:
    """Return the position that a part belongs to; any other quantity as it is."""
    return name.removesuffix(PHASE).removesuffix(AMPLITUDE)
