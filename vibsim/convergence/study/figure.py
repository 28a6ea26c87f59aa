"""The figure of a ladder: errors and differences against the step size, and the rescaled differences of a series."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.convergence.study.notation import number
from vibsim.core.array_types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vibsim.convergence.study.verdict import LadderVerdict

WIDTH, HEIGHT = 9.0, 3.8
"""Size of the figure [inch]."""
ERROR, DIFFERENCE = "#0072B2", "#D55E00"
"""Colours of Okabe and Ito (2008), for the colour-blind."""
CURVES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
DASHES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1.2, 1.6)), (0, (6, 2, 1.2, 2)), (0, (9, 2)))
FEW_DECADES = 1.5
"""An axis up to this length has minor ticks between powers of ten."""
LEAST, MOST = 1e-290, 1e290
"""Smallest and largest values on a logarithmic axis."""


def convergence_figure(verdict: LadderVerdict) -> Figure:
    """Return the figure of a verdict, with a second panel for a series."""
    from matplotlib.figure import Figure

    has_curves = shows_curves(verdict)
    figure = Figure(figsize=(WIDTH, HEIGHT), layout="constrained")
    panels = figure.subplots(1, 2 if has_curves else 1, squeeze=False)[0]
    _sizes(panels[0], verdict)
    if has_curves:
        _curves(panels[1], verdict)
    return figure


def shows_curves(verdict: LadderVerdict) -> bool:
    """Say whether the verdict is on a series, whose differences can be drawn."""
    return len(verdict.dims) == 1 and len(verdict.values) > 1 and verdict.values.shape[1] > 1


def slope(verdict: LadderVerdict) -> float | None:
    """Return the order of the reference line: the expected one, or else the observed one."""
    order = verdict.expected or verdict.at_least or verdict.order
    return order if order and order > 0.0 else None


def _sizes(ax: Axes, verdict: LadderVerdict) -> None:
    """Draw errors and differences against the step size."""
    h = np.array([level.h for level in verdict.levels])
    word = "error" if verdict.is_exact_known else "estimated error"
    norm = "" if verdict.is_number else ", root mean square"
    curves = []
    for entries, text, colour, marker in (
        ([level.error for level in verdict.levels], f"{word}{norm}", ERROR, "o"),
        (
            [level.difference for level in verdict.levels],
            f"difference to the next level{norm}",
            DIFFERENCE,
            "s",
        ),
    ):
        sizes = np.abs(np.array(entries, float))
        sizes = np.where((sizes > LEAST) & (sizes < MOST), sizes, np.nan)
        if np.isfinite(sizes).any():
            ax.plot(h, sizes, color=colour, marker=marker, markersize=5, label=text)
            curves.append(sizes)
    ax.set_xlabel(verdict.size_name)
    ax.set_title("Error and difference against the step size", fontsize="medium", loc="left")
    if not curves:
        ax.text(0.5, 0.5, "nothing to draw", transform=ax.transAxes, ha="center", va="center")
        return
    ax.set_xscale("log")
    ax.set_yscale("log")
    # the reference line may leave the frame
    ax.set_ylim(*ax.get_ylim())
    _reference(ax, verdict, h, curves[0])
    _plain_ticks(ax, h)
    ax.legend(fontsize="small", loc="best")


def _reference(ax: Axes, verdict: LadderVerdict, h: Floats, sizes: Floats) -> None:
    """Draw the slope of an order through the finest point."""
    order = slope(verdict)
    known = np.flatnonzero(np.isfinite(sizes))
    if order is None or len(known) < 2:
        return
    last = known[-1]
    with np.errstate(over="ignore", under="ignore"):
        line = 0.6 * sizes[last] * (h / h[last]) ** order
    line = np.where((line > LEAST) & (line < MOST), line, np.nan)
    word = "expected" if verdict.expected or verdict.at_least else "observed"
    ax.plot(
        h,
        line,
        color="black",
        linestyle=(0, (4, 3)),
        linewidth=1.0,
        label=f"slope {order:.3g} ({word})",
    )


def _plain_ticks(ax: Axes, h: Floats) -> None:
    """Label the step sizes themselves, and powers of ten as plain text."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator

    ticks = [h[-1]]
    for size in h[::-1]:
        # skip labels that would overlap
        if np.log10(size / ticks[-1]) > 0.12 * np.log10(h[0] / h[-1]):
            ticks.append(size)
    ax.xaxis.set_major_locator(FixedLocator(ticks))
    ax.xaxis.set_minor_locator(NullLocator())
    plain = FuncFormatter(lambda x, _: number(x, 3))
    ax.xaxis.set_major_formatter(plain)
    ax.yaxis.set_major_formatter(plain)
    low, high = np.log10(ax.get_ylim())
    if high - low > FEW_DECADES:
        ax.yaxis.set_minor_locator(NullLocator())
    else:
        ax.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
        ax.yaxis.set_minor_formatter(plain)


def _curves(ax: Axes, verdict: LadderVerdict) -> None:
    """Draw the differences of successive levels, each rescaled to its estimate of the error of the finest level."""
    dim = verdict.dims[0]
    h = np.array([level.h for level in verdict.levels])
    count = verdict.values.shape[1]
    x = np.asarray(verdict.coords.get(dim, np.arange(count)))
    is_numeric = x.dtype.kind in "fiu"
    order = slope(verdict) or 1.0
    for k in range(len(h) - 1):
        with np.errstate(all="ignore"):
            factor = 1.0 / ((h[k] / h[-1]) ** order - (h[k + 1] / h[-1]) ** order)
            curve = factor * (verdict.values[k] - verdict.values[k + 1])
        curve = np.where(np.abs(curve) < MOST, curve, np.nan)
        style = {"color": CURVES[k % len(CURVES)], "linestyle": DASHES[k % len(DASHES)]}
        label = f"{verdict.size_name} = {number(float(h[k]), 3)} and {number(float(h[k + 1]), 3)}"
        ax.plot(x if is_numeric else np.arange(count), curve, linewidth=1.3, label=label, **style)
    ax.yaxis.set_major_formatter(lambda value, _: number(value, 3))
    ax.set_xlabel(dim if dim in verdict.coords and is_numeric else "point")
    ax.set_title(f"Differences, rescaled with order {order:.3g}", fontsize="medium", loc="left")
    ax.legend(fontsize="small")
