"""The two pictures at the top of a page: the decisive one, and the error against the step.

In a sweep they are the response over the swept parameters, with the decisive member marked, and the orders of all
members. Source: pendulum lecture, section 2.5.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibsim.checks.fields import field_values
from vibsim.checks.order_context import COINCIDE
from vibsim.checks.outcome import about_members
from vibsim.core.array_types import Flags, Floats
from vibsim.core.vocabulary import SECONDS_OF_NORM
from vibsim.report import choice, finest_level, series, style, sweep_layout, words
from vibsim.report.choice import CheckedLadder
from vibsim.report.data import Ladder, Member
from vibsim.report.figures import moments, panels, time
from vibsim.report.figures.solution import DOTS
from vibsim.report.figures.sweeps.view import key_axis, of_a_member, ring
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Along, Grid
from vibsim.report.text import findings
from vibsim.report.types import Axes

LEFT, RIGHT, HEIGHT = 5.4, 3.9, 2.75  # widths of the two pictures, and their height [inch]
FEW = 300  # members up to which orders are dots; more are a histogram
FEWEST_ERRORS = 2  # that a picture against the step needs
MOST_SCHEMES = 6  # schemes that the right picture can tell apart
SIZES = {
    "l1": "mean error", "l2": "root-mean-square error", "linf": "largest error",
    "linf_interior": "largest error without the last point",
}  # fmt: skip
"""Norm to its name after division by the power of the duration that makes it an average."""
WIDE_RATIO = 100.0
"""Ratio of numbers from which their axis is logarithmic; with a smaller one a peak would look flat."""
STRIP = 0.097  # height of a legend row as a part of that of the axes
LONG = 24  # characters of a label from which it is smaller, and of a member from which a title leaves it out


def _panel(width: float, title: str, right: float = 0.14) -> Axes:
    """Return the axes of a picture, with the label of the vertical axis above them."""
    figure = style.canvas(HEIGHT, width)
    box = (0.72 / width, 0.46 / HEIGHT, (width - 0.72 - right) / width, (HEIGHT - 0.78) / HEIGHT)
    ax = figure.add_axes(box)
    _name(ax, title)
    return ax


def _name(ax: Axes, title: str) -> None:
    """Write the label of the vertical axis, or of the colours, above the axes."""
    ax.set_title(title, fontweight="normal", fontsize=8.5, color=style.GREY)


def _legend(ax: Axes, columns: int, size: float) -> None:
    """Write the legend in its own strip above the curves."""
    strip = STRIP * -(-len(ax.get_legend_handles_labels()[0]) // columns)
    low, high = ax.get_ylim()
    more = strip / (1.0 - strip)
    if ax.get_yscale() == "log":
        ax.set_ylim(low, high * (high / low) ** more)
    else:
        ax.set_ylim(low, high + more * (high - low))
    ax.legend(
        loc="upper left", ncols=columns, fontsize=size, handlelength=1.6, borderaxespad=0.2, columnspacing=1.9
    )  # fmt: skip


def differences(lead: CheckedLadder) -> Picture | None:
    """Draw the rescaled differences of the levels; None without stored series or with a single level."""
    if "difference" not in lead:
        return None
    t, curves = lead.t, time.differences(lead)
    shown = [curve for curve in curves if curve.is_readable] or curves
    values = [curve.values for curve in shown]
    if not np.any(style.finite(*values)):
        return None
    scale = panels.Scale.of(values)
    letter = lead.letter
    text = style.label(f"rescaled differences of {letter}", lead.unit("difference"), scale.exponent)
    ax = _panel(LEFT, text)
    ax.set_gid(style.TIME)
    # a name of several words would take the room of the curves
    labels = [
        curve.label.replace(letter, "level") if " " in letter else curve.label for curve in shown
    ]
    for i, curve in enumerate(shown):
        colour, width = style.COLOURS[i % style.MANY], 5.5 - 4.2 * i / max(1, len(shown) - 1)
        line = style.thin(t, scale.scaled(curve.values), 200)
        ax.plot(*line, label=labels[i], gid=curve.group, color=colour, linewidth=width)
    scale.apply(ax)
    ax.set_xlim(float(t[0]), float(t[-1]) if t[-1] > t[0] else 1.0)
    ax.set_xlabel(lead.record.time_label)
    _legend(ax, columns=3, size=8.0 if max(map(len, labels)) < LONG else 6.0)
    return Picture(
        "hero_differences",
        _title_of_differences(lead, len(shown)),
        "The difference between each level and the next finer one, multiplied so that the curves fall on one another "
        "where the error has the promised order.",
        f"Rescaled differences of {lead.name} between successive levels against time, {lead.title}",
        ax.get_figure(root=True),
    )


def _title_of_differences(lead: CheckedLadder, count: int) -> str:
    """Say whether the curves coincide, and how well."""
    last = lead.coincidence
    several = lead.member.scheme_name if len(lead.record.schemes) > 1 else ""
    case = lead.member.case_words
    # a long name would take several lines, and stands among the large numbers
    member = case if len(case) < LONG else "hardest member"
    named = ", ".join(filter(None, [several, member]))
    of = f" ({named})" if named else ""
    if lead.result.get("reason") in ("exact", "round_off"):
        return f"What is left is round-off{of}"
    if count < 2 or not math.isfinite(last):
        return f"What is left between the levels{of}"
    if last > COINCIDE:
        return f"The rescaled curves do not coincide{of}"
    return f"The finest curves agree to {words.number(100.0 * last, 'brief')} %{of}"


def against_step(lead: CheckedLadder) -> Picture | None:
    """Draw the errors of all schemes and levels against the step; None if there are too few."""
    record, dt, first = lead.record, lead.dt, lead.scheme
    others = [s for s in range(len(record.schemes)) if s != first][: MOST_SCHEMES - 1]
    # an L2 norm over the root of the duration is the root of the mean square
    scale = float(record.ends[lead.case]) ** SECONDS_OF_NORM[lead.norm]
    ax = _panel(RIGHT, style.label(f"{SIZES[lead.norm]} of {lead.letter}", lead.norm_unit("linf")))
    ax.set_gid(style.STEP)
    drawn: list[Floats] = []
    notes, slopes = dict[str, None](), set[float]()
    for s in [*others, first]:
        name = record.schemes[s]
        ladder = lead.with_member(Member(s, lead.case, name))
        order = ladder.formal_order
        if not math.isfinite(order):
            continue
        estimate, true = (one / scale for one in _errors(ladder, lead.norm))
        is_lead, alone = s == first, not others
        text = "estimated" if alone else style.entry(name)
        mark: dict[str, Any] = {"linestyle": "none", "gid": None if alone else text}
        mark |= {"color": style.COLOURS[s % style.MANY], "marker": style.MARKERS[s % style.MANY]}
        is_estimated = style.finite(estimate).size > 0
        if is_estimated:
            ax.plot(dt, estimate, **mark, markersize=5 if is_lead else 3.5, label=text)
            drawn.append(estimate)
            notes["Filled: estimated from the differences of the levels."] = None
        if style.finite(true).size:
            ring = mark | {"markerfacecolor": "none", "markersize": 9 if is_lead else 6.5}
            # one entry for each scheme: that of its estimate, if it has one
            of_scheme = f"_true, {name}" if is_estimated else text
            ax.plot(dt, true, **ring, label="true" if alone else of_scheme)
            drawn.append(true)
            notes["Rings: the true error."] = None
        has_order = math.isfinite(ladder.stated_order(lead.norm)[0])
        is_lead_on_order = is_lead and lead.is_on_order and lead.result.get("reason") != "exact"
        if (has_order or is_lead_on_order) and order not in slopes:
            slopes.add(order)
            error = np.where(np.isfinite(true), true, estimate)
            _slope(ax, dt, error, order, lead.basis_of_order)
    if sum(style.finite(part).size for part in drawn) < FEWEST_ERRORS:
        return None
    high = max(float(part[np.isfinite(part)].max()) for part in drawn)
    style.fit_log_axis(ax, "y", *drawn, least=1e-18, room=2.5, most=5)
    style.log_axis(ax, "x", float(dt.min()) / 1.4, float(dt.max()) * 1.4, most=4)
    ax.set_ylim(top=min(2.5 * high, style.LARGEST))
    ax.set_xlabel(style.label("time step dt", record.time_unit))
    _legend(ax, columns=2, size=7.5)
    title, found = "Error against time step", findings.factor(lead)
    if found is not None:
        due = words.fact(lead.result, "promised")
        is_other = lead.result["reason"] != "asymptotic" and due is not None
        missed = f", not by {2.0**due:.3g}" if is_other else ""
        of = f" of {lead.member.scheme_name}" if others else ""
        title = f"Each level divides the error{of} by {found:.3g}{missed}"
    return Picture(
        "hero_error",
        title,
        style.sentences(
            "Both axes are logarithmic, so an error of order p is a line of slope p.", *notes
        ),
        f"Error of {lead.name} against the time step",
        ax.get_figure(root=True),
    )


def solution(ladder: Ladder, *, is_left: bool) -> Picture:
    """Draw a quantity at the finest level, and the exact solution."""
    t, values, steps = ladder.t, ladder.finest, ladder.record.steps[-1]
    exact, name = series.exact_curve(ladder), ladder.record.name_of_exact
    ax = _panel(LEFT if is_left else RIGHT, style.label(ladder.letter, ladder.unit()))
    ax.set_gid(style.TIME)
    has_exact = bool(np.isfinite(exact[1]).any())
    first = moments.first_shown(t, values)
    start, title = float(t[first]), f"{ladder.letter}(t), {ladder.title}"
    # as in the figure of the motion, lines between too few samples would cut off its extremes
    is_dotted = moments.is_undersampled(steps, t, exact if has_exact else (t, values))
    if first:
        title += f", last {moments.WINDOW_PERIODS:g} periods"
        exact = series.exact_curve(ladder, start=start)
        t, values = t[first:], values[first:]
    if has_exact:
        ax.plot(*style.thin(*exact, 200), color=style.PALE, linewidth=4.5, label=name)
    text = f"{words.number(steps, 'integer')} steps"
    look: dict[str, Any] = DOTS if is_dotted else {"linewidth": 1.4}
    ax.plot(*style.thin(t, values, 200), color=style.COLOURS[0], label=text, **look)
    panels.fit_values(ax, [values], exact[1])
    panels.stop_at_breakdown(ax, t, [values])
    ax.set_xlabel(ladder.record.time_label)
    _legend(ax, columns=2, size=8.0)
    return Picture(
        "hero_solution", title,
        "The solution of the finest level." + f" Wide and grey: the {name} solution." * has_exact,
        f"{ladder.name} against time for {ladder.title}", ax.get_figure(root=True),
    )  # fmt: skip


def _errors(ladder: Ladder, norm: str) -> tuple[Floats, Floats]:
    """Return the estimated and the true error of every level in a norm, shape (level,); NaN if unknown.

    With the difference d of two levels and the ratio r of their errors, the error of the coarser one is d r/(r - 1), of
    the finer one d/(r - 1).
    """
    levels, true = ladder.record.levels, ladder.optional("error_norm", ("level",), norm)
    estimate = np.full(len(levels), np.nan)
    if ladder.record.pairs:
        gap = ladder.at("difference_norm", norm)
        # stated or estimated: both give the estimate that the tables have
        order = float(ladder.at("order", norm))
        order = order if math.isfinite(order) else ladder.formal_order
        if math.isfinite(order) and order > 0.0:
            rest = 2.0 ** (order * np.diff(levels)) - 1.0
            estimate = np.append(gap * (rest + 1.0) / rest, gap[-1] / rest[-1])
    return style.positive(estimate), style.positive(true)


def _slope(ax: Axes, dt: Floats, error: Floats, order: float, due: str) -> None:
    """Draw the slope of an order through the finest known error."""
    for last in np.flatnonzero(np.isfinite(error))[-1:]:
        line = error[last] * (dt / dt[last]) ** order
        # below the legend, which is above the errors
        line[line > 2.0 * float(np.nanmax(error))] = np.nan
        if style.finite(line).size > 1:
            look = style.REFERENCE | {"color": style.GREY}
            ax.plot(dt, line, **look, label=f"order {order:g}, {due}")


def response(lead: CheckedLadder) -> Picture | None:
    """Draw a number of every member over the swept parameters, with the decisive one marked; None without a sweep."""
    record = lead.record
    keys = sweep_layout.keys(record)
    found = _number(lead) if keys else None
    if found is None:
        return None
    name, text, values = found
    layout = sweep_layout.layout_of(record)
    hollow = np.zeros(values.shape, np.bool_)
    if isinstance(layout, Along):
        if name == "amplitude":
            hollow = finest_level.unsettled(record)[lead.scheme]
        ax = _curves(lead, layout, values, text, hollow)
    elif isinstance(layout, Grid):
        ax = _map(lead, layout, values, text)
    else:
        ax = _dots(lead, max(keys, key=lambda key: key.distinct.size), values, text)
    known, every = int(np.isfinite(values).sum()), record.count
    count = words.number(every, "integer")
    if known < every:
        count = f"{words.number(known, 'integer')} of {count}"
    is_marked = math.isfinite(values[lead.case])
    return Picture(
        "hero_response",
        f"{words.PAGE.opening(name)} in {count} members",
        f"Each member is one run of the sweep{', at its finest level' * ('level' not in name)}."
        + f" The others have no {name}." * (known < every)
        + f" Hollow: not settled; {finest_level.SWINGS}." * bool(hollow.any())
        + " The ring is the hardest member." * is_marked,
        f"{name} of every member over the swept parameters",
        ax.get_figure(root=True),
    )


def _number(lead: CheckedLadder) -> tuple[str, str, Floats] | None:
    """Return name, label and values, shape (case,), of the first number that differs between members.

    The number that decides comes first, then period and amplitude, those of checks first, then the error of the finest
    level.
    """
    record = lead.record
    scheme, check = lead.scheme, lead.measured
    if check is not None and check.kind == "value":
        values = field_values(record, lead.entry["id"], "value")[scheme]
        if finest_level.varies(values):
            name, alone = of_a_member(check, record.experiment.levels[-1])
            return name, style.label(name, record.unit_of_number(alone)), values
    checked = [check.value for check in choice.asked_values(record)]
    usual = ["period", "amplitude"]
    usual = usual if record.model.conservative else usual[::-1]
    for name in [*(name for name in checked if name in usual), *usual]:
        if name in record:
            values = finest_level.measured(record, name).value[scheme]
            if finest_level.varies(values):
                return name, style.label(name, record.unit(name)), values
    error, text = finest_level.error(record, lead.quantity).best[scheme], f"error of {lead.letter}"
    if not finest_level.varies(error):
        return None
    return text, style.label(text, lead.norm_unit()), error


def _scaled(ax: Axes, values: Floats) -> None:
    """Fit the vertical axis, logarithmic if positive values span decades."""
    if style.spans_decades(values, WIDE_RATIO):
        style.log_axis(ax, "y", *style.log_limits(values), most=5)
    else:
        ax.set_ylim(*style.limits(values))


def _across(ax: Axes, key: sweep_layout.Key) -> None:
    """Give the horizontal axis the range, scale, words and label of a key."""
    if not key.is_log:
        ax.set_xlim(*style.limits(key.distinct, margin=0.02))
    key_axis(ax, key, 0.02, most=5)


def _curves(lead: CheckedLadder, along: Along, values: Floats, text: str, hollow: Flags) -> Axes:
    """Draw curves over the key, with `hollow` markers for some members; few values are not joined."""
    ax = _panel(LEFT, text)
    for i, (name, cases) in enumerate(along.lines):
        x, y = along.key.values[cases], values[cases]
        few: dict[str, Any] = {"markersize": 3.5} if x.size <= 40 else {"marker": ""}
        look = style.look(i) | few | {"linewidth": 1.6}
        if along.key.distinct.size < sweep_layout.FEWEST_OF_A_LINE:
            look |= {"linestyle": "none", "markersize": 5}
        ax.plot(x, y, **look, label=name or None)
        shown = hollow[cases]
        ring_look = style.look(i) | {"linestyle": "none", "markersize": 3.5}
        ax.plot(x[shown], y[shown], **ring_look | {"markerfacecolor": "white"})
    _across(ax, along.key)
    _scaled(ax, values)
    _mark(ax, along.key.values, values, lead)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(loc="best", fontsize=8, handlelength=1.8)
    return ax


def _map(lead: CheckedLadder, grid: Grid, values: Floats, text: str) -> Axes:
    from matplotlib.colors import LogNorm, Normalize

    ax = _panel(LEFT, text, right=0.95)
    known, is_log = style.finite(values), style.spans_decades(values)
    ends = float(known.min()), float(known.max())
    norm = LogNorm(*ends) if is_log else Normalize(*ends)
    table = np.ma.masked_invalid(grid.worst(values))
    mesh = ax.pcolormesh(*grid.borders, table, cmap="viridis", norm=norm, rasterized=True)
    _across(ax, grid.x)
    if grid.y.is_log:
        style.log_axis(ax, "y", float(grid.borders[1][0]), float(grid.borders[1][-1]), most=5)
    if grid.y.words:
        ax.set_yticks(grid.y.distinct, grid.y.words)
    _name(ax, f"{text} over {grid.x.name} and {grid.y.name}")
    ax.set_ylabel(grid.y.label)
    ax.grid(visible=False)
    inside = ax.inset_axes((1.03, 0.0, 0.035, 1.0))
    bar = ax.figure.colorbar(mesh, cax=inside)
    inside.grid(visible=False)
    if is_log:
        style.log_ticks(bar.ax.yaxis, *ends, most=5)
    _mark(ax, grid.x.values, grid.y.values, lead, on_map=True)
    return ax


def _dots(lead: CheckedLadder, key: sweep_layout.Key, values: Floats, text: str) -> Axes:
    ax, is_many = _panel(LEFT, text), values.size > 500
    ax.plot(key.values, values, ".", color=style.COLOURS[0], markersize=3, rasterized=is_many)
    _across(ax, key)
    _scaled(ax, values)
    _mark(ax, key.values, values, lead)
    return ax


def _mark(ax: Axes, x: Floats, y: Floats, lead: CheckedLadder, *, on_map: bool = False) -> None:
    """Draw a ring around the decisive member, and explain it above the axes, where it hides no curve."""
    case = lead.case
    if ring(ax, float(x[case]), float(y[case]), on_map=on_map):
        _name(ax, f"{ax.get_title(loc='left')} · ring: hardest member")


def orders(lead: CheckedLadder) -> Picture | None:
    """Draw the stated orders of all members: dots over the key with most values, or a histogram of many."""
    record = lead.record
    keys, quantity, scheme = sweep_layout.keys(record), lead.quantity, lead.scheme
    if not keys or not record.triples:
        return None
    order, low, high = (part[scheme] for part in record.stated_orders(quantity, lead.norm))
    known = np.isfinite(order)
    if not known.any():
        return None
    promised = record.formal_orders(quantity)[scheme]
    allowed = choice.tolerance(record, quantity, record.schemes[scheme])
    checked = about_members(record, lead.measured if lead.is_on_order else None)
    bands = [(x - allowed, x + allowed) for x in np.unique(promised[np.isfinite(promised)])]
    # the picture shows twice the tolerance; orders far outside are drawn at its edge
    around = np.array([(a - allowed, b + allowed) for a, b in bands]) if bands else order[known]
    shown, bottom, top = np.clip([order, low, high], around.min() - 1.0, around.max() + 1.0)
    limits = style.limits(shown[known], around.ravel())
    text = f"observed order of {lead.letter}"
    if order.size > FEW:
        ax, bars = _panel(RIGHT, "members (logarithmic)"), ""
        borders = np.linspace(*limits, 41)
        parts = [shown[known & checked], shown[known & ~checked]]
        colours = [style.COLOURS[0], style.PALE]
        ax.hist(parts, borders.tolist(), color=colours, stacked=True, zorder=2)
        for band in bands:
            ax.axvspan(*band, **style.ALLOWED)
        most = float(np.histogram(shown[known], borders)[0].max())
        style.log_axis(ax, "y", 0.7, 2.0 * most, most=5)
        ax.set_xlabel(text)
    else:
        ax, bars = _panel(RIGHT, text), "; the bars are the 95 % intervals of the orders"
        key = max(keys, key=lambda one: one.distinct.size)
        for band in bands:
            ax.axhspan(*band, **style.ALLOWED)
        for part, colour in ((~checked, style.PALE), (checked, style.COLOURS[0])):
            x = key.values[part]
            ax.vlines(x, bottom[part], top[part], color=colour, linewidth=1.6, alpha=0.5)
            ax.plot(x, shown[part], ".", color=colour, markersize=4)
        _across(ax, key)
        ax.set_ylim(*limits)
        _mark(ax, key.values, shown, lead)
    # as in a verdict, the interval counts if there is one
    reaches = (np.fmin(order, low) <= promised + allowed) & (
        np.fmax(order, high) >= promised - allowed
    )
    missing = words.number(int(np.sum(~known)), "integer")
    return Picture(
        "hero_orders",
        _title_of_orders(known & reaches, np.abs(order - promised) <= allowed, checked),
        f"The band is what the tolerance allows around the promised order{bars}."
        + f" {missing} members have no order and are left out." * (not known.all())
        + " The check does not ask about the grey members." * (not checked.all()),
        f"Observed orders of {lead.name} of all members",
        ax.get_figure(root=True),
    )


def _title_of_orders(inside: Flags, measured: Flags, checked: Flags) -> str:
    """Say how many members have an order or an interval in the band; `measured` are those with the order itself."""
    counts = (inside[checked].sum(), checked.sum(), np.sum(~checked))
    within, of, others = (words.number(int(count), "integer") for count in counts)
    if not checked.all():
        return f"{within} of {of} members asked about are in the band; grey: the {others} others"
    if not inside.all():
        return f"{within} of {of} members {'has' if within == '1' else 'have'} an order in the band"
    beyond = int(np.sum(~measured))
    if not beyond:
        return "All members keep their order"
    outside = f"{words.number(beyond, 'integer')} of {of} orders"
    if beyond == 1:
        return f"{outside} is outside the band, but its interval overlaps it"
    return f"{outside} are outside the band, but their intervals overlap it"
