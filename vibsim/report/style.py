"""The look of the figures: colour-blind safe, legible in black-and-white print, with reproducible bytes.

Colours are those of Okabe and Ito (2008), each with its own dash pattern and marker. Text stays text, which readers can
search and copy; it is laid out with a wide font, so that a narrower substitute still fits.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.report.types import Axes, Figure
from vibsim.report.words import number, power

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
DASHES: tuple[Any, ...] = (
    "-", (0, (5, 2)), (0, (1.2, 1.6)), (0, (6, 2, 1.2, 2)), (0, (9, 2)), (0, (3, 1.5, 1, 1.5, 1, 1.5)), (0, (2, 3)),
)  # fmt: skip
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
GREY = "#707070"
PALE = "#b0b0b0"  # of the reference that a solution is compared with
STATUS_MARKERS = {"PASS": "o", "INCONCLUSIVE": "s", "FAIL": "X"}
STATUS_COLOURS = {"PASS": "#009E73", "INCONCLUSIVE": "#E69F00", "FAIL": "#D55E00"}
REASON_COLOURS = {
    "asymptotic": "#009E73", "exact": "#8FD3BD", "match": "#00553E",
    "pre_asymptotic": "#E69F00", "round_off": "#F0E442", "oscillating": "#B8860B", "non_smooth": "#7A5C00",
    "too_few_levels": "#F7D9A0", "not_applicable": "#CFC79A",
    "order_low": "#D55E00", "order_high": "#AA2288", "mismatch": "#CC79A7", "wrong_limit": "#5E3C99",
    "unstable": "#7F1D00", "non_finite": "#000000",
}  # fmt: skip
"""Reason of a verdict to its colour on a map: greens, yellows and reds by status."""
REFERENCE = dict[str, Any](color="black", linestyle=(0, (4, 3)), linewidth=1.0, zorder=1)
"""Look of promised or exact values."""
ALLOWED = dict[str, Any](color="#ececec", zorder=0)
"""Look of the band that a tolerance allows."""
BESIDE = dict[str, Any](loc="upper left", bbox_to_anchor=(1.01, 1.03), borderaxespad=0.0)
"""Place of a legend at the right of its axes."""
TIME, STEP, MEMBER = "time", "step", "member"
"""Group ids of axes that a page can read: over time, over the step, and with members (`vibsim.report.figures.svg`)."""
LONG, OVERVIEW = "long", "overview"
"""Group ids of a long series, followed by the initial width of its window, and of the strip with its whole time."""
MISSING = "#d4d4d4"  # colour of missing values
WIDTH = 9.0  # of a figure [inch]
THINNED_POINTS = 400  # horizontal resolution of a thinned series
MANY = len(COLOURS)  # schemes above which all panels of a figure share one legend
LOG_RATIO = 30.0  # ratio of largest to smallest value above which an axis is logarithmic
LARGEST, TINIEST = 1e300, 1e-300  # of logarithmic axes: beyond, a margin would overflow
LEAST, MOST = 1e-290, 1e290  # limits of logarithmic axes
TICK_DIGITS = 12  # most significant digits of a tick, enough to tell neighbours apart
DECADES = (1, 2, 3, 5, 10, 20, 30, 50, 100, 200, 300)  # possible spacings of logarithmic ticks

_RC: dict[Any, Any] = {
    "axes.edgecolor": "#404040",
    "axes.formatter.useoffset": False,
    "axes.grid": True,
    "axes.labelsize": 9.5,
    "axes.linewidth": 0.7,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    # a fixed position saves matplotlib's search for one, a third of the time of an axis
    "axes.titley": 1.0,
    "font.family": ["DejaVu Sans"],
    "font.size": 9.0,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.6,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "legend.handlelength": 3.4,
    "lines.linewidth": 1.4,
    "savefig.dpi": 160,
    "svg.fonttype": "none",
    "text.parse_math": False,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
}


@dataclass(frozen=True)
class Picture:
    """A figure with its texts."""

    name: str  # stem of its files, in ASCII, unique on its page
    title: str
    caption: str  # what to look for
    alt: str  # the same content for readers who cannot see it
    figure: Figure | None  # None if a check has nothing to draw; the caption says why


@contextmanager
def applied() -> Iterator[None]:
    """Use the look of this module while figures are built and saved."""
    import matplotlib

    _import_matplotlib()
    with matplotlib.rc_context(_RC):
        yield


def _import_matplotlib() -> None:
    """Import matplotlib's drawing modules without generating docstrings for its classes, a fifth of the time."""
    from matplotlib import artist

    module: Any = artist
    names = ((module, "kwdoc"), (module.Artist, "_update_set_signature_and_docstring"))
    originals = [(place, name, vars(place)[name]) for place, name in names]
    module.kwdoc = lambda _: ""
    module.Artist._update_set_signature_and_docstring = classmethod(_without_help)
    try:
        import_module("vibsim.report.canvas")
    finally:
        for place, name, value in originals:
            setattr(place, name, value)


def _without_help(cls: Any) -> None:
    """Mark the method `set` of an artist class as generated, as matplotlib does when it adds the docstring."""
    cls.set._autogenerated_signature = True


