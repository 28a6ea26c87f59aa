"""What was found of every member along one swept parameter: order, error and verdict; period and amplitude."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import SEVERITY, TYPICAL_NORM
from vibsim.report import finest_level, frame, style
from vibsim.report.choice import position, promises
from vibsim.report.data import due, exact_periods, flags, norm_unit, whole
from vibsim.report.figures import separatrix
from vibsim.report.figures.panels import explosive, stacked
from vibsim.report.finest_level import Measured
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Along
from vibsim.report.text import words
from vibsim.report.types import Axes, Experiment

MOST_MARKERS = 60  # most members that get a marker each; above, a line says it better
DEEP = 1e-16  # errors below this part of the largest leave the frame
LOG_RATIO = 10.0
"""Where some amplitudes leave the frame, others that many times a usual one are drawn on a logarithmic scale."""


def orders(experiment: Experiment, record: Record, along: Along, quantity: str) -> Picture:
    """Draw the stated order of every member and its error, with their intervals, and the verdict as a strip below."""
    schemes, letter = record.words("scheme"), words.symbol(quantity)
    row = 0.17 if style.crowded(record) else 0.3
    axes = stacked([2.3, 1.9, row * max(2, len(schemes))])
    _draw_orders(axes[0], experiment, record, along, quantity)
    kind, leaves = _draw_errors(axes[1], record, along, quantity)
    _draw_verdicts(axes[2], along, flags(record, f"{quantity}_status"), schemes)
    marked = _finish(axes, experiment, along)
    error = (
        "the true one (dots), and what two levels alone say of it (lines, with the interval of the order)"
        if kind == "true"
        else "estimated from two levels, with the interval of the order"
    )
    return Picture(
        name=f"sweep_order_{quantity}",
        title=f"Order and error of every member: {letter}",
        caption="Top: the order that each member's levels state; a grey band is an order that is "
        f"{due(record, quantity)}, with the tolerance of its check. Then the error of the finest level"
        f"{':' if kind == 'true' else ','} {error}. Bottom: what can be said of it. Members "
        f"that fail or stay open are worth a look one by one.{marked}{f' {frame.LEAVING}' if leaves else ''}",
        alt=f"Stated order of {words.name(quantity)}, its error and its verdict against the swept parameter",
        figure=axes[0].get_figure(root=True),
    )


def period(experiment: Experiment, record: Record, along: Along) -> Picture | None:
    """Draw the period of every member and its relative error; None where no member has a period."""
    found, exact = (
        finest_level.measured(record, "period", position(experiment)),
        exact_periods(record),
    )
    if not np.isfinite(found.value).any():
        return None
    is_known = bool(np.isfinite(exact).any())
    axes = stacked([2.4, 2.4] if is_known else [2.6])
    _draw_numbers(axes[0], record, along, found, exact if is_known else None)
    if is_known:
        _draw_period_errors(axes[1], record, along, found)
    marked = _finish(axes, experiment, along)
    several = bool(whole(record, "pair"))
    bars = ", with its error bar from the two finest levels" if several else ""
    caption = f"Top: the measured period{bars}, and the exact one. Bottom: its relative error"
    caption += (
        "; from level to level it should fall by the same factor, so lines of successive levels are evenly spaced, "
        "and where they are not the coarse levels are too coarse. Grey: the error that the two finest levels predict "
        "for the finest without knowing the exact period."
        if several
        else "."
    )
    return Picture(
        name="period",
        title="Period over the swept parameter",
        caption=(caption if is_known else f"The measured period on the finest level{bars}.")
        + marked,
        alt="Period and its relative error against the swept parameter",
        figure=axes[0].get_figure(root=True),
    )


def amplitude(experiment: Experiment, record: Record, along: Along) -> Picture | None:
    """Draw the amplitude of every member with its error bar; None where no member swings."""
    found = finest_level.measured(record, "amplitude", position(experiment))
    if not np.isfinite(found.value).any():
        return None
    size = frame.sizes(record, position(experiment))
    bounded = frame.is_bounded(found.value, size)
    if not bounded.any():
        bounded = np.isfinite(found.value)
    # what is beyond the frame has no bar across it
    barred = bounded & frame.is_bounded(found.error, size)
    value, error = np.where(bounded, found.value, np.nan), np.where(barred, found.error, np.nan)
    several = bool(whole(record, "pair"))
    axes = stacked([2.0, 1.5] if several else [3.7 if style.crowded(record) else 2.2])
    for ax in axes:
        # amplitudes that hardly differ need long numbers
        ax.yaxis.set_label_coords(-0.115, 0.5)
    _draw_numbers(axes[0], record, along, replace(found, error=error), None)
    usual = style.finite(value)
    is_wide = usual.size > 0 and float(usual.max()) > LOG_RATIO * float(np.median(usual))
    if explosive([value.ravel()]) or (is_wide and explosive([found.value.ravel()])):
        # a motion that a scheme damps away would fill the frame with its decades
        least = np.nanmin(np.append(size, np.nanmax(value))) / frame.UNBOUNDED
        style.fit_log_axis(axes[0], "y", np.maximum(value, least), room=2.0)
    else:
        axes[0].set_ylim(*_room(replace(found, value=value, error=error), None))
    leaves = _mark_members(axes[0], along, found.value)
    if several:
        _draw_error_bars(axes[1], record, along, found, error)
        leaves |= _mark_members(axes[1], along, found.error)
    below = " Bottom: its error, estimated from the two finest levels." if several else ""
    if several and experiment.model.definition.turn is not None:
        below += " Members that go over the top have no amplitude."
    marked = _finish(axes, experiment, along)
    return Picture(
        name="amplitude",
        title="Amplitude over the swept parameter",
        caption=f"{'Top: half' if several else 'Half'} the height between the last peak and the last trough, on the "
        f"finest level.{below}{marked}{f' {frame.LEAVING}' if leaves else ''}",
        alt=f"Amplitude{' and its estimated error' if several else ''} against the swept parameter",
        figure=axes[0].get_figure(root=True),
    )


def _finish(axes: list[Axes], experiment: Experiment, along: Along) -> str:
    """Give the common axis its scale, label and separatrix; return the sentence on the latter."""
    key = along.key
    if key.is_log:
        room = (key.distinct[-1] / key.distinct[0]) ** 0.03
        style.log_axis(axes[-1], "x", float(key.distinct[0] / room), float(key.distinct[-1] * room))
    if key.words:
        axes[-1].set_xticks(key.distinct, key.words)
    axes[-1].set_xlabel(key.label)
    is_alone = len(along.lines) == 1 and not along.follows
    found = separatrix.on_line(experiment, key).tolist() if is_alone else []
    for ax in axes:
        for x in found:
            ax.axvline(x, color="black", linestyle=(0, (1, 2)), linewidth=1.0, zorder=1)
    return " Dotted: the separatrix, where the exact period is infinite." if found else ""


def _draw_orders(
    ax: Axes, experiment: Experiment, record: Record, along: Along, quantity: str
) -> None:
    promised = promises(experiment, record, quantity)
    for order, tolerance in promised:
        ax.axhspan(order - tolerance, order + tolerance, **style.ALLOWED)
        text = f"{due(record, quantity)}, {order:g} ± {tolerance:g}"
        ax.axhline(order, **style.REFERENCE, label=text)
    value, low, high = finest_level.orders(record, quantity)
    for s, scheme in enumerate(record.words("scheme")):
        look = style.look(s) | {"linestyle": "-", "markersize": 4, "linewidth": 0.8}
        for k, (_, members) in enumerate(along.lines):
            x = along.key.values[members]
            _interval(ax, x, low[s, members], high[s, members], look["color"])
            _line(ax, x, value[s, members], label="" if k else style.entry(scheme), **look)
    if promised:
        least, most = promised[0][0], promised[-1][0]
        bottom, top = style.limits(value, np.array([least - 0.25, most + 0.25]))
        ax.set_ylim(max(bottom, least - 3), min(top, most + 2))
    ax.set_ylabel(f"order of {words.symbol(quantity)} ({TYPICAL_NORM})")
    ax.set_title("Stated order with its interval")
    style.beside(ax, **({"fontsize": 7.5} if style.crowded(record) else {}))


def _draw_errors(ax: Axes, record: Record, along: Along, quantity: str) -> tuple[str, bool]:
    """Draw the error of the finest level; return which one is known, and whether any leaves the frame."""
    found, schemes = finest_level.error(record, quantity), record.words("scheme")
    size = frame.sizes(record, quantity)
    bounded = [
        np.where(frame.is_bounded(part, size), part, np.nan)
        for part in (found.true, found.estimate)
    ]
    # what is beyond the frame has no bar across it
    low, high = (
        np.where(np.isfinite(bounded[1]), style.no_zeros(part), np.nan)
        for part in (found.low, found.high)
    )
    true, estimate = style.no_zeros(found.true), style.no_zeros(found.estimate)
    for s, scheme in enumerate(schemes):
        look = style.look(s)
        several = f", {scheme}" if len(schemes) > 1 else ""
        for k, (_, members) in enumerate(along.lines):
            x, here = along.key.values[members], (s, members)
            _interval(ax, x, low[here], high[here], look["color"])
            text = "" if k else f"estimated{several}"
            _line(ax, x, estimate[here], color=look["color"], linewidth=1.0, label=text)
            if np.isfinite(true[here]).any():
                text = "" if k else f"true{several}"
                dots = look | {"linestyle": "none", "markersize": 4, "markerfacecolor": "white"}
                _line(ax, x, true[here], label=text, **dots)
    leaves = False
    # where nothing is bounded all of it makes the range
    for values in (bounded, [found.true, found.estimate]):
        if style.fit_log_axis(ax, "y", np.concatenate(values, axis=None), below=0.005, least=DEEP):
            leaves = _mark_members(ax, along, found.best)
            break
    ax.set_ylabel(style.label(f"error of {words.symbol(quantity)}", norm_unit(record, quantity)))
    ax.set_title(f"Error on level {whole(record, 'level')[-1]} ({TYPICAL_NORM} norm)")
    if not style.crowded(record):
        style.beside(ax)
    return found.kind, leaves


def _draw_verdicts(ax: Axes, along: Along, status: NDArray[Any], schemes: list[str]) -> None:
    """Draw one row per scheme; every verdict has a colour, a marker and a height of its own."""
    order = np.argsort(along.key.values, kind="stable")
    x, many = along.key.values[order], len(schemes) > style.MANY
    for i, word in enumerate(SEVERITY):
        xs, ys = [np.empty(0)], [np.empty(0)]
        for s in range(len(schemes)):
            found = x[status[s][order] == word]
            thinned = style.thin(found, np.full(found.size, s + 0.17 * i))
            xs, ys = [*xs, thinned[0]], [*ys, thinned[1]]
        ax.plot(
            np.concatenate(xs), np.concatenate(ys), linestyle="none", marker=style.STATUS_MARKERS[word],
            markersize=3.5 if many else 5, color=style.STATUS_COLOURS[word], markeredgecolor="black",
            markeredgewidth=0.3, label=f"{word} ({int((status == word).sum())})", clip_on=False,
        )  # fmt: skip
    ax.set_yticks(np.arange(len(schemes)) + 0.17, schemes, fontsize=8.0 if many else 8.5)
    ax.set_ylim(-0.3, len(schemes) - 0.3)
    ax.grid(visible=False, axis="y")
    if not many:
        style.beside(ax, handlelength=1.2)
        return
    # there is room for many names at the right only, and for the legend then above
    ax.tick_params(axis="y", left=False, labelleft=False, labelright=True)
    place: Any = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.1}
    ax.legend(ncols=3, fontsize=8, handlelength=1.2, **place)


def _draw_numbers(
    ax: Axes, record: Record, along: Along, found: Measured, exact: Floats | None
) -> None:
    """Draw a number of the finest level with its error bars, and the exact number where it is known."""
    schemes, level = record.words("scheme"), whole(record, "level")[-1]
    for k, (name, members) in enumerate(along.lines):
        x = along.key.values[members]
        if exact is not None:
            values = np.where(np.isfinite(exact), exact, np.nan)[members]
            _line(ax, x, values, color="black", linewidth=1.0, label="" if k else "exact", zorder=1)
        for s, scheme in enumerate(schemes):
            value, error = found.value[s, members], found.error[s, members]
            label = _text(scheme if len(schemes) > 1 else "", name) or f"level {level}"
            look = _mark(s, s + k, len(schemes))
            _interval(ax, x, value - error, value + error, look["color"])
            dashes = "none" if x.size <= MOST_MARKERS else "-"
            _line(ax, x, value, linestyle=dashes, label=label, **look)
    ax.set_ylim(*_room(found, exact))
    ax.set_ylabel(style.label(found.name, found.unit))
    ax.set_title(f"{found.name.capitalize()}, level {level}")
    style.beside(ax, fontsize=7.5 if style.crowded(record) else 8)


def _room(found: Measured, exact: Floats | None) -> tuple[float, float]:
    """Return limits that hold all values and, as far as they do not exceed the values' own spread, the error bars."""
    values = style.finite(found.value)
    most = float(np.ptp(values)) or 0.02 * float(np.max(np.abs(values)))
    error = np.clip(np.nan_to_num(found.error), 0.0, most)
    shown = [found.value - error, found.value + error]
    return style.limits(*(shown if exact is None else [*shown, exact]))


