"""Curves over one swept parameter: period and amplitude, order, error and verdict, and numbers of checks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import SEVERITY, TYPICAL_NORM
from vibsim.report import finest_level, frame, style, sweep_layout
from vibsim.report.choice import position, promises
from vibsim.report.data import due, exact_periods, flags, norm_unit, whole
from vibsim.report.figures.panels import explosive, stacked
from vibsim.report.figures.sweeps import separatrix
from vibsim.report.figures.sweeps.view import (
    View,
    Worst,
    check_words,
    of_check,
    ring,
    shared,
    shared_verdict,
    value_checks,
)  # fmt: skip
from vibsim.report.finest_level import Measured
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Along
from vibsim.report.text import words
from vibsim.report.types import Axes, Experiment, ValueCheck

TALL, ENTRY = 3.0, 0.18  # least height of a panel, height of an entry of a legend [inch]
RISE = 0.17  # by which a worse verdict stands higher
MOST_MARKERS = 60  # most members that get a marker each; above, a line says it better
DEEP = 1e-16  # errors below this part of the largest leave the frame
LOG_RATIO = 10.0
"""Where some amplitudes leave the frame, others that many times a usual one are drawn on a logarithmic scale."""


def views(
    experiment: Experiment, record: Record, along: Along, found: list[str], worst: Worst
) -> Iterator[View | str]:
    """Yield a view of each quantity along one key; of what is the same for all members a sentence."""
    draw = _Drawing(experiment, record, along, worst)
    both = [draw.period, draw.amplitude]
    for draw_one in both if experiment.model.definition.conservative else both[::-1]:
        yield from draw_one()
    for quantity in found:
        if whole(record, "triple"):
            yield from draw.order(quantity)
        yield from draw.error(quantity)
        yield from draw.verdict(quantity)
    for name, check in value_checks(experiment):
        yield from draw.number(name, check)


@dataclass(frozen=True)
class _Drawing:
    """What the views along one key have in common."""

    experiment: Experiment
    record: Record
    along: Along
    worst: Worst

    @property
    def _tall(self) -> float:
        """The height of a panel with room for its legend [inch]."""
        return max(TALL, ENTRY * len(self.record["scheme"]) * len(self.along.lines))

    def _view(
        self, ax: Axes, stem: str, name: str, caption: str, quantity: str, values: Floats | None, *,
        places: Floats | None = None, unit: str = "",
    ) -> View:  # fmt: skip
        """Finish the axes of a view, and mark the worst member."""
        key, worst = self.along.key, self.worst(quantity)
        marked = _finish(ax, self.experiment, self.along)
        drawn = values if places is None else places
        assert drawn is not None
        place = float(key.values[worst.case]), float(drawn[worst.scheme, worst.case])
        ax.set_gid(style.MEMBER)
        is_ringed = ring(ax, *place)
        alt = f"{name[:1].upper()}{name[1:]} of every member against {key.name}"
        text = style.sentences(caption, marked)
        figure = ax.get_figure(root=True)
        keys = [one.key for one in sweep_layout.keys(self.record)]
        return View(
            name, Picture(stem, f"{name[:1].upper()}{name[1:]}", text, alt, figure), quantity, values, places,
            unit, schemes=tuple(range(len(drawn))), panels=((keys.index(key.key), None),),
            worst=worst.case if is_ringed else None,
        )  # fmt: skip

    def period(self) -> Iterator[View | str]:
        """Yield the period with its error bar, and its relative error on several levels."""
        record, quantity = self.record, position(self.experiment)
        found, exact = finest_level.measured(record, "period", quantity), exact_periods(record)
        if not np.isfinite(found.value).any():
            return
        if text := shared("period", found.value, found.unit):
            yield text
        else:
            is_known, several = bool(np.isfinite(exact).any()), bool(whole(record, "pair"))
            (ax,) = stacked([self._tall])
            _draw_numbers(ax, record, self.along, found, exact if is_known else None)
            yield self._view(
                ax, "period", "period",
                f"On the finest level{', with its error bar from the two finest levels' * several}"
                f"{'; and the exact one' * is_known}.",
                quantity, found.value, unit=found.unit,
            )  # fmt: skip
        error = finest_level.period_error(record, -1)
        if text := shared("error of the period", error, form="norm"):
            yield text
        elif np.isfinite(error).any():
            (ax,) = stacked([self._tall])
            _draw_period_errors(ax, record, self.along, found)
            yield self._view(
                ax, "period_error", "error of the period",
                "From level to level it should fall by the same factor, so lines of successive levels are evenly "
                "spaced. Where they are not, the coarse levels are too coarse. Grey: what the two finest levels "
                "predict without the exact period." if whole(record, "pair") else "",
                quantity, error,
            )  # fmt: skip

    def amplitude(self) -> Iterator[View | str]:
        """Yield the amplitude with its error bar, and the error bar alone."""
        experiment, record, along = self.experiment, self.record, self.along
        quantity = position(experiment)
        found = finest_level.measured(record, "amplitude", quantity)
        if not np.isfinite(found.value).any():
            return
        size = frame.sizes(record, quantity)
        bounded = frame.is_bounded(found.value, size)
        if not bounded.any():
            bounded = np.isfinite(found.value)
        # what is beyond the frame has no bar across it
        barred = bounded & frame.is_bounded(found.error, size)
        value = np.where(bounded, found.value, np.nan)
        error = np.where(barred, found.error, np.nan)
        if text := shared("amplitude", found.value, found.unit):
            yield text
        else:
            (ax,) = stacked([self._tall])
            # amplitudes that hardly differ need long numbers
            ax.yaxis.set_label_coords(-0.115, 0.5)
            _draw_numbers(ax, record, along, replace(found, error=error), None)
            usual = style.finite(value)
            is_wide = usual.size > 0 and float(usual.max()) > LOG_RATIO * float(np.median(usual))
            if explosive([value.ravel()]) or (is_wide and explosive([found.value.ravel()])):
                # a motion that a scheme damps away would fill the frame with its decades
                least = np.nanmin(np.append(size, np.nanmax(value))) / frame.UNBOUNDED
                style.fit_log_axis(ax, "y", np.maximum(value, least), room=2.0)
            else:
                ax.set_ylim(*_room(replace(found, value=value, error=error), None))
            leaves = _mark_members(ax, along, found.value)
            yield self._view(
                ax, "amplitude", "amplitude",
                style.sentences(
                    "Half the height between the last peak and the last trough, on the finest level.",
                    "Members that go over the top have none." if experiment.model.definition.turn else "",
                    frame.LEAVING if leaves else "",
                ),
                quantity, found.value, unit=found.unit,
            )  # fmt: skip
        if not whole(record, "pair") or not np.isfinite(found.error).any():
            return
        name = "error bar of the amplitude"
        if text := shared(name, found.error, found.unit, "norm"):
            yield text
            return
        (ax,) = stacked([self._tall])
        _draw_error_bars(ax, record, along, found, error)
        leaves = _mark_members(ax, along, found.error)
        yield self._view(
            ax, "amplitude_error", name,
            style.sentences("Estimated from the two finest levels.", frame.LEAVING if leaves else ""),
            quantity, found.error, unit=found.unit,
        )  # fmt: skip

    def order(self, quantity: str) -> Iterator[View | str]:
        """Yield the stated order of every member with its interval."""
        name, order = (
            f"order of {words.symbol(quantity)}",
            finest_level.orders(self.record, quantity)[0],
        )
        if text := shared(name, np.round(order, 3), form="order"):
            yield text
        elif np.isfinite(order).any():
            (ax,) = stacked([self._tall])
            _draw_orders(ax, self.experiment, self.record, self.along, quantity)
            band = f"Grey: an order that is {due(self.record, quantity)}, with the tolerance of its check."
            yield self._view(
                ax, f"sweep_order_{quantity}", name, f"Stated by each member's levels, with its interval. {band}",
                quantity, order,
            )  # fmt: skip

    def error(self, quantity: str) -> Iterator[View | str]:
        """Yield the error of every member at the finest level."""
        name, error = (
            f"error of {words.symbol(quantity)}",
            finest_level.error(self.record, quantity),
        )
        unit = norm_unit(self.record, quantity)
        if text := shared(name, error.best, unit, "norm"):
            yield text
        elif np.isfinite(error.best).any():
            (ax,) = stacked([self._tall])
            kind, leaves = _draw_errors(ax, self.record, self.along, quantity)
            told = "At the finest level: true (dots), and what two levels alone say of it (lines)"
            told = told if kind == "true" else "At the finest level, estimated from two levels"
            told = (
                f"{told}, with the interval of the order."
                if whole(self.record, "pair")
                else "True."
            )
            yield self._view(
                ax, f"sweep_error_{quantity}", name, style.sentences(told, frame.LEAVING if leaves else ""),
                quantity, error.best, unit=unit,
            )  # fmt: skip

    def verdict(self, quantity: str) -> Iterator[View | str]:
        """Yield the verdict on every member's order, one row per scheme."""
        name = f"verdict on {words.symbol(quantity)}"
        if f"{quantity}_status" not in self.record:
            return
        status = flags(self.record, f"{quantity}_status")
        if text := shared_verdict(self.record, quantity):
            yield text
            return
        row = 0.17 if style.crowded(self.record) else 0.3
        (ax,) = stacked([row * max(2, len(status))])
        _draw_verdicts(ax, self.along, status, self.record.words("scheme"))
        ranks = list(SEVERITY)
        rank = np.array([[ranks.index(word) for word in of_scheme] for of_scheme in status])
        yield self._view(
            ax, f"sweep_verdict_{quantity}", name, "", quantity, None,
            places=np.arange(len(status))[:, None] + RISE * rank,
        )  # fmt: skip

    def number(self, name: str, check: ValueCheck) -> Iterator[View | str]:
        """Yield the number that a check asks for of every member."""
        values = of_check(self.record, name, check)
        if text := shared(name, values):
            yield text
        elif np.isfinite(values).any():
            (ax,) = stacked([self._tall])
            found = finest_level.Measured(
                check_words(check), "", values, np.full(values.shape, np.nan)
            )
            _draw_numbers(ax, self.record, self.along, found, None)
            ax.set_title(name)
            yield self._view(ax, f"sweep_check_{name}", name, "", position(self.experiment), values)


