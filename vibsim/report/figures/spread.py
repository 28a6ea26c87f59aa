"""How a number is spread over the members of a sweep: order, error, error of the period, by verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.record import Record
from vibsim.core.vocabulary import SEVERITY, TYPICAL_NORM
from vibsim.report import finest_level, style
from vibsim.report.choice import position, tolerance
from vibsim.report.data import Floats, flags, norm_unit, of_several, promised_text, whole
from vibsim.report.figures.panels import rows_of
from vibsim.report.style import Picture
from vibsim.report.text import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from vibsim.experiment import Experiment

BARS = 50
FEWEST = 60
"""Of fewer members a histogram says nothing."""
ROW, ABOVE, FOOT = 1.5, 0.36, 0.56
"""Height of a panel, room above and below [inch]."""


@dataclass(frozen=True)
class Spread:
    """One histogram."""

    title: str
    values: Floats
    """Of every member, shape (case,)."""
    label: str
    is_log: bool
    band: tuple[float, float] | None = None
    """Drawn in grey."""


def histograms(experiment: Experiment, record: Record, quantity: str) -> Picture | None:
    """Draw the spread of order, error and period error, one row per scheme; None for few members."""
    if len(record["case"]) < FEWEST:
        return None
    schemes = record.words("scheme")[:SHOWN]
    first = _spreads(experiment, record, quantity, 0)
    columns = [(0.68 + 2.83 * i, 2.45) for i in range(len(first))]
    figure, axes = rows_of(len(schemes) * len(columns), columns, ROW, ABOVE, FOOT)
    status = flags(record, f"{quantity}_status")
    missing = 0
    for s in range(len(schemes)):
        row = axes[s * len(columns) : (s + 1) * len(columns)]
        row[0].set_ylabel("members")
        for ax, spread in zip(row, _spreads(experiment, record, quantity, s), strict=False):
            missing += _draw(ax, spread, status[s])
    _explain(axes[0], status)
    return Picture(
        name=f"spread_{quantity}",
        title=f"How the members are spread: {words.symbol(quantity)}",
        caption="Number of members by what was measured of them, on a logarithmic scale so that a single one is seen; "
        "the colour is the verdict on the order. A few far from the rest are the ones to look at."
        + (" Members without the number are left out." if missing else ""),
        alt=f"Histograms of the order and the error of {words.name(quantity)} over the members",
        figure=figure,
    )


def _explain(ax: Axes, status: NDArray[Any]) -> None:
    from matplotlib.patches import Patch

    counts = {word: int(np.sum(status == word)) for word in SEVERITY}
    handles = [
        Patch(color=style.STATUS_COLOURS[word], label=f"{word} ({words.number(n, 'integer')})")
        for word, n in counts.items()
        if n
    ]
    ax.legend(handles=handles, fontsize=7, handlelength=1.0, loc="upper left", borderaxespad=0.2)


SHOWN = 6
"""Most schemes that have a row."""


def _spreads(experiment: Experiment, record: Record, quantity: str, s: int) -> list[Spread]:
    """Return the histograms of a scheme; each has as many."""
    letter, level = words.symbol(quantity), whole(record, "level")[-1]
    several = of_several(record, s)
    found = finest_level.error(record, quantity)
    kind = "true" if found.is_known else "estimated"
    measure = norm_unit(record, quantity, TYPICAL_NORM)
    promised = promised_text(record, quantity, s)
    away = finest_level.deviation(record, quantity)[s]
    allowed = tolerance(experiment, quantity, record.words("scheme")[s])
    spreads = [
        Spread(f"Order of {letter}{several}", away, f"stated order − {promised}", False, (-allowed, allowed)),
        Spread(f"Error of {letter}, level {level}", found.best[s], style.label(f"{kind} error", measure), True),
    ]  # fmt: skip
    relative = finest_level.period_error(record, -1)
    if quantity == position(experiment) and np.isfinite(relative).any():
        spreads.append(Spread("Error of the period", relative[s], "|period / exact − 1|", True))
    return spreads


def _draw(ax: Axes, spread: Spread, status: NDArray[Any]) -> int:
    """Draw a histogram stacked by verdict; return how many members have no such number."""
    values = spread.values
    usable = np.isfinite(values) & (values > 0.0 if spread.is_log else True)
    ax.set_title(spread.title, fontsize=9)
    ax.set_xlabel(spread.label, fontsize=8.5, labelpad=2)
    ax.tick_params(labelsize=7.5)
    if not usable.any():
        style.remark(ax, "no such number")
        return values.size
    low, high = float(values[usable].min()), float(values[usable].max())
    if spread.is_log:
        low, high = max(low, high * 1e-18, style.TINIEST), min(high, style.LARGEST)
        borders = np.geomspace(low / 1.2, high * 1.2, BARS + 1)
        style.log_axis(ax, "x", float(borders[0]), float(borders[-1]))
    else:
        borders = np.linspace(*style.limits(values[usable], np.array(spread.band or ())), BARS + 1)
    if spread.band:
        ax.axvspan(*spread.band, **style.ALLOWED)
    base = np.zeros(BARS)
    for word in reversed(tuple(SEVERITY)):
        count = np.histogram(values[usable & (status == word)], borders)[0]
        if count.any():
            ax.stairs(
                base + count, borders, baseline=base, fill=True, color=style.STATUS_COLOURS[word]
            )
        base = base + count
    ax.set_yscale("log")
    style.log_axis(ax, "y", 0.7, 2.0 * max(float(base.max()), 1.0))
    return int(np.sum(~usable))