def _draw_period_errors(ax: Axes, record: Record, along: Along, found: Measured) -> None:
    levels, schemes = whole(record, "level"), record.words("scheme")
    several = len(along.lines) > 1 or style.crowded(record)
    count = 1 if several else 6 if len(schemes) == 1 else 3
    spaced = np.linspace(len(levels) - 1, 0, min(len(levels), count)).round().astype(int)
    error = {i: finest_level.period_error(record, i) for i in np.unique(spaced)[::-1].tolist()}
    with np.errstate(invalid="ignore", divide="ignore"):
        predicted = style.no_zeros(found.error / found.value)
    for k, (name, members) in enumerate(along.lines):
        x = along.key.values[members]
        for s, scheme in enumerate(schemes):
            text = "" if s or k else f"estimated, level {levels[-1]}"
            grey: dict[str, Any] = {"color": "#9a9a9a", "linewidth": 4.0, "alpha": 0.6, "zorder": 1}
            _line(ax, x, predicted[s, members], label=text, **grey)
            for m, (i, of_level) in enumerate(error.items()):
                colour = k + s if several else m
                label = _text(scheme if len(schemes) > 1 else "", name, f"level {levels[i]}")
                look = _mark(s, colour, len(schemes)) | {"linewidth": 1.2}
                look |= {"linestyle": style.look(colour)["linestyle"]}
                _line(ax, x, style.no_zeros(of_level[s, members]), label=label, **look)
    style.fit_log_axis(ax, "y", *error.values(), room=2.0)
    ax.set(ylabel="|period / exact − 1|", title="Relative error of the period")
    if not style.crowded(record):
        style.beside(ax, fontsize=8)


