"""Local periods and amplitudes against the number of the peak, and the phase error of every peak.

Source: vibration text, section 3.5 (figure 2) and exercise 2. The m-th local period is the time from the m-th peak to
the next one, a local amplitude half the height from a peak to the following trough.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.report import choice, frame, style
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.figures.panels import move_label_left, note, stacked
from vibsim.report.style import Picture
from vibsim.report.types import Axes

FEWEST_PEAKS = 3  # that show how a period changes
MOST_CURVES = 6  # more would lie on one another
MOST_MARKERS = 40  # numbers of one curve up to which each has a marker
MARKED = 60  # the same of local frequencies
MOSTLY = 0.5
"""If less than this fraction of the curves stays below `CUT_OFF` for two peaks, the scale is logarithmic."""
CUT_OFF = 10.0  # amplitudes and periods beyond this multiple of the exact one are cut off

Run = tuple[str, Member, int]  # a curve: label, scheme and member, position of the level


def local(record: Results, shown: list[Member], peaks: int = 2) -> Picture | None:
    """Draw local periods, amplitudes and the phase error of one member; None with fewer than `peaks` peaks."""
    runs = runs_of(record, shown, peaks)
    if not runs:
        return None
    axes, case = stacked([2.1, 2.1, 2.1]), shown[0].case
    exact, size = float(record.exact_periods[case]), exact_amplitude(record, case)
    start = first_peak(record, case, exact)
    pairs = zip(runs, looks_of(runs), strict=True)
    by_run = [_draw(axes, record, run, look, exact, start) for run, look in pairs]
    drawn = list(zip(*by_run, strict=True))
    for ax, value in zip(axes, (exact, size, 0.0), strict=True):
        if math.isfinite(value):
            ax.axhline(value, label="exact" if ax is axes[0] else "", **style.REFERENCE)
    leaves = _ranges(axes, drawn, (exact, size, math.nan))
    time, measure = record.time_unit, record.unit(f"{record.model.position}_finest")
    rows = (
        ("Local period", "local period", time),
        ("Local amplitude", "local amplitude", measure),
        ("Phase error of the peaks", "peak early by", time),
    )
    for ax, lines, (title, text, unit) in zip(axes, drawn, rows, strict=True):
        move_label_left(ax)
        ax.set(ylabel=style.label(text, unit), title=title)
        _name_coincident(ax, lines, [label for label, _, _ in runs])
    axes[2].set_xlabel("number of the peak")
    style.beside(axes[0], fontsize=8)
    reference = "its exact time" if math.isfinite(start) else "its time after the first peak"
    return Picture(
        name=f"extrema_{case}",
        title="Local periods and amplitudes, and the phase error from peak to peak",
        caption="Lines with markers: peaks interpolated by a parabola; faint circles: from grid points alone. Dashed: "
        f"exact. Bottom: how much earlier than {reference} each peak comes; straight: the same in every period. "
        "Wide and pale: a curve with which others coincide." + f" {frame.LEAVING}" * leaves,
        alt="Local period, local amplitude and phase error against the number of the peak",
        figure=axes[0].get_figure(root=True),
    )


def runs_of(record: Results, members: list[Member], peaks: int = 2) -> list[Run]:
    """Choose the curves of the first member that have at least `peaks` peaks.

    One or two schemes are drawn on several levels, more schemes on the coarsest level.
    """
    if "peak_time" not in record:
        return []
    members = [member for member in members if member.case == members[0].case]
    levels = record.levels
    count = max(1, min(len(levels), 4, MOST_CURVES // max(1, len(members))))
    runs = []
    for member in members[:MOST_CURVES]:
        for i in range(count):
            if np.isfinite(record.at("peak_time", member, level=i)).sum() >= peaks:
                scheme = member.scheme_name if len(members) > 1 else ""
                label = ", ".join(filter(None, [scheme, f"level {levels[i]}" if count > 1 else ""]))
                runs.append((label or f"level {levels[i]}", member, i))
    return runs


def looks_of(runs: list[Run]) -> list[dict[str, Any]]:
    """Return the look of each run; with several schemes, colour is the scheme, dashes and marker are the level."""
    levels = sorted({level for _, _, level in runs})
    if len({member.scheme for _, member, _ in runs}) == 1:
        return [style.look(k) for k in range(len(runs))]
    looks = []
    for _, member, level in runs:
        k, look = levels.index(level), style.look(member.scheme)
        level_look = {"linestyle": style.DASHES[k], "marker": style.MARKERS[k]}
        looks.append(look | level_look if len(levels) > 1 else look)
    return looks


def _draw(
    axes: list[Axes], record: Results, run: Run, look: dict[str, Any], exact: float, start: float
) -> list[Any]:
    """Draw a run in the three panels and return its lines."""
    label, member, level = run
    time, grid, amplitude = _peaks(record, member, level)
    number = np.arange(1, time.size + 1)
    marker = look["marker"] if number.size <= MOST_MARKERS else ""
    line = look | {"linewidth": 1.1, "markersize": 4, "marker": marker}
    faint: dict[str, Any] = {"color": look["color"], "linestyle": "none", "marker": "o"}
    faint |= {"markerfacecolor": "none", "alpha": 0.45, "markersize": 6.5, "zorder": 1.5}
    axes[0].plot(number[:-1], np.diff(grid), **faint)
    offset = time[0] - exact if math.isnan(start) else start - exact
    return [
        *axes[0].plot(number[:-1], np.diff(time), label=style.entry(label), **line),
        *axes[1].plot(number, amplitude, **line),
        *axes[2].plot(number, offset + number * exact - time, **line),
    ]


def _name_coincident(ax: Axes, lines: tuple[Any, ...], labels: list[str]) -> None:
    """Name the coincident curves of a panel beside it, and draw the first of them wide and pale beneath."""
    low, high = ax.get_ylim()
    curves = [np.where((y >= low) & (y <= high), y, np.nan) for y in map(_heights_of, lines)]
    has_legend = not str(lines[0].get_label()).startswith("_")
    texts: list[tuple[Any, str]] = []
    for i, first in enumerate(frame.same_as(curves, high - low)):
        if first is not None:
            lines[first].set(linewidth=3.4, alpha=0.5)
            lines[i].set(zorder=3.0 + 0.01 * i)
            texts.append((lines[i], style.entry(f"{labels[i]}:\n  same as {labels[first]}")))
    if has_legend:
        # of all panels
        for line, text in texts:
            line.set_label(text)
    elif texts:
        ax.legend(*map(list, zip(*texts, strict=True)), **style.BESIDE, fontsize=7.5)


def _heights_of(line: Any) -> Floats:
    return np.asarray(line.get_ydata(), dtype=np.float64)


def _peaks(record: Results, member: Member, level: int) -> tuple[Floats, Floats, Floats]:
    """Return the interpolated times of the peaks, their grid points in time, and the amplitudes."""
    names = ("peak_time", "peak_time_grid", "peak", "trough_time", "trough")
    time, grid, peak, *troughs = (record.at(name, member, level=level) for name in names)
    keep = np.isfinite(time)
    return time[keep], grid[keep], heights(time[keep], peak[keep], *troughs)


def heights(time: Floats, peak: Floats, trough_time: Floats, trough: Floats) -> Floats:
    """Return half the height from every peak to the following, else to the preceding trough; NaN without troughs."""
    is_known = np.isfinite(trough_time)
    if not is_known.any():
        return np.full(peak.shape, np.nan)
    after = np.minimum(np.searchsorted(trough_time[is_known], time), is_known.sum() - 1)
    return np.asarray(0.5 * (peak - trough[is_known][after]))


def first_peak(record: Results, case: int, period: float) -> float:
    """Return the time of the first exact peak after the start; NaN if no formula gives it.

    It is known for linear models, and for any motion that starts at rest, as one period or half of one.
    """
    u, v = _start(record, case)
    if not math.isfinite(period) or u == v == 0.0:
        return math.nan
    if v == 0.0:
        return period if u > 0.0 else period / 2.0
    if not record.model.linear:
        return math.nan
    angle = math.atan2(v * period / math.tau, u) % math.tau
    return angle / math.tau * period


def _start(record: Results, case: int) -> tuple[float, float]:
    """Return the initial position and velocity of a member."""
    position = Ladder(record, record.model.position, Member(0, case, ""))
    return float(position.finest[0]), float(position.of(record.model.velocity).finest[0])


def exact_amplitude(record: Results, case: int) -> float:
    """Return the exact amplitude, known for conservative models that are linear or start at rest; else NaN."""
    if not record.model.conservative:
        return math.nan
    u, v = _start(record, case)
    if v == 0.0:
        return abs(u)
    linear = record.model.linear
    return math.hypot(u, v / record.natural_frequency(case)) if linear else math.nan


def _ranges(
    axes: list[Axes], drawn: list[tuple[Any, ...]], sizes: tuple[float, float, float]
) -> bool:
    """Fit the axes to the curves, cut off far beyond the exact number; return whether any is marked as leaving."""
    from matplotlib.ticker import MaxNLocator

    leaves = False
    for ax, lines, value in zip(axes, drawn, sizes, strict=True):
        most = CUT_OFF * abs(value)
        values = style.finite(*map(_heights_of, ax.lines))
        bounded = values[~(np.abs(values) > most)]
        if bounded.size in (0, values.size):
            ax.set_ylim(*style.limits(values))
            continue
        # most curves must be visible at two peaks or more
        is_readable = [int(np.sum(np.abs(_heights_of(line)) <= most)) > 1 for line in lines]
        if sum(is_readable) < MOSTLY * len(is_readable):
            _draw_logarithmic(ax, lines, abs(value))
        else:
            ax.set_ylim(*style.limits(bounded))
            note(ax, f"cut off beyond {CUT_OFF:g} times the exact one")
        for line in lines:
            x = np.asarray(line.get_xdata(), dtype=np.float64)
            leaves |= frame.mark_leaving(ax, x, _heights_of(line), color=line.get_color())
    axes[0].xaxis.set_major_locator(MaxNLocator(nbins=10, integer=True))
    return leaves


def _draw_logarithmic(ax: Axes, lines: tuple[Any, ...], size: float) -> None:
    """Show growing numbers on a logarithmic scale, within `frame.UNBOUNDED` of their `size`."""
    for line in lines:
        line.set_ydata(style.no_zeros(_heights_of(line)))
    values = np.concatenate([*map(_heights_of, lines), [size]])
    shown = values[(values <= frame.UNBOUNDED * size) & (values >= size / frame.UNBOUNDED)]
    style.log_axis(ax, "y", float(shown.min()) / 2.0, 2.0 * float(shown.max()))
    note(ax, "size, logarithmic")


def frequency(record: Results) -> Picture | None:
    """Draw local angular frequency and amplitude against the number of the peak; None with fewer than two peaks."""
    everyone = choice.with_levels(record, record.all_members)
    runs = runs_of(record, everyone)
    if not runs:
        return None
    axes, case = stacked([2.3, 2.3]), everyone[0].case
    several = len({member.scheme for _, member, _ in runs}) > 1
    step, period = record.dt(case), float(record.exact_periods[case])
    for (_, member, level), look in zip(runs, looks_of(runs), strict=True):
        t, _, amplitude = _peaks(record, member, level)
        dt = f"dt = {record.time_text(step[level])}"
        text = style.entry(f"{member.scheme_name}, {dt}" if several else dt)
        line = look | {"linewidth": 1.1, "markersize": 4, "label": text}
        line["marker"] = look["marker"] if t.size <= MARKED else ""
        for ax, values in zip(axes, (2.0 * np.pi / np.diff(t), amplitude), strict=True):
            ax.plot(np.arange(1, values.size + 1), values, **line)
    measure = record.unit(f"{record.model.position}_finest")
    rows = (
        ("angular frequency", record.radians_unit, 2.0 * math.pi / period),
        ("amplitude", measure, exact_amplitude(record, case)),
    )
    for ax, (text, unit, value) in zip(axes, rows, strict=True):
        if math.isfinite(value):
            ax.axhline(value, label="exact", **style.REFERENCE)
        ax.set_ylim(*style.limits(*map(_heights_of, ax.lines)))
        move_label_left(ax)
        ax.set(ylabel=style.label(text, unit), title=f"Local {text}")
        style.beside(ax)
    axes[1].set_xlabel("number of the peak")
    return Picture(
        "local_frequency",
        "Angular frequency and amplitude found in the solutions",
        "The frequency is 2π over the time from a peak to the next one, the amplitude half the height from a peak to "
        "the trough behind it; peaks are interpolated by a parabola. Dashed: exact.",
        "Local angular frequency and amplitude against the number of the peak, with the exact ones",
        axes[0].get_figure(root=True),
    )
