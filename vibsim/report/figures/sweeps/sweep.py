"""Curves over one swept parameter: period and amplitude, order, error and verdict, and numbers of checks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import SEVERITY
from vibsim.report import finest_level, frame, style, sweep_layout, words
from vibsim.report.choice import promises
from vibsim.report.data import Results
from vibsim.report.figures.panels import explosive, move_label_left, stacked
from vibsim.report.figures.sweeps import separatrix, view
from vibsim.report.figures.sweeps.view import View, Worst
from vibsim.report.finest_level import Measured
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import FEWEST_OF_A_LINE, Along
from vibsim.report.types import Axes, ValueCheck

TALL, ENTRY = 3.0, 0.18  # least height of a panel, height of a legend entry [inch]
RISE = 0.17  # vertical offset of a verdict from the next better one
MOST_MARKERS = 60  # most members with a marker each; more are a line
DEEP = 1e-16  # errors below this fraction of the largest leave the frame
LOG_RATIO = 10.0
"""If amplitudes leave the frame, a ratio of largest to median above this makes the scale of the others logarithmic."""


def views(
    record: Results, along: Along, quantities: list[str], worst: Worst
) -> Iterator[View | str]:
    """Yield a view of each number along one key, or a sentence if all members share it."""
    draw = _Drawing(record, along, worst)
    both = [draw.period, draw.amplitude]
    for draw_one in both if record.model.conservative else both[::-1]:
        yield from draw_one()
    for quantity in quantities:
        if record.triples:
            yield from draw.order(quantity)
        yield from draw.error(quantity)
        yield from draw.verdict(quantity)
    for name, text, check in view.value_checks(record):
        yield from draw.number(name, text, check)


@dataclass(frozen=True)
class _Drawing:
    """Views along one key."""

    record: Results
    along: Along
    worst: Worst

    @cached_property
    def on_separatrix(self) -> list[float]:
        """Where the separatrix crosses the line of the members, if there is only one line."""
        if len(self.along.lines) > 1 or self.along.follows:
            return []
        places: list[float] = separatrix.on_line(self.record.experiment, self.along.key).tolist()
        return places

    def _view(
        self, stem: str, name: str, quantity: str, values: Floats, caption: str, draw: Callable[[Axes], str],
        unit: str = "", form: str = "step",
    ) -> Iterator[View | str]:  # fmt: skip
        """Yield a view of values, or the value that all members share; nothing without finite values.

        `draw` draws them and returns a sentence if they leave the frame, else an empty text.
        """
        if text := view.shared(name, values, unit, form):
            yield text
        elif np.isfinite(values).any():
            tall = max(TALL, ENTRY * len(self.record.schemes) * len(self.along.lines))
            (ax,) = stacked([tall])
            caption = style.sentences(caption, draw(ax))
            yield self._finished(ax, stem, name, caption, quantity, values, values, unit)

    def _finished(
        self, ax: Axes, stem: str, name: str, caption: str, quantity: str, values: Floats | None, places: Floats,
        unit: str = "",
    ) -> View:  # fmt: skip
        """Finish the axes of a view, and mark the worst member."""
        key, worst = self.along.key, self.worst(quantity)
        view.key_axis(ax, key, 0.03)
        for x in self.on_separatrix:
            ax.axvline(x, color="black", linestyle=(0, (1, 2)), linewidth=1.0, zorder=1)
        dotted = "Dotted: the separatrix, where the exact period is infinite."
        marked = dotted * bool(self.on_separatrix)
        ax.set_gid(style.MEMBER)
        is_ringed = view.ring(ax, float(key.values[worst.case]), float(places[worst.place]))
        title = words.capitalized(name)
        alt = f"{title} of every member against {key.name}"
        keys = [swept.key for swept in sweep_layout.keys(self.record)]
        return View(
            name, Picture(stem, title, style.sentences(caption, marked), alt, ax.get_figure(root=True)), quantity,
            values, places if values is None else None, unit, schemes=tuple(range(len(places))),
            panels=((keys.index(key.key), None),), worst=worst.case if is_ringed else None,
        )  # fmt: skip

    def period(self) -> Iterator[View | str]:
        """Yield the period with its error bar, and its relative error on several levels."""
        record, quantity = self.record, self.record.model.position
        period, exact = finest_level.measured(record, "period"), record.exact_periods
        if not np.isfinite(period.value).any():
            return
        is_known, several = bool(np.isfinite(exact).any()), bool(record.pairs)
        bars = ", with its error bar from the two finest levels" * several
        yield from self._view(
            "period", "period", quantity, period.value, f"On the finest level{bars}{'; and the exact one' * is_known}.",
            lambda ax: self._draw_numbers(ax, period, exact if is_known else None), period.unit,
        )  # fmt: skip
        spacing = (
            "From level to level it should fall by the same factor, so lines of successive levels are evenly spaced. "
            "Where they are not, the coarse levels are too coarse. Grey: what the two finest levels predict without "
            "the exact period."
        )
        yield from self._view(
            "period_error", "error of the period", quantity, finest_level.period_error(record, -1), spacing * several,
            lambda ax: self._draw_period_errors(ax, period), form="norm",
        )  # fmt: skip

    def amplitude(self) -> Iterator[View | str]:
        """Yield the amplitude with its error bar."""
        record, quantity = self.record, self.record.model.position
        amplitude = finest_level.measured(record, "amplitude")
        if not np.isfinite(amplitude.value).any():
            return
        size = frame.sizes(record, quantity)
        bounded = frame.is_bounded(amplitude.value, size)
        if not bounded.any():
            bounded = np.isfinite(amplitude.value)
        # values beyond the frame have no error bar across it
        barred = bounded & frame.is_bounded(amplitude.error, size)
        value = np.where(bounded, amplitude.value, np.nan)
        error = np.where(barred, amplitude.error, np.nan)

        def draw(ax: Axes) -> str:
            move_label_left(ax)
            self._draw_bars(ax, replace(amplitude, error=error), None)
            finite = style.finite(value)
            is_wide = finite.size > 0 and float(finite.max()) > LOG_RATIO * float(np.median(finite))
            if explosive([value.ravel()]) or (is_wide and explosive([amplitude.value.ravel()])):
                # decades of a motion that a scheme damps away would fill the frame
                least = np.nanmin(np.append(size, np.nanmax(value))) / frame.UNBOUNDED
                style.fit_log_axis(ax, "y", np.maximum(value, least), room=2.0)
            else:
                ax.set_ylim(*_room(replace(amplitude, value=value, error=error), None))
            style.label_values(ax, amplitude.name, amplitude.unit)
            return self._leaving(ax, amplitude.value)

        text = "Half the height between the last peak and the last trough, on the finest level."
        text += " Members that go over the top have none." * bool(record.model.turn)
        open_members = finest_level.unsettled(record)
        if count := int(open_members.sum()):
            runs = f"{words.number(count, 'integer')} of {open_members.size} runs"
            text += f" {runs} are not settled: {finest_level.SWINGS}."
        yield from self._view(
            "amplitude", "amplitude", quantity, amplitude.value, text, draw, amplitude.unit
        )

    def order(self, quantity: str) -> Iterator[View | str]:
        """Yield the stated order of every member with its interval."""
        record, letter = self.record, words.symbol(quantity)
        value, low, high = record.stated_orders(quantity)
        basis = record.basis_of_order(quantity)

        def draw(ax: Axes) -> str:
            promised = promises(record, quantity)
            for order, tolerance in promised:
                ax.axhspan(order - tolerance, order + tolerance, **style.ALLOWED)
                ax.axhline(order, **style.REFERENCE, label=f"{basis}, {order:g} ± {tolerance:g}")
            for curve in self._curves():
                look = style.look(curve.number) | {"markersize": 4, "linewidth": 0.8}
                _interval(ax, curve.x, curve.of(low), curve.of(high), look["color"])
                label = curve.text or style.entry(record.schemes[curve.scheme])
                _line(ax, curve.x, curve.of(value), label=label, **look)
            if promised:
                least, most = promised[0][0], promised[-1][0]
                bottom, top = style.limits(value, np.array([least - 0.25, most + 0.25]))
                ax.set_ylim(max(bottom, least - 3), min(top, most + 2))
            ax.set_ylabel(f"order of {letter} ({words.USUAL_NORM})")
            self._beside(ax, fontsize=7.5 if record.is_crowded else 8.5)
            return ""

        yield from self._view(
            f"sweep_order_{quantity}", f"order of {letter}", quantity, value,
            "Stated by each member's levels, with its interval. "
            f"Grey: an order that is {basis}, with the tolerance of its check.", draw, form="order",
        )  # fmt: skip

    def error(self, quantity: str) -> Iterator[View | str]:
        """Yield the error of every member at the finest level."""
        record, name = self.record, f"error of {words.symbol(quantity)}"
        error, unit = finest_level.error(record, quantity), record.norm_unit(quantity)

        def draw(ax: Axes) -> str:
            both = np.stack([error.true, error.estimate])
            bounded = np.where(frame.is_bounded(both, frame.sizes(record, quantity)), both, np.nan)
            true, estimate = map(style.no_zeros, (error.true, error.estimate))
            # values beyond the frame have no error bar across it
            low, high = (
                np.where(np.isfinite(bounded[1]), style.no_zeros(end), np.nan)
                for end in (error.low, error.high)
            )
            for curve in self._curves():
                x, look = curve.x, style.look(curve.number)
                _interval(ax, x, curve.of(low), curve.of(high), look["color"])
                plain = {"color": look["color"], "linestyle": look["linestyle"], "linewidth": 1.0}
                _line(ax, x, curve.of(estimate), **plain, label=curve.text or "estimated")
                if np.isfinite(curve.of(true)).any():
                    has_entry = curve.text and np.isfinite(curve.of(estimate)).any()
                    text = f"_true, {curve.text}" if has_entry else curve.text or "true"
                    dots = look | {"linestyle": "none", "markersize": 4, "markerfacecolor": "white"}
                    _line(ax, x, curve.of(true), label=text, **dots)
            ax.set_ylabel(style.label(f"{name} ({words.USUAL_NORM})", unit))
            if not record.is_crowded:
                self._beside(ax)
            # without bounded values all of them set the range
            fitted = any(
                style.fit_log_axis(ax, "y", np.ravel(values), below=0.005, least=DEEP)
                for values in (bounded, both)
            )
            return self._leaving(ax, error.best) if fitted else ""

        text = ", estimated from two levels"
        if error.kind == "true":
            text = ": true (dots), and what two levels alone say of it (lines)"
        text = f"At the finest level{text}, with the interval of the order."
        yield from self._view(
            f"sweep_error_{quantity}", name, quantity, error.best, text if record.pairs else "The true error.", draw,
            unit, "norm",
        )  # fmt: skip

    def verdict(self, quantity: str) -> Iterator[View | str]:
        """Yield the verdict on every member's order, one row per scheme."""
        name = f"verdict on {words.title(quantity)}"
        if f"{quantity}_status" not in self.record:
            return
        status = self.record.flags(f"{quantity}_status")
        if text := view.shared_verdict(self.record, quantity):
            yield text
            return
        row = 0.17 if self.record.is_crowded else 0.3
        (ax,) = stacked([row * max(2, len(status))])
        _draw_verdicts(ax, self.along, status, self.record.schemes)
        ranks = list(SEVERITY)
        rank = np.array([[ranks.index(word) for word in of_scheme] for of_scheme in status])
        places = np.arange(len(status))[:, None] + RISE * rank
        yield self._finished(ax, f"sweep_verdict_{quantity}", name, "", quantity, None, places)

    def number(self, name: str, text: str, check: ValueCheck) -> Iterator[View | str]:
        """Yield the number, `text` in words, that a check asks for of every member."""
        values, unit = view.of_check(self.record, name, check), self.record.unit_of_number(check)
        number = Measured(text, unit, values, np.full(values.shape, np.nan))
        yield from self._view(
            f"sweep_check_{name}", text, self.record.model.position, values, "",
            lambda ax: self._draw_numbers(ax, number, None, words.capitalized(text)), unit,
        )  # fmt: skip

    def _curves(self, *, by_line: bool = False) -> list[_Curve]:
        """Return the curves of every scheme and line, ordered by scheme, or `by_line`."""
        names, lines, count = self.record.schemes, self.along.lines, len(self.along.lines)
        curves = []
        for s, name in enumerate(names):
            scheme = name if len(names) > 1 else ""
            for k, (line, at) in enumerate(lines):
                curves.append(
                    _Curve(s, s * count + k, self.along.key.values[at], at, _text(scheme, line))
                )
        return sorted(curves, key=lambda curve: curve.number % count) if by_line else curves

    def _draw_numbers(
        self, ax: Axes, number: Measured, exact: Floats | None, title: str = ""
    ) -> str:
        """Draw a number of the finest level with its error bars, and the exact number if it is known."""
        self._draw_bars(ax, number, exact, title)
        ax.set_ylim(*_room(number, exact))
        style.label_values(ax, number.name, number.unit)
        return ""

    def _draw_bars(self, ax: Axes, number: Measured, exact: Floats | None, title: str = "") -> None:
        """Draw the same without limits and label of the vertical axis."""
        count, level = len(self.record.schemes), self.record.levels[-1]
        for curve in self._curves(by_line=True):
            if exact is not None and curve.scheme == 0:
                values = np.where(np.isfinite(exact), exact, np.nan)[curve.members]
                text = "" if curve.number else "exact"
                _line(ax, curve.x, values, color="black", linewidth=1.0, label=text, zorder=1)
            value, error = curve.of(number.value), curve.of(number.error)
            look = _mark(curve.scheme, curve.number, count)
            _interval(ax, curve.x, value - error, value + error, look["color"])
            # dots are easier to tell from the line of the exact number
            has_dots = exact is not None and curve.x.size <= MOST_MARKERS
            dashes = "none" if has_dots else style.look(curve.number)["linestyle"]
            text = curve.text or f"level {level}"
            _line(ax, curve.x, value, linestyle=dashes, linewidth=1.0, label=text, **look)
        ax.set_title(title or f"{number.name.capitalize()}, level {level}")
        self._beside(ax, fontsize=7.5 if self.record.is_crowded else 8)

    def _draw_period_errors(self, ax: Axes, period: Measured) -> str:
        """Draw the relative error of the period on several levels, and its estimate from the two finest."""
        record, levels, schemes = self.record, self.record.levels, len(self.record.schemes)
        several = len(self.along.lines) > 1 or record.is_crowded
        count = 1 if several else 6 if schemes == 1 else 3
        spaced = np.linspace(len(levels) - 1, 0, min(len(levels), count)).round().astype(int)
        error = {i: finest_level.period_error(record, i) for i in np.unique(spaced)[::-1].tolist()}
        with np.errstate(invalid="ignore", divide="ignore"):
            predicted = style.no_zeros(period.error / period.value)
        for curve in self._curves(by_line=True):
            text = "" if curve.number else f"estimated, level {levels[-1]}"
            grey: dict[str, Any] = {"color": "#9a9a9a", "linewidth": 4.0, "alpha": 0.6, "zorder": 1}
            _line(ax, curve.x, curve.of(predicted), label=text, **grey)
            line, s = divmod(curve.number, len(self.along.lines))[::-1]
            for m, (i, level_error) in enumerate(error.items()):
                colour = line + s if several else m
                text = ", ".join(filter(None, [curve.text, f"level {levels[i]}"]))
                look = _mark(s, colour, schemes) | {"linewidth": 1.2}
                look |= {"linestyle": style.look(colour)["linestyle"]}
                _line(ax, curve.x, curve.of(style.no_zeros(level_error)), label=text, **look)
        style.fit_log_axis(ax, "y", *error.values(), room=2.0)
        ax.set(ylabel="|period / exact − 1|", title="Relative error of the period")
        if not record.is_crowded:
            self._beside(ax, fontsize=8)
        return ""

    def _leaving(self, ax: Axes, values: Floats) -> str:
        """Mark at the upper edge the values, shape (scheme, case), that leave the frame; return the sentence on them.

        Of few members each is marked, of many the first of every run of successive ones.
        """
        high, leaves = ax.get_ylim()[1], False
        for s in range(values.shape[0]):
            for _, members in self.along.lines:
                x, y = self.along.key.values[members], values[s, members]
                grown = np.where(y > high, y, np.where(np.isfinite(y), high, np.nan))
                each = x.size <= MOST_MARKERS
                leaves |= frame.mark_leaving(ax, x, grown, color=style.look(s)["color"], each=each)
        return frame.LEAVING if leaves else ""

    def _beside(self, ax: Axes, **options: Any) -> None:
        """Put the legend beside the axes, with the key in which lines differ as its title."""
        name = self.along.lines[0][0]
        if " = " in name and ", " not in name:
            key = name.rpartition(" = ")[0]
            options |= {"title": key, "title_fontsize": 8, "alignment": "left"}
        style.beside(ax, **options)