def _draw_error_bars(ax: Axes, record: Record, along: Along, found: Measured, held: Floats) -> None:
    """Draw the estimated error of a number of the finest level, in a frame that holds the errors `held`."""
    for s, scheme in enumerate(record.words("scheme")):
        for k, (_, members) in enumerate(along.lines):
            look = style.look(s if len(along.lines) == 1 else s + k) | {"markersize": 4}
            error, text = style.no_zeros(found.error[s, members]), "" if k else style.entry(scheme)
            _line(ax, along.key.values[members], error, **look, label=text)
    # of a motion that is damped away the error falls for ever
    shown = held if np.isfinite(held).any() else found.error
    style.fit_log_axis(ax, "y", shown, least=DEEP, room=2.0)
    ax.set_ylabel(style.label("estimated error", found.unit))
    ax.set_title(f"Error bar of the {found.name}")


def _mark_members(ax: Axes, along: Along, values: Floats) -> bool:
    """Mark at the upper edge what grows out of the frame, of values of the shape (scheme, case); say whether any does.

    Of few members each is marked, of many the first of every stretch.
    """
    high, leaves = ax.get_ylim()[1], False
    for s in range(values.shape[0]):
        for _, members in along.lines:
            x, y = along.key.values[members], values[s, members]
            grown = np.where(y > high, y, np.where(np.isfinite(y), high, np.nan))
            each = x.size <= MOST_MARKERS
            leaves |= frame.mark_leaving(ax, x, grown, color=style.look(s)["color"], each=each)
    return leaves


