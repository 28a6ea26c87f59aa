"""Period and amplitude along one swept parameter, with the exact period and the errors beside them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.core.record import Record
from vibsim.report import finest_level, frame, style
from vibsim.report.choice import position
from vibsim.report.data import Floats, exact_periods, whole
from vibsim.report.figures.panels import explosive, figure_of, panels
from vibsim.report.figures.sweep import MARKED, finish, interval, line, mark_members
from vibsim.report.finest_level import Measured
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Along

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from vibsim.experiment import Experiment

DEEP = 1e-16
"""Errors below this part of the largest leave the frame."""
WIDE = 10.0
"""Where some amplitudes leave the frame, others that many times a usual one are drawn on a logarithmic scale."""


def period(experiment: Experiment, record: Record, along: Along) -> Picture | None:
    """Draw the period of every member and its relative error; None where no member has a period."""
    found = finest_level.period(record, position(experiment))
    if not np.isfinite(found.value).any():
        return None
    known = bool(np.isfinite(exact_periods(record)).any())
    axes = panels([2.4, 2.4] if known else [2.6])
    _draw(axes[0], record, along, found, exact_periods(record) if known else None)
    if known:
        _draw_errors(axes[1], record, along, found)
    marked = finish(axes, experiment, along)
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
        caption=(caption if known else f"The measured period on the finest level{bars}.") + marked,
        alt="Period and its relative error against the swept parameter",
        figure=figure_of(axes[0]),
    )


def amplitude(experiment: Experiment, record: Record, along: Along) -> Picture | None:
    """Draw the amplitude of every member with its error bar; None where no member swings."""
    found = finest_level.amplitude(record, position(experiment))
    if not np.isfinite(found.value).any():
        return None
    size = frame.sizes(record, position(experiment))
    bounded = frame.is_bounded(found.value, size)
    if not bounded.any():
        bounded = np.isfinite(found.value)
    # what is beyond the frame has no bar across it
    barred = bounded & frame.is_bounded(found.error, size)
    held = replace(
        found,
        value=np.where(bounded, found.value, np.nan),
        error=np.where(barred, found.error, np.nan),
    )
    several = bool(whole(record, "pair"))
    axes = panels([2.0, 1.5] if several else [3.7 if style.crowded(record) else 2.2])
    for ax in axes:
        # amplitudes that hardly differ need long numbers
        ax.yaxis.set_label_coords(-0.115, 0.5)
    _draw(axes[0], record, along, replace(found, error=held.error), None)
    if _spans(found, held):
        # a motion that a scheme damps away would fill the frame with its decades
        least = np.nanmin(np.append(size, np.nanmax(held.value))) / frame.WILD
        style.fit_log_axis(axes[0], "y", np.maximum(held.value, least), room=2.0)
    else:
        axes[0].set_ylim(*_room(held, None))
    leaves = mark_members(axes[0], along, found.value)
    if several:
        _draw_error_bars(axes[1], record, along, found, held.error)
        leaves |= mark_members(axes[1], along, found.error)
    below = " Bottom: its error, estimated from the two finest levels."
    if experiment.model.definition.turn is not None:
        below += " Members that go over the top have no amplitude."
    marked = finish(axes, experiment, along)
    return Picture(
        name="amplitude",
        title="Amplitude over the swept parameter",
        caption=f"{'Top: half' if several else 'Half'} the height between the last peak and the last trough, on the "
        f"finest level.{below if several else ''}{marked}{f' {frame.LEAVING}' if leaves else ''}",
        alt=f"Amplitude{' and its estimated error' if several else ''} against the swept parameter",
        figure=figure_of(axes[0]),
    )


def _spans(found: Measured, held: Measured) -> bool:
    """Say whether amplitudes that grow or are damped away take a logarithmic frame."""
    values = held.value[np.isfinite(held.value)]
    wide = values.size and float(values.max()) > WIDE * float(np.median(values))
    return explosive([held.value.ravel()]) or (bool(wide) and explosive([found.value.ravel()]))


def _draw_error_bars(ax: Axes, record: Record, along: Along, found: Measured, held: Floats) -> None:
    """Draw the estimated error of a number of the finest level, in a frame that holds the errors `held`."""
    for s, scheme in enumerate(record.words("scheme")):
        for k, (_, members) in enumerate(along.lines):
            error = style.no_zeros(found.error[s, members])
            look = style.look(s if len(along.lines) == 1 else s + k)
            text = "" if k else style.entry(scheme)
            line(ax, along.key.values[members], error, **look | {"markersize": 4}, label=text)
    shown = held if np.isfinite(held).any() else found.error
    # of a motion that is damped away the error falls for ever
    style.fit_log_axis(ax, "y", shown, least=DEEP, room=2.0)
    ax.set_ylabel(style.label("estimated error", found.unit))
    ax.set_title(f"Error bar of the {found.name}")


def _draw(ax: Axes, record: Record, along: Along, found: Measured, exact: Floats | None) -> None:
    """Draw a number of the finest level with its error bars, and the exact number where it is known."""
    schemes, level = record.words("scheme"), whole(record, "level")[-1]
    for k, (name, members) in enumerate(along.lines):
        x = along.key.values[members]
        if exact is not None:
            values = np.where(np.isfinite(exact), exact, np.nan)[members]
            line(ax, x, values, color="black", linewidth=1.0, label="" if k else "exact", zorder=1)
        for s, scheme in enumerate(schemes):
            value, error = found.value[s, members], found.error[s, members]
            label = _text(scheme if len(schemes) > 1 else "", name) or f"level {level}"
            look = _mark(s, s + k, len(schemes))
            interval(ax, x, value - error, value + error, look["color"])
            line(ax, x, value, linestyle="none" if x.size <= MARKED else "-", label=label, **look)
    ax.set_ylim(*_room(found, exact))
    ax.set_ylabel(style.label(found.name, found.unit))
    ax.set_title(f"{found.name.capitalize()}, level {level}")
    style.beside(ax, fontsize=7.5 if style.crowded(record) else 8)


def _room(found: Measured, exact: Floats | None) -> tuple[float, float]:
    """Return limits that hold all values and, as far as they do not exceed the values' own spread, the error bars."""
    finite = found.value[np.isfinite(found.value)]
    most = float(np.ptp(finite)) or 0.02 * float(np.max(np.abs(finite)))
    error = np.clip(np.nan_to_num(found.error), 0.0, most)
    shown = [found.value - error, found.value + error]
    return style.limits(*(shown if exact is None else [*shown, exact]))


