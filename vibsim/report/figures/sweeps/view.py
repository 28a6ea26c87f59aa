"""One number of all members of a sweep: its figure, and the data by which a page finds members in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from vibsim.checks.fields import field_values
from vibsim.checks.value_text import what
from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import REASONS
from vibsim.report import finest_level, style, words
from vibsim.report.data import Member, Results
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Key
from vibsim.report.types import Axes, ValueCheck

SHOWN_ALREADY = ("period", "period_error", "exact_period", "amplitude")
"""Values of checks whose views exist anyway."""
Worst = Callable[[str], Member]  # returns the worst member, judged by its verdict on a quantity


@dataclass(frozen=True)
class View:
    """A number of all members: a map, curves, or panels for each swept key."""

    name: str  # name by which a reader chooses it
    picture: Picture  # panels with the group id `vibsim.report.style.MEMBER` respond to the pointer
    quantity: str = ""  # the quantity of the verdicts that are shown with a member
    values: Floats | None = (
        None  # of `schemes`, shape (scheme, case); None for a verdict, which is shown anyway
    )
    places: Floats | None = None  # vertical positions of the members if they are not the values
    unit: str = ""
    schemes: tuple[int, ...] = ()  # those drawn
    of: str = ""  # the scheme, if each has its own view
    panels: tuple[tuple[int, int | None], ...] = ((0, None),)
    """Positions of the keys along x and y of every panel; None stands for the value."""
    worst: int | None = None  # position of the marked member


def value_checks(record: Results) -> list[tuple[str, str, ValueCheck]]:
    """Return id, number in words and value check, once for each number of all members that has no view elsewhere."""
    found: dict[tuple[str, str | None], tuple[str, str, ValueCheck]] = {}
    for asserted in record.experiment.checks:
        check = asserted.measured
        if check.kind != "value" or check.at.case is not None or check.value in SHOWN_ALREADY:
            continue
        text, alone = of_a_member(check)
        found.setdefault((text, check.at.scheme), (asserted.id, text, alone))
    return list(found.values())


def of_a_member(check: ValueCheck, finest: int | None = None) -> tuple[str, ValueCheck]:
    """Return the number of a member in words, with its level unless that is the `finest`, and the check on it alone."""
    of = "value of " if check.number.is_sample else ""
    level = "the limit of the levels" if check.at.level == "best" else f"level {check.at.level}"
    at = "" if check.at.level in (None, finest) else f" at {level}"
    return f"{of}{what(check, words.PAGE)}{at}", check.model_copy(update={"take": None})


def of_check(record: Results, name: str, check: ValueCheck) -> Floats:
    """Return the numbers of a check, shape (scheme, case); NaN for schemes that it does not judge."""
    schemes = np.array([check.at.scheme in (None, scheme) for scheme in record.schemes])
    return np.where(schemes[:, None], field_values(record, name, "value"), np.nan)


def shared_verdict(record: Results, quantity: str, scheme: int | None = None) -> str:
    """Say which verdict all members share, of all schemes or of one; empty if they differ."""
    reason = record.flags(f"{quantity}_reason")[slice(None) if scheme is None else scheme]
    reasons = np.unique(reason.astype(str))
    if reasons.size != 1:
        return ""
    return f"verdict on {words.title(quantity)} {REASONS[reasons[0]]} ({reasons[0]})"


def shared(name: str, values: Floats, unit: str = "", form: str = "step") -> str:
    """Say which finite value all members share, such as ``period 6.283 s``; empty if there is none.

    Orders are compared to three decimals.
    """
    finite = style.finite(np.round(values, 3) if form == "order" else values)
    if not finite.size or finest_level.varies(finite):
        return ""
    number = words.number(float(finite[0]), form)
    is_partial = finite.size < values.size
    count = f" ({words.number(finite.size, 'integer')} have one)" if is_partial else ""
    return f"{name} {number} {unit}".rstrip() + count


def key_axis(ax: Axes, key: Key, margin: float, most: int = 7, **look: Any) -> None:
    """Give the horizontal axis the scale, the words and the label of a key.

    A logarithmic axis is extended at both ends by the fraction `margin` of the decades that the key spans.
    """
    if key.is_log:
        style.log_axis(ax, "x", *style.log_limits(key.distinct, margin=margin), most=most)
    if key.words:
        ax.set_xticks(key.distinct, key.words)
    ax.set_xlabel(key.label, **look)


def ring(ax: Axes, x: float, y: float, *, on_map: bool = False) -> bool:
    """Draw a ring around the worst member, not clipped at the edges; return whether it lies within the axes."""
    limits = ax.get_xlim(), ax.get_ylim()
    if not all(low <= at <= high for at, (low, high) in zip((x, y), limits, strict=True)):
        return False
    look: dict[str, Any] = {"markerfacecolor": "none", "zorder": 6, "clip_on": False}
    if on_map:
        ax.plot([x], [y], "o", color="white", markersize=11, markeredgewidth=3.0, **look)
    ax.plot([x], [y], "o", color="black", markersize=9, markeredgewidth=1.8, **look)
    ax.set(xlim=limits[0], ylim=limits[1])
    return True