def _finish(ax: Axes, experiment: Experiment, along: Along) -> str:
    """Give the axis of the key its scale, label and separatrix; return the sentence on the latter."""
    key = along.key
    if key.is_log:
        room = (key.distinct[-1] / key.distinct[0]) ** 0.03
        style.log_axis(ax, "x", float(key.distinct[0] / room), float(key.distinct[-1] * room))
    if key.words:
        ax.set_xticks(key.distinct, key.words)
    ax.set_xlabel(key.label)
    is_alone = len(along.lines) == 1 and not along.follows
    found = separatrix.on_line(experiment, key).tolist() if is_alone else []
    for x in found:
        ax.axvline(x, color="black", linestyle=(0, (1, 2)), linewidth=1.0, zorder=1)
    return "Dotted: the separatrix, where the exact period is infinite." if found else ""


def _draw_orders(
    ax: Axes, experiment: Experiment, record: Record, along: Along, quantity: str
) -> None:
    promised = promises(experiment, record, quantity)
    for order, tolerance in promised:
        ax.axhspan(order - tolerance, order + tolerance, **style.ALLOWED)
        text = f"{due(record, quantity)}, {order:g} ± {tolerance:g}"
        ax.axhline(order, **style.REFERENCE, label=text)
    value, low, high = finest_level.orders(record, quantity)
    several = len(record["scheme"]) > 1
    for s, scheme in enumerate(record.words("scheme")):
        for k, (name, members) in enumerate(along.lines):
            look = style.look(s * len(along.lines) + k) | {"markersize": 4, "linewidth": 0.8}
            x = along.key.values[members]
            _interval(ax, x, low[s, members], high[s, members], look["color"])
            label = _text(scheme if several else "", name) or style.entry(scheme)
            _line(ax, x, value[s, members], label=label, **look)
    if promised:
        least, most = promised[0][0], promised[-1][0]
        bottom, top = style.limits(value, np.array([least - 0.25, most + 0.25]))
        ax.set_ylim(max(bottom, least - 3), min(top, most + 2))
    ax.set_ylabel(f"order of {words.symbol(quantity)} ({TYPICAL_NORM})")
    _beside(ax, along, fontsize=7.5 if style.crowded(record) else 8.5)


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
        for k, (name, members) in enumerate(along.lines):
            look, named = (
                style.look(s * len(along.lines) + k),
                _text(scheme if len(schemes) > 1 else "", name),
            )
            x, here = along.key.values[members], (s, members)
            _interval(ax, x, low[here], high[here], look["color"])
            text = named or "estimated"
            plain = {"color": look["color"], "linestyle": look["linestyle"]}
            _line(ax, x, estimate[here], **plain, linewidth=1.0, label=text)
            if np.isfinite(true[here]).any():
                text = (
                    f"_true, {named}"
                    if named and np.isfinite(estimate[here]).any()
                    else named or "true"
                )
                dots = look | {"linestyle": "none", "markersize": 4, "markerfacecolor": "white"}
                _line(ax, x, true[here], label=text, **dots)
    leaves = False
    # where nothing is bounded all of it makes the range
    for values in (bounded, [found.true, found.estimate]):
        if style.fit_log_axis(ax, "y", np.concatenate(values, axis=None), below=0.005, least=DEEP):
            leaves = _mark_members(ax, along, found.best)
            break
    text = f"error of {words.symbol(quantity)} ({TYPICAL_NORM})"
    ax.set_ylabel(style.label(text, norm_unit(record, quantity)))
    if not style.crowded(record):
        _beside(ax, along)
    return found.kind, leaves


