"""Words and numbers used throughout vibsim: statuses, reasons, norms, dimensions, and the file format.

This module imports nothing of vibsim and no third-party library, so that any command may import it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Literal, get_args

Status = Literal["PASS", "FAIL", "INCONCLUSIVE"]
STATUSES: tuple[Status, ...] = get_args(Status)
"""Every status; files store the index into this tuple."""
SEVERITY: Mapping[str, int] = MappingProxyType({"PASS": 0, "INCONCLUSIVE": 1, "FAIL": 2})
"""Severity of each of `STATUSES`; larger is worse."""

_REASONS: Mapping[Status, str] = {
    "PASS": "asymptotic exact match",
    "FAIL": "order_low order_high mismatch wrong_limit unstable non_finite",
    "INCONCLUSIVE": "pre_asymptotic round_off oscillating non_smooth too_few_levels not_applicable",
}
REASONS: Mapping[str, Status] = MappingProxyType(
    {reason: status for status, words in _REASONS.items() for reason in words.split()}
)
"""Every reason of a verdict, with its status."""
REASON_NAMES = tuple(REASONS)
"""The names of the reasons; files store the index into this tuple."""

DRIFTS = ("none", "bounded", "linear", "quadratic", "exponential", "unclear")
"""How the error of an energy grows with time; files store the index into this tuple."""

Norm = Literal["l1", "l2", "linf", "linf_interior"]
NORMS: tuple[Norm, ...] = get_args(Norm)
"""Every norm over time; ``linf_interior`` leaves the last point out."""
SECONDS_OF_NORM: dict[str, float] = {"l1": 1.0, "l2": 0.5, "linf": 0.0, "linf_interior": 0.0}
"""The power of s that each norm adds to the unit of an error or a difference."""
TYPICAL_NORM: Norm = "l2"
"""The default norm of a check, and the norm of the verdict on a quantity."""
MEMBER = ("scheme", "case")
"""Dimensions of a scalar of each scheme and member."""
SERIES = (*MEMBER, "t")
"""Dimensions of a series over the stored times."""
OF_LEVEL = (*MEMBER, "level")
"""Dimensions of a scalar of each scheme, member and level."""
Restriction = Literal["subset", "mean", "linear", "cubic"]
RESTRICTIONS: tuple[Restriction, ...] = get_args(Restriction)
"""Ways to restrict the levels of a study to common points."""
PEAKS = "interpolated peaks"
"""How growth is measured where no recurrence of the steps gives it."""
ORDER_TOLERANCE = 0.1
"""Default distance that a check allows between the measured and the promised order."""
LEVELS_OF_AN_ORDER = 3
"""Fewest levels that show an order, and the size of their error."""
BY_TOLERANCE = "tolerance"
"""Name and kind of the additional verdict on an experiment with a tolerance."""

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
"""Name of the fact that decides each kind of check; no check has the deciding fact of a kind listed before it."""
ERROR_FACTS = ("error", "error_bound", "relative_error")
"""Facts on the error of the finest level, in every check that states it."""


def decisive_number(facts: Mapping[str, Any]) -> float | None:
    """Return the number that decides a result with these facts; None if an order decides or it is not finite."""
    number: float | None = next((facts[name] for name in DECISIVE.values() if name in facts), None)
    return None if DECISIVE["converges"] in facts else number


def is_trap(check: Mapping[str, Any]) -> bool:
    """Return whether a check of a summary expects a failure, or a claim to be false."""
    if check["kind"] == "claim":
        return bool(check["expected"] == "false")
    return str(check["expected"]).startswith(("FAIL", "INCONCLUSIVE"))


FORMAT = 2
"""Version of the file format, ``vibsim_format`` in every file."""


def worst(statuses: Iterable[str]) -> str:
    """Return the worst of several statuses; INCONCLUSIVE if there are none.

    Raises
    ------
    KeyError
        For a word that is not a status.
    """
    return max(statuses, key=SEVERITY.__getitem__, default="INCONCLUSIVE")


def jsonable(value: Any) -> Any:
    """Return plain data for JSON: lists and mappings, and None for numbers that are not finite."""
    if hasattr(value, "tolist"):  # a number or array of numpy, which is not imported here
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): jsonable(entry) for key, entry in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [jsonable(entry) for entry in value]
    return value


FIGURE_FORMATS = ("svg", "png", "pdf")
"""Formats of the figures of a report."""
HIGHEST = "highest_omega_dt"
"""Variable with the highest angular frequency of small oscillations times the step, if it is not that of the period."""
PHASE, AMPLITUDE = "_phase_error", "_amplitude_error"
"""Suffixes that form the names of the error parts of a position."""
POSITION_VECTOR, VELOCITY_VECTOR = "position_vector", "velocity_vector"
VECTORS = (POSITION_VECTOR, VELOCITY_VECTOR)
"""All coordinates of a model with several, taken together: compared between levels, but not stored as series."""
CENTRED = "_d2t"
"""Suffix of velocities and energies computed with the centred difference ``[D_2t u]`` of the position."""


def plain_name(name: str) -> str:
    """Return the name of a quantity without the suffix `CENTRED`."""
    return name.removesuffix(CENTRED)


def is_error_part(name: str) -> bool:
    """Tell whether a quantity is the phase error or the amplitude error of a position."""
    return name.endswith((PHASE, AMPLITUDE))


def whole_of(name: str) -> str:
    """Return the position to which an error part belongs; any other quantity unchanged."""
    return name.removesuffix(PHASE).removesuffix(AMPLITUDE)
