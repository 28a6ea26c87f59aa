"""The picture of a number by level: beside its bound, or as distance from the number that it should equal.

An extrapolated number is drawn to the right of the levels, with the bound of its error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from vibsim.checks.number_units import unit_of_norm
from vibsim.checks.value_text import what
from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import OF_LEVEL
from vibsim.experiment.value_names import OF_ONE_MEMBER
from vibsim.observe.steady_state import continued
from vibsim.report import style, words
from vibsim.report.choice import CheckedLadder
from vibsim.report.data import pretty_unit
from vibsim.report.evidence import frame
from vibsim.report.evidence.frame import evidence
from vibsim.report.style import Picture
from vibsim.report.types import AccurateCheck, Axes, ValueCheck


def picture(checked: CheckedLadder, check: ValueCheck) -> Picture | None:
    """Draw a number by level, or its distance from the one that it should equal.

    None if no level has it, or all have the number expected.
    """
    if check.take not in OF_ONE_MEMBER:
        return None  # the check is not on a number of a single member
    by_level = _values(checked, check)
    if by_level is None or not np.isfinite(by_level[0]).any():
        return None
    row = _row(checked, check, by_level[0])
    if check.number.is_angle:
        near = row.values[-1] if check.equals is None else check.equals
        row = replace(row, values=continued(row.values, near))
    values, title, number = row.values, style.label(_number_title(check), by_level[1]), words.number
    if not np.isfinite(values[row.counts]).any():
        return None
    if values.size > 1 and np.all(values == check.equals):
        return None  # a picture of the same number on every level says no more than the number
    bar = values[-1] + np.array([-row.bound, row.bound])
    if check.equals is None:
        return _beside_border(row, check, title, bar)
    target, allowed = check.equals, check.allowed
    away = np.abs(values - target)
    nonzero = frame.usable(away)
    # finer levels do not approach the number expected of a coarser one
    is_limit = row.counts[-1] or check.at.level is None
    if not is_limit or not nonzero.size or allowed <= 0.0:
        around = target + np.array([-allowed, allowed])
        ax = row.panel(title, values, around, is_log=False)
        band_text = f"what the tolerance allows around {number(target, 'step')} (dashed)"
        return row.finish(ax, (around[0], around[1]), target, bar, band_text)
    ends = np.maximum(away[-1] + np.array([-row.bound, row.bound]), 0.0)
    around = np.append(ends[1:], [allowed, 0.1 * nonzero.max()])
    ax = row.panel(f"distance of {title} from {number(target, 'step')}", away, around, is_log=True)
    edge = "; a triangle at the lower edge has no distance at all" if np.any(away == 0.0) else ""
    return row.finish(ax, (0.0, allowed), allowed, ends, f"what the tolerance allows{edge}")


def _beside_border(row: ByLevel, check: ValueCheck, title: str, bar: Floats) -> Picture | None:
    """Draw a number by level beside its upper or lower bound."""
    border = check.above if check.below is None else check.below
    if border is None:
        return None
    is_log = style.spans_decades(np.append(row.values, border))
    ax = row.panel(title, row.values, np.append(bar, border), is_log=is_log)
    band = (border, math.inf) if check.below is None else (-math.inf, border)
    return row.finish(ax, band, border, bar, "where it should lie")


def _number_title(check: ValueCheck) -> str:
    text = what(check, words.PAGE)
    if check.number.is_sample or (check.at.t is None and check.at.step is None):
        return text
    return f"{text} up to {f't = {check.at.t:g}' if check.at.t is not None else f'step {check.at.step}'}"


def _values(checked: CheckedLadder, check: ValueCheck) -> tuple[Floats, str] | None:
    """Return a number on every level with its unit; None if the record lacks it."""
    record, member = checked.record, checked.member
    if (field := checked.variable("value_by_level")) in record:
        return record.at(field, member), record.unit_of_number(check)
    if check.at.t is not None or check.at.step is not None:
        return None
    variable = f"{check.quantity}_{check.value}" if check.quantity else check.value
    if variable in record and record.variable(variable).dims == OF_LEVEL:
        return record.at(variable, member), record.unit(variable)
    norm, errors = check.value.removeprefix("error_"), f"{check.quantity}_error_norm"
    if norm == check.value or errors not in record or norm not in record.words("norm"):
        return None
    return record.at(errors, member, norm), record.norm_unit(str(check.quantity), norm)


@dataclass(frozen=True)
class ByLevel:
    """A number on every level, and perhaps, after them, the extrapolated number."""

    levels: list[int]
    values: Floats
    counts: list[bool]  # whether a value is the one that the check judges
    scheme: str
    bound: float = math.nan  # of the error of the extrapolated number; NaN without one

    def panel(self, title: str, values: Floats, around: Floats, *, is_log: bool) -> Axes:
        """Return a new panel with values by level, whose range also holds the values `around`."""
        ax = frame.panel(style.canvas(1.0), title, "level")
        is_best = values.size > len(self.levels)
        frame.level_axis(ax, self.levels, extra="best" if is_best else "")
        frame.scale(ax, values, around, is_log=is_log)
        places = [*self.levels, self.levels[-1] + 1][: values.size]
        frame.points(ax, places, values, self.counts)
        return ax

    def finish(
        self, ax: Axes, band: tuple[float, float], border: float, ends: Floats, band_text: str
    ) -> Picture:
        """Fill a band, draw a border and, between finite `ends`, an error bar; return the picture."""
        frame.allowed(ax, *band)
        ax.axhline(border, **frame.DASHED)
        bar = ""
        if np.isfinite(ends).all():
            ax.plot(np.full(2, self.levels[-1] + 1.0), ends, color=frame.COLOUR, linewidth=1.2)
            bar = "; the bar is the bound of its error"
        one = len(self.levels) == 1 and len(self.values) == 1
        head = f"{self.scheme}, level {self.levels[0]}" if one else f"{self.scheme}, level by level"
        caption = f"{head}: the one asked for is filled{bar}; grey is {band_text}."
        return evidence(caption, ax.get_title(loc="left"), ax.get_figure(root=True))


def _row(checked: CheckedLadder, check: ValueCheck, values: Floats) -> ByLevel:
    """Return the numbers of the levels, and after them the extrapolated one if the check judges that."""
    levels, title = checked.record.levels, checked.title
    if check.at.level != "best":
        valid = check.number.own_levels(levels) or levels
        judged = valid[-1] if check.at.level is None else check.at.level
        return ByLevel(levels, values, [level == judged for level in levels], title)
    best, bound = checked.numbers("value", "error_bound")
    counts = [False] * len(levels) + [True]
    return ByLevel(levels, np.append(values, best), counts, title, bound)


def of_error(checked: CheckedLadder, check: AccurateCheck) -> Picture | None:
    """Draw the errors of the levels; None if that of the finest level is unknown."""
    error, bound, size = checked.numbers("error", "error_bound", "size")
    levels, ladder = checked.record.levels, checked.of(check.accurate)
    scale = size if check.is_relative else 1.0
    errors = np.array(ladder.optional("error_norm", ("level",)))
    errors[-1] = error
    if not (np.isfinite(bound) and error > 0.0 and scale > 0.0):
        return None
    shown, most = errors / scale, bound / scale
    title = f"error of {ladder.letter}"
    measure = pretty_unit(unit_of_norm(checked.record, check.accurate))
    title = f"relative {title}" if check.is_relative else style.label(title, measure)
    row = ByLevel(levels, shown, [level == levels[-1] for level in levels], checked.title)
    ax = row.panel(title, shown, np.array([most, check.accuracy]), is_log=True)
    frame.below(ax, check.accuracy)
    ax.plot([levels[-1]] * 2, [shown[-1], most], color=frame.COLOUR, linewidth=1.5)
    caption = (
        f"{checked.title}: the error in the L2 norm over time; filled at the finest level, with a bar up to its bound. "
        "Grey: what the check asks for."
    )
    alt = f"Evidence on the error of {ladder.name}"
    return evidence(caption, alt, ax.get_figure(root=True))