def _draw_verdicts(ax: Axes, along: Along, status: NDArray[Any], schemes: list[str]) -> None:
    """Draw one row per scheme; every verdict has a colour, a marker and a height of its own."""
    order = np.argsort(along.key.values, kind="stable")
    x, many = along.key.values[order], len(schemes) > style.MANY
    for i, word in enumerate(SEVERITY):
        xs, ys = [np.empty(0)], [np.empty(0)]
        for s in range(len(schemes)):
            found = x[status[s][order] == word]
            thinned = style.thin(found, np.full(found.size, s + RISE * i))
            xs, ys = [*xs, thinned[0]], [*ys, thinned[1]]
        ax.plot(
            np.concatenate(xs), np.concatenate(ys), linestyle="none", marker=style.STATUS_MARKERS[word],
            markersize=3.5 if many else 5, color=style.STATUS_COLOURS[word], markeredgecolor="black",
            markeredgewidth=0.3, label=f"{word} ({int((status == word).sum())})", clip_on=False,
        )  # fmt: skip
    ax.set_yticks(np.arange(len(schemes)) + RISE, schemes, fontsize=8.0 if many else 8.5)
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
            number = s * len(along.lines) + k
            look = _mark(s, number, len(schemes))
            _interval(ax, x, value - error, value + error, look["color"])
            # beside the exact line dots are seen better
            has_dots = exact is not None and x.size <= MOST_MARKERS
            dashes = "none" if has_dots else style.look(number)["linestyle"]
            _line(ax, x, value, linestyle=dashes, linewidth=1.0, label=label, **look)
    ax.set_ylim(*_room(found, exact))
    ax.set_ylabel(style.label(found.name, found.unit))
    ax.set_title(f"{found.name.capitalize()}, level {level}")
    _beside(ax, along, fontsize=7.5 if style.crowded(record) else 8)


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
        _beside(ax, along, fontsize=8)