@dataclass(frozen=True)
class _Curve:
    """The members of a scheme on one line, in ascending order of the key."""

    scheme: int
    number: int  # of all curves
    x: Floats
    members: NDArray[np.intp]
    text: str  # legend entry: the scheme, if there are several, and the line; else empty

    def of(self, values: Floats) -> Floats:
        """Return the values of its members, of values of the shape (scheme, case)."""
        return np.asarray(values[self.scheme, self.members])


def _draw_verdicts(ax: Axes, along: Along, status: NDArray[Any], schemes: list[str]) -> None:
    """Draw one row per scheme; every verdict has its own colour, marker and height."""
    order = np.argsort(along.key.values, kind="stable")
    x, many = along.key.values[order], len(schemes) > style.MANY
    for i, word in enumerate(SEVERITY):
        places = []
        for s in range(len(schemes)):
            members = x[status[s][order] == word]
            places.append(style.thin(members, np.full(members.size, s + RISE * i)))
        ax.plot(
            *np.hstack(places), linestyle="none", marker=style.STATUS_MARKERS[word],
            markersize=3.5 if many else 5, color=style.STATUS_COLOURS[word], markeredgecolor="black",
            markeredgewidth=0.3, label=f"{word} ({int((status == word).sum())})", clip_on=False,
        )  # fmt: skip
    ax.set_yticks(np.arange(len(schemes)) + RISE, schemes, fontsize=8.0 if many else 8.5)
    ax.set_ylim(-0.3, len(schemes) - 0.3)
    ax.grid(visible=False, axis="y")
    if not many:
        style.beside(ax, handlelength=1.2)
        return
    # many names fit only at the right, and the legend then above
    ax.tick_params(axis="y", left=False, labelleft=False, labelright=True)
    place: Any = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.1}
    ax.legend(ncols=3, fontsize=8, handlelength=1.2, **place)


