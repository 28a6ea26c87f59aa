"""The picture of an error: of the finest level with its bound, beside what is asked, and of all levels where known."""

from __future__ import annotations

import numpy as np

from vibsim.checks.value import unit_of_norm
from vibsim.core.record import Record
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.report import data, style
from vibsim.report.data import Member, at
from vibsim.report.evidence import frame
from vibsim.report.evidence.frame import evidence, measured
from vibsim.report.style import Picture
from vibsim.report.text import words
from vibsim.report.types import AccurateCheck


def picture(record: Record, check: AccurateCheck, name: str, member: Member) -> Picture | None:
    """Draw the errors of the levels; None where that of the finest is not known."""
    error, bound, size = (
        measured(record, name, field, member.scheme, member.case)
        for field in ("error", "error_bound", "size")
    )
    levels = data.whole(record, "level")
    whole = size if check.is_relative else 1.0
    errors = np.full(len(levels), np.nan)
    norms = f"{check.accurate}_error_norm"
    if norms in record:
        errors = np.array(at(record, norms, member, norm=data.norm_index(record, TYPICAL_NORM)))
    errors[-1] = error
    if not (np.isfinite(bound) and error > 0.0 and whole > 0.0):
        return None
    shown, most = errors / whole, bound / whole
    what = words.symbol(check.accurate)
    title = f"relative error of {what}"
    if not check.is_relative:
        unit = data.pretty_unit(unit_of_norm(record, check.accurate))
        title = style.label(f"error of {what}", unit)
    figure = style.canvas(1.0)
    ax = frame.panel(figure, title, "level")
    frame.level_axis(ax, levels)
    frame.scale(ax, shown, np.array([most, check.accuracy]), is_log=True)
    frame.below(ax, check.accuracy)
    ax.plot([levels[-1]] * 2, [shown[-1], most], color=frame.COLOUR, linewidth=1.5)
    frame.points(ax, levels, shown, [i == len(levels) - 1 for i in range(len(levels))])
    caption = (
        f"{member.title}: the error in the L2 norm over time; filled at the finest level, with a bar up to its bound. "
        "Grey: what the check asks for."
    )
    return evidence(caption, f"Evidence on the error of {words.name(check.accurate)}", figure)