def _draw_error_bars(ax: Axes, record: Record, along: Along, found: Measured, held: Floats) -> None:
    """Draw the estimated error of a number of the finest level, in a frame that holds the errors `held`."""
    for s, scheme in enumerate(record.words("scheme")):
        for k, (name, members) in enumerate(along.lines):
            look = style.look(s * len(along.lines) + k) | {"markersize": 4}
            text = _text(scheme if len(record["scheme"]) > 1 else "", name) or style.entry(scheme)
            error = style.no_zeros(found.error[s, members])
            _line(ax, along.key.values[members], error, **look, label=text)
    # of a motion that is damped away the error falls for ever
    shown = held if np.isfinite(held).any() else found.error
    style.fit_log_axis(ax, "y", shown, least=DEEP, room=2.0)
    ax.set_ylabel(style.label("estimated error", found.unit))
    if len(along.lines) > 1 and not style.crowded(record):
        _beside(ax, along, fontsize=8)


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
    """Join the words of a legend entry; of a line that differs in one key its value is enough."""
    short = (part if ", " in part else part.rpartition(" = ")[2] for part in parts if part)
    return style.entry(", ".join(short))


def _beside(ax: Axes, along: Along, **options: Any) -> None:
    """Put the legend beside the axes, below the key in which lines differ."""
    key = along.lines[0][0].rpartition(" = ")[0]
    if key and ", " not in key:
        options |= {"title": key, "title_fontsize": 8, "alignment": "left"}
    style.beside(ax, **options)


def _mark(scheme: int, colour: int, count: int) -> dict[str, Any]:
    """Return a marker of a scheme; of several the first is large and hollow, so that all stay visible."""
    look = {"marker": style.look(scheme)["marker"], "color": style.look(colour)["color"]}
    is_hollow = count > 1 and scheme == 0
    return look | (
        {"markerfacecolor": "none", "markersize": 8} if is_hollow else {"markersize": 4.5}
    )