def _draw_errors(ax: Axes, record: Record, along: Along, found: Measured) -> None:
    levels, schemes = whole(record, "level"), record.words("scheme")
    several = len(along.lines) > 1
    count = 1 if several or style.crowded(record) else 6 if len(schemes) == 1 else 3
    spaced = np.linspace(len(levels) - 1, 0, min(len(levels), count)).round().astype(int)
    chosen = np.unique(spaced)[::-1].tolist()
    error = {i: finest_level.period_error(record, i) for i in chosen}
    with np.errstate(invalid="ignore", divide="ignore"):
        predicted = found.error / found.value
    for k, (name, members) in enumerate(along.lines):
        x = along.key.values[members]
        for s, scheme in enumerate(schemes):
            text = "" if s or k else f"estimated, level {levels[-1]}"
            grey: dict[str, Any] = {"color": "#9a9a9a", "linewidth": 4.0, "alpha": 0.6, "zorder": 1}
            line(ax, x, style.no_zeros(predicted[s, members]), label=text, **grey)
            for m, i in enumerate(chosen):
                colour = k + s if several or style.crowded(record) else m
                label = _text(scheme if len(schemes) > 1 else "", name, f"level {levels[i]}")
                look = _mark(s, colour, len(schemes)) | {
                    "linestyle": style.look(colour)["linestyle"],
                    "linewidth": 1.2,
                }
                line(ax, x, style.no_zeros(error[i][s, members]), label=label, **look)
    style.fit_log_axis(ax, "y", *error.values(), room=2.0)
    ax.set_ylabel("|period / exact − 1|")
    ax.set_title("Relative error of the period")
    if not style.crowded(record):
        style.beside(ax, fontsize=8)


def _text(*parts: str) -> str:
    return style.entry(", ".join(part for part in parts if part))


def _mark(scheme: int, colour: int, count: int) -> dict[str, Any]:
    """Return a marker of a scheme; of several the first is large and hollow, so that all stay visible."""
    look: dict[str, Any] = {
        "marker": style.look(scheme)["marker"],
        "color": style.look(colour)["color"],
        "markersize": 4.5,
    }
    if count > 1 and scheme == 0:
        look |= {"markerfacecolor": "none", "markersize": 8}
    return look