def canvas(height: float, width: float = WIDTH) -> Figure:
    """Return an empty figure of given `height` and `width` [inch]."""
    from vibsim.report.canvas import Canvas

    return Canvas(figsize=(width, height))


def look(i: int) -> dict[str, Any]:
    """Return colour, dashes and marker of the i-th line; a repeated colour has other dashes and another marker."""
    count, turn = len(COLOURS), i // len(COLOURS)
    return {
        "color": COLOURS[i % count],
        "linestyle": DASHES[(i + turn) % count],
        "marker": MARKERS[(i + 2 * turn) % count],
    }


def thin(t: Floats, y: Floats, width: int = THINNED_POINTS) -> tuple[Floats, Floats]:
    """Thin a series for drawing without losing extremes.

    Of ascending `t` and values `y` of shape (n,), where NaN is a gap, the first, the last, and the smallest and largest
    value (or one NaN) of each of `width` groups of neighbours remain: at most ``2 * width + 2`` points.
    """
    n = y.size
    if n <= 2 * width + 2:
        return t, y
    edges = np.linspace(1, n - 1, width + 1).astype(int)[:-1]
    groups = np.repeat(np.arange(width), np.diff([*edges, n - 1]))
    inner = np.where(np.isfinite(y[1:-1]), y[1:-1], np.nan)
    order = np.lexsort((inner, groups))
    count = np.add.reduceat(np.isfinite(inner).astype(int), edges - 1)
    low = order[edges - 1] + 1
    high = order[edges - 1 + np.maximum(count - 1, 0)] + 1
    keep = np.unique([0, *low.tolist(), *high.tolist(), n - 1])
    return t[keep], y[keep]


def curve(ax: Axes, t: Floats, y: Floats, **look: Any) -> None:
    """Draw a thinned series; a single value between two gaps, which no line shows, is a dot."""
    x, values = thin(t, y)
    ax.plot(x, values, **look)
    is_gap = np.concatenate([[True], ~np.isfinite(values), [True]])
    alone = ~is_gap[1:-1] & is_gap[:-2] & is_gap[2:]
    dot = {key: look[key] for key in ("color", "gid") if key in look}
    if alone.any():
        ax.plot(x[alone], values[alone], ".", markersize=3, **dot)


def thin_band(t: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats, Floats]:
    """Thin a band for drawing without making it narrower anywhere.

    Of ascending `t` and borders of shape (n,), where NaN is a gap, each of `THINNED_POINTS` groups of neighbours keeps
    its first and last time, with the smallest and largest value of the group: at most ``2 * THINNED_POINTS`` points.
    Gaps within a group are closed.
    """
    n = t.size
    if n <= 2 * THINNED_POINTS:
        return t, low, high
    first = np.linspace(0, n, THINNED_POINTS + 1).astype(int)
    ends = np.column_stack([first[:-1], first[1:] - 1]).ravel()
    least, most = np.fmin.reduceat(low, first[:-1]), np.fmax.reduceat(high, first[:-1])
    return t[ends], np.repeat(least, 2), np.repeat(most, 2)


def spaced(count: int, most: int) -> list[int]:
    """Choose at most `most` of `count` positions: the first, the last, and evenly spaced ones between."""
    return sorted({round(x) for x in np.linspace(0, count - 1, min(most, count))})


def finite(*series: Floats) -> Floats:
    """Return the finite values of all arrays together, shape (n,)."""
    return np.concatenate([np.empty(0), *(part[np.isfinite(part)] for part in series)])


def positive(values: Floats) -> Floats:
    """Return values, with NaN for those that are not positive and finite."""
    return np.where(np.isfinite(values) & (values > 0.0), values, np.nan)


def no_zeros(values: Floats) -> Floats:
    """Return absolute values; NaN for zero, which a logarithmic axis cannot show."""
    return np.where(values == 0.0, np.nan, np.abs(values))


def spans_decades(values: Floats, ratio: float = LOG_RATIO) -> bool:
    """Return whether values are positive and spread so much that a logarithmic axis shows them better."""
    known = finite(values)
    return bool(known.min() > 0.0 and known.max() > ratio * known.min())


def of_level(level: int) -> str:
    """Return the group id of curves of a level, or of several levels with this as the coarsest."""
    return f"level-{level}"


def entry(text: str) -> str:
    """Return a legend entry for any name; matplotlib would leave out one that begins with an underscore."""
    return f"\N{ZERO WIDTH SPACE}{text}" if text.startswith("_") else text


def sentences(*parts: str) -> str:
    """Join the nonempty sentences of a caption."""
    return " ".join(part for part in parts if part)


def label(text: str, unit: str, exponent: int = 0) -> str:
    """Write an axis label: a text, and in brackets its power of ten and unit."""
    scaled = [power(exponent)] if exponent else []
    units = [unit] if unit and unit != "1" else []
    return f"{text} [{' '.join(scaled + units)}]" if scaled or units else text


