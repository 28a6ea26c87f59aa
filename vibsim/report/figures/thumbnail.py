"""The thumbnail of an experiment for the index: a map, a response curve, a path in the plane, or the solution.

It is a small hand-written SVG with the colours of the page for light and dark.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import MEMBER
from vibsim.report import data, finest_level, frame, style, sweep_layout
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.figures import moments
from vibsim.report.sweep_layout import Along, Grid

WIDTH, HEIGHT = 240.0, 96.0
EDGE = 5.0  # free space around curves
CURVES = 3  # most curves in one picture
CELLS = 48, 24  # most cells of a map across and up
SHADES = 7  # colours of a map
FLAT = 1e-2  # smallest relative variation of a number that is drawn as curve or map
STRAIGHT = 0.99  # share of the variation of a path along one line from which it counts as straight
WIDE = 1e3  # ratio of largest value to median above which the scale is logarithmic
BEYOND = 1.5  # solutions beyond this multiple of the smallest of them are cut off
NUMBERS = ("amplitude", "period", "growth_per_period")
"""Candidates for a response curve or map: the first that varies; for conservative motions the period comes first."""

_STYLE = (
    ":root{color-scheme:light dark}path{fill:none;stroke-width:1.8;stroke-linejoin:round;stroke-linecap:round}"
    ".c0{stroke:#0072b2}.c1{stroke:#d55e00}.c2{stroke:#008a65}.map path{stroke:none}"
    "@media(prefers-color-scheme:dark){.c0{stroke:#5cb3e8}.c1{stroke:#ff8c42}.c2{stroke:#2fc597}}"
)
_ENDS = (68, 1, 84), (33, 145, 140), (253, 231, 37)
"""Colours of a map for the smallest, a middle and the largest value, as on the page."""

Lines = list[tuple[Floats, Floats]]


def thumbnail(record: Results, member: Member) -> str:
    """Return the thumbnail as an SVG document; without a response to a sweep it shows the motion of `member`."""
    layout, model = sweep_layout.layout_of(record), record.model
    names = sorted(NUMBERS, key="period".__ne__) if model.conservative else NUMBERS
    if isinstance(layout, Along) and (lines := _response(record, layout, names)):
        return document(lines)
    if isinstance(layout, Grid) and (cells := _map(record, layout, names, model.position)):
        return _document("".join(cells), "map")
    if record.is_lean:
        levels = np.array(record.levels, dtype=np.float64)
        norms = finest_level.norms(Ladder(record, model.position, member))
        return document([(levels, np.log10(norms))])
    ladders = [Ladder(record, row.name, member) for row in model.states[: model.coordinates]]
    series = [ladder.finest for ladder in ladders]
    reach = [_reach(values) for values in series]
    widest = int(np.argmax(reach))
    if len(series) == 2 and min(reach) > FLAT * reach[widest] and not _is_straight(*series):
        return document([(series[0], series[1])], is_equal=True)
    return document(_solutions(ladders[widest], layout))


def _reach(values: Floats) -> float:
    """Return the range of the finite values; 0 without any."""
    finite = style.finite(values)
    return float(np.ptp(finite)) if finite.size else 0.0


def _solutions(ladder: Ladder, layout: Along | Grid | None) -> Lines:
    """Return the finest level of some members along a line, else of each scheme; a single one also on the coarsest."""
    t, of = ladder.t, ladder.record.of_case(ladder.case)[:CURVES]
    if isinstance(layout, Along):
        cases = layout.lines[0][1]
        shown = cases[style.spaced(cases.size, CURVES)].tolist()
        of = [Member(ladder.scheme, case, "") for case in shown]
    of.reverse()
    series = [ladder.with_member(one).finest for one in of]
    if len(of) == 1:
        series = [ladder.on_level(0), ladder.finest]
    largest = [data.largest(values) for values in series if np.isfinite(values).all()]
    known = frame.sizes(ladder.record, ladder.quantity)
    lines = []
    for i, values in enumerate(series):
        size = float(known[of[i % len(of)].case])
        most = BEYOND * (size if np.isfinite(size) else min(largest, default=np.inf))
        lines.append((t, np.where(np.abs(values) <= most, values, np.nan)))
    first = moments.first_shown(t, lines[-1][1])
    return [(t[first:], values[first:]) for _, values in lines]


def _is_straight(x: Floats, y: Floats) -> bool:
    """Return whether a path in the plane is almost a straight line, which shows no motion."""
    known = np.isfinite(x) & np.isfinite(y)
    across, up = (values[known] - values[known].mean() for values in (x, y))
    both = np.sum(across * up)
    return bool(both * both > STRAIGHT * np.sum(across * across) * np.sum(up * up))


def _response(record: Results, along: Along, names: Sequence[str]) -> Lines:
    """Return a number over the swept key, one curve for each line of members; empty if no number varies."""
    key = along.key
    if key.distinct.size < sweep_layout.FEWEST_VALUES:
        return []
    for name in names:
        values = np.abs(record.optional(name, MEMBER, level=-1)[0])
        if is_telling(values):
            if data.largest(values) > WIDE * np.median(style.finite(values)):
                values = np.log10(style.no_zeros(values))
            x = np.log(key.values) if key.is_log else key.values
            # the first is on top, and has the first colour, as on the page
            return [(x[members], values[members]) for _, members in along.lines[CURVES - 1 :: -1]]
    return []


def _map(record: Results, grid: Grid, names: Sequence[str], position: str) -> list[str]:
    """Return the coloured cells of a map; empty if no number varies."""
    found = [np.abs(record.optional(name, MEMBER, level=-1)[0]) for name in names]
    found.append(np.log10(style.no_zeros(finest_level.error(record, position).best[0])))
    values = next((values for values in found if is_telling(values)), None)
    if values is None:
        return []
    table = grid.worst(values)
    steps = [-(-size // most) for size, most in zip(table.shape[::-1], CELLS, strict=True)]
    table = table[:: steps[1], :: steps[0]]
    low, high = np.quantile(style.finite(values), (0.02, 0.98))
    with np.errstate(invalid="ignore"):
        part = np.clip((table - low) / (high - low or 1.0), 0.0, 1.0)
        shade = np.where(np.isfinite(part), np.round(part * (SHADES - 1)), -1).astype(int)
    return list(_cells(shade))


def _cells(shade: NDArray[Any]) -> Iterator[str]:
    """Yield one path with all cells of each shade; the first row is at the bottom."""
    rows, columns = shade.shape
    width, height = WIDTH / columns, HEIGHT / rows
    for k in range(SHADES):
        parts = []
        for row in range(rows):
            there = np.flatnonzero(np.diff(np.concatenate([[0], shade[row] == k, [0]])))
            for begin, end in there.reshape(-1, 2).tolist():
                x, y = begin * width, HEIGHT - (row + 1) * height
                parts.append(f"M{x:.1f} {y:.1f}h{(end - begin) * width:.1f}v{height:.1f}H{x:.1f}z")
        if parts:
            place = k / (SHADES - 1) * (len(_ENDS) - 1)
            i = min(int(place), len(_ENDS) - 2)
            mixed = np.array(_ENDS[i]) + (place - i) * np.subtract(_ENDS[i + 1], _ENDS[i])
            red, green, blue = np.round(mixed).astype(int).tolist()
            yield f'<path style="fill:rgb({red},{green},{blue})" d="{"".join(parts)}"/>'


def is_telling(values: Floats) -> bool:
    """Return whether enough values are finite and vary enough to be drawn."""
    is_known = 2 * style.finite(values).size > values.size
    return bool(is_known and _reach(values) > FLAT * data.largest(values))


def document(lines: Lines, *, is_equal: bool = False) -> str:
    """Return curves without axes as an SVG document; the last one on top.

    With `is_equal` both directions have the same scale.
    """
    x, y = (style.finite(*(line[i] for line in lines)) for i in (0, 1))
    if not x.size or not y.size:
        return _document("")
    span = [_reach(values) or 1.0 for values in (x, y)]
    scale = [(WIDTH - 2 * EDGE) / span[0], (HEIGHT - 2 * EDGE) / span[1]]
    if is_equal:
        scale = [min(scale)] * 2
    middle = [0.5 * float(values.min() + values.max()) for values in (x, y)]
    paths = []
    for i, (across, up) in enumerate(lines):
        thinned = style.thin(across, up, int(WIDTH) // 2) if not is_equal else (across, up)
        horizontal = 0.5 * WIDTH + (thinned[0] - middle[0]) * scale[0]
        vertical = 0.5 * HEIGHT - (thinned[1] - middle[1]) * scale[1]
        colour = len(lines) - 1 - i
        paths.append(f'<path class="c{colour}" d="{outline(horizontal, vertical)}"/>')
    return _document("".join(paths))


def outline(x: Floats, y: Floats) -> str:
    """Return points as SVG path data, in tenths of a pixel, interrupted at points that are not finite."""
    parts, before, pen = [], "", "M"
    for across, up in zip(x.tolist(), y.tolist(), strict=True):
        if not (math.isfinite(across) and math.isfinite(up)):
            pen = "M"
            continue
        point = f"{across:.1f} {up:.1f}"
        if point != before or pen == "M":
            parts.append(pen + point)
        pen, before = "L", point
    return "".join(parts)


def _document(content: str, kind: str = "curves") -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {HEIGHT:g}">'
        f'<style>{_STYLE}</style><g class="{kind}">{content}</g></svg>\n'
    )
