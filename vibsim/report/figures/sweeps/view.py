"""One quantity of all members of a sweep: its figure, and what a page needs to find members in it again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from vibsim.checks.fields import field_values
from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import REASONS
from vibsim.report import finest_level, style, words
from vibsim.report.data import Member, flags
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Key
from vibsim.report.types import Axes, Experiment, ValueCheck

SHOWN_ALREADY = ("period", "period_error", "exact_period", "amplitude")
"""Values of checks that have views of their own."""
Worst = Callable[[str], Member]
"""Returns the worst member, judged by a quantity."""


@dataclass(frozen=True)
class View:
    """A quantity of all members, as a map, as curves, or against each swept key."""

    name: str
    """What a reader chooses it by."""
    picture: Picture
    """Its panels have the group id `vibsim.report.style.MEMBER`; without one no member can be pointed at."""
    quantity: str = ""
    """Whose verdicts its members have."""
    values: Floats | None = None  # shape (scheme, case); None of a verdict, which is told anyway
    places: Floats | None = None
    """Where members stand in a panel over a key, of the same shape, where the values do not say it."""
    unit: str = ""
    texts: tuple[str, ...] = ()
    """What the values stand for, where they number texts."""
    schemes: tuple[int, ...] = ()  # those drawn
    of: str = ""
    """The scheme that is drawn, where each has a view of its own."""
    panels: tuple[tuple[int, int | None], ...] = ((0, None),)
    """Of every panel the positions of the keys along x and y; None stands for the value."""
    worst: int | None = None
    """The position of the member that is marked."""


def value_checks(experiment: Experiment) -> list[tuple[str, ValueCheck]]:
    """Return the checks, with their ids, on a number of every member that has no view of its own."""
    found = [(check.id, check.measured) for check in experiment.checks]
    return [
        (name, check)
        for name, check in found
        if check.kind == "value" and check.at.case is None and check.value not in SHOWN_ALREADY
    ]


def of_check(record: Record, name: str, check: ValueCheck) -> Floats:
    """Return the number that a check asks for, shape (scheme, case); NaN of schemes that it is not about."""
    schemes = np.array([check.at.scheme in (None, scheme) for scheme in record.words("scheme")])
    return np.where(schemes[:, None], field_values(record, name, "value"), np.nan)


def by_scheme(record: Record, scheme: int, values: Floats) -> Floats:
    """Return numbers of the members of one scheme as those of every scheme, shape (scheme, case); NaN of the others."""
    found = np.full((len(record["scheme"]), values.size), np.nan)
    found[scheme] = values
    return found


def check_words(check: ValueCheck) -> str:
    """Name the number that a check asks for."""
    of = f" of {words.symbol(check.quantity)}" if check.quantity else ""
    return f"{check.value}{of}".replace("_", " ")


def shared_verdict(record: Record, quantity: str, scheme: int | None = None) -> str:
    """Say which verdict all members have, of all schemes or of one; empty where they differ."""
    reason = flags(record, f"{quantity}_reason")[slice(None) if scheme is None else scheme]
    found = np.unique(reason.astype(str))
    if found.size != 1:
        return ""
    return f"verdict on {words.symbol(quantity)} {REASONS[found[0]]} ({found[0]})"


def shared(name: str, values: Floats, unit: str = "", form: str = "step") -> str:
    """Say which value all members share that have one, ``period 6.283 s``; empty where they differ or none has one."""
    known = style.finite(values)
    if not known.size or finest_level.varies(values):
        return ""
    number = words.number(float(known[0]), form)
    some = known.size < values.size
    who = f" ({words.number(known.size, 'integer')} have one)" if some else ""
    return f"{name} {number} {unit}".rstrip() + who


def key_axis(ax: Axes, key: Key, part: float) -> None:
    """Give the horizontal axis the scale and the words of a key, of a logarithmic one with room at both ends.

    The room is the `part` of the decades that the key spans.
    """
    if key.is_log:
        room = (key.distinct[-1] / key.distinct[0]) ** part
        style.log_axis(ax, "x", float(key.distinct[0] / room), float(key.distinct[-1] * room))
    if key.words:
        ax.set_xticks(key.distinct, key.words)


def ring(ax: Axes, x: float, y: float, *, on_map: bool = False) -> bool:
    """Draw a ring around the worst member, whole at an edge, too; say whether it has a place on the axes."""
    limits = ax.get_xlim(), ax.get_ylim()
    if not all(low <= at <= high for at, (low, high) in zip((x, y), limits, strict=True)):
        return False
    look: dict[str, Any] = {"markerfacecolor": "none", "zorder": 6, "clip_on": False}
    if on_map:
        ax.plot([x], [y], "o", color="white", markersize=11, markeredgewidth=3.0, **look)
    ax.plot([x], [y], "o", color="black", markersize=9, markeredgewidth=1.8, **look)
    ax.set(xlim=limits[0], ylim=limits[1])
    return True