def _room(number: Measured, exact: Floats | None) -> tuple[float, float]:
    """Return limits that hold all values and their error bars, these up to the spread of the values."""
    values = style.finite(number.value)
    most = float(np.ptp(values)) or 0.02 * float(np.max(np.abs(values)))
    error = np.clip(np.nan_to_num(number.error), 0.0, most)
    shown = [number.value - error, number.value + error]
    return style.limits(*(shown if exact is None else [*shown, exact]))


def _line(ax: Axes, x: Floats, y: Floats, **look: Any) -> None:
    """Draw a number of members in the order of `x`, thinned; with markers if they are few."""
    if x.size > MOST_MARKERS:
        look["marker"] = "," if look.get("linestyle") == "none" else ""
    elif np.unique(x).size < FEWEST_OF_A_LINE:
        look |= {"linestyle": "none", "marker": look.get("marker") or "_"}
    ax.plot(*style.thin(x, y), **look)


def _interval(ax: Axes, x: Floats, low: Floats, high: Floats, colour: str) -> None:
    """Draw error bars: one for each of few members, two border lines for many."""
    if x.size <= MOST_MARKERS:
        ax.vlines(x, low, high, color=colour, linewidth=2.4, alpha=0.4)
        return
    for bound in (low, high):
        ax.plot(*style.thin(x, bound), color=colour, linewidth=0.6, alpha=0.6)


def _text(*parts: str) -> str:
    """Join the words of a legend entry; a line that differs in one key has only its value."""
    short = (part if ", " in part else part.rpartition(" = ")[2] for part in parts if part)
    return style.entry(", ".join(short))


def _mark(scheme: int, colour: int, count: int) -> dict[str, Any]:
    """Return the marker of a scheme; the first of several is large and hollow, so that all stay visible."""
    look = {"marker": style.look(scheme)["marker"], "color": style.look(colour)["color"]}
    if count > 1 and scheme == 0:
        return look | {"markerfacecolor": "none", "markersize": 8}
    return look | {"markersize": 4.5}