def scale(*series: Floats) -> int:
    """Return the exponent of ten for the label of an axis; 0 if plain numbers are readable."""
    largest = float(np.abs(finite(*series)).max(initial=0.0))
    exponent = math.floor(math.log10(largest)) if largest else 0
    return 0 if -1 <= exponent <= 3 else exponent


def label_values(ax: Axes, text: str, unit: str) -> None:
    """Label a vertical axis with final limits; a power of ten, which would stand over the title, is in the label."""
    exponent = scale(np.array(ax.get_ylim())) if ax.get_yscale() == "linear" else 0
    if exponent:
        ax.yaxis.set_major_formatter(lambda x, _: number(x / 10.0**exponent, "value"))
    ax.set_ylabel(label(text, unit, exponent))


def limits(*series: Floats, margin: float = 0.08) -> tuple[float, float]:
    """Return linear axis limits that hold all finite values, with a positive range."""
    values = finite(*series)
    if not values.size:
        return -1.0, 1.0
    low, high = float(values.min()), float(values.max())
    room = margin * (high - low) or margin * abs(high) or 1.0
    return low - room, high + room


def log_limits(*series: Floats, margin: float = 0.08) -> tuple[float, float]:
    """Return limits of a logarithmic axis that hold all finite positive values."""
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = limits(*(np.log10(part[part > 0.0]) for part in series), margin=margin)
    # clipped to the limits of all axes before the powers could overflow
    return 10.0 ** max(low, math.log10(LEAST)), 10.0 ** min(high, math.log10(MOST))


def log_axis(ax: Axes, which: str, low: float, high: float, most: int = 7) -> None:
    """Make an axis logarithmic from `low` to `high`, with about `most` labelled ticks in Unicode."""
    low, high = _within(low, high)
    # limits first: a margin around values near the largest float would overflow
    ax.set(**{f"{which}lim": (low, high)})
    ax.set(**{f"{which}scale": "log"})
    ax.set(**{f"{which}lim": (low, high)})
    log_ticks(getattr(ax, f"{which}axis"), low, high, most)


def fit_log_axis(
    ax: Axes, which: str, *series: Floats, below: float = 0.0, least: float = 0.0, room: float = 3.0, most: int = 7
) -> bool:  # fmt: skip
    """Make an axis logarithmic over the positive finite values of some series; return whether there are any.

    `below` is the fraction of each series that may lie below the axis. Values smaller than `least` times the largest
    lie below it, too. `room` is the factor between the outermost values and the ends; about `most` ticks are labelled.
    """
    parts = [found for part in series if (found := finite(part[part > 0.0])).size]
    if parts:
        high = min(max(float(part.max()) for part in parts), LARGEST)
        low = max(min(float(np.quantile(p, below)) for p in parts), least * high, TINIEST)
        log_axis(ax, which, low / room, high * room, most)
    return bool(parts)


def log_ticks(axis: Any, low: float, high: float, most: int = 7) -> None:
    """Put ticks from `low` to `high` on a logarithmic axis (or colour bar).

    They are powers of ten; over few decades multiples by 1, 2 and 5; if these are fewer than two, round numbers.
    """
    from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

    low, high = _within(low, high)
    bottom, top = math.floor(math.log10(low)), math.ceil(math.log10(high))
    wide = math.log10(high) - math.log10(low)
    step = next(k for k in DECADES if most * k >= wide)
    ticks = [10.0**e for e in range(bottom, top + 1) if e % step == 0]
    if wide < 2.2 * max(most, 5) / 7:
        ticks = [m * 10.0**e for e in range(bottom, top + 1) for m in (1, 2, 5)]
    shown = [x for x in ticks if low <= x <= high]
    if len(shown) < 2:
        shown = list(MaxNLocator(3, steps=[1, 2, 5, 10]).tick_values(low, high))
    axis.set_major_locator(FixedLocator(shown))
    axis.set_minor_locator(NullLocator())
    plain = low >= 0.005 and high <= 2000
    axis.set_major_formatter(
        FuncFormatter(lambda x, _: f"{x:.{TICK_DIGITS}g}" if plain else log_tick(x))
    )


def _within(low: float, high: float) -> tuple[float, float]:
    """Clip the ends of a logarithmic axis to the range that floats can show."""
    low = min(max(low, LEAST), MOST / 10.0)
    return low, min(max(high, 10.0 * low if high <= low else high), MOST)


def log_tick(value: float) -> str:
    """Write a tick of a logarithmic axis as a power of ten, with as many digits as it needs."""
    if value <= 0:
        return ""
    mantissa, exponent = f"{value:.{TICK_DIGITS - 1}e}".split("e")
    digits = f"{float(mantissa):.{TICK_DIGITS}g}"
    return power(int(exponent)) if digits == "1" else f"{digits}·{power(int(exponent))}"


def beside(ax: Axes, **options: Any) -> None:
    """Put the legend to the right of the axes, where it hides no curve."""
    if ax.get_legend_handles_labels()[0]:
        ax.legend(**BESIDE, **options)
    elif not ax.texts:
        ax.text(0.5, 0.5, "no finite value", transform=ax.transAxes, ha="center", color=GREY)


def remark(ax: Axes, text: str) -> None:
    """Say within a panel why it is empty."""
    ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", color=GREY)