def _line(ax: Axes, x: Floats, y: Floats, **look: Any) -> None:
    """Draw a quantity over members in the order of `x`, thinned; markers only while they are few."""
    if x.size > MOST_MARKERS:
        look["marker"] = "," if look.get("linestyle") == "none" else ""
    ax.plot(*style.thin(x, y), **look)


def _interval(ax: Axes, x: Floats, low: Floats, high: Floats, colour: str) -> None:
    """Draw error bars: one for each of few members, else a band between two lines."""
    if x.size <= MOST_MARKERS:
        ax.vlines(x, low, high, color=colour, linewidth=2.4, alpha=0.4)
        return
    for bound in (low, high):
        ax.plot(*style.thin(x, bound), color=colour, linewidth=0.6, alpha=0.6)


def _text(*parts: str) -> str:
    return style.entry(", ".join(part for part in parts if part))


def _mark(scheme: int, colour: int, count: int) -> dict[str, Any]:
    """Return a marker of a scheme; of several the first is large and hollow, so that all stay visible."""
    look = {"marker": style.look(scheme)["marker"], "color": style.look(colour)["color"]}
    is_hollow = count > 1 and scheme == 0
    return look | (
        {"markerfacecolor": "none", "markersize": 8} if is_hollow else {"markersize": 4.5}
    )
