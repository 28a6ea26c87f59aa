"""What a part of the benchmarks hands back, and how it is written."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil, floor, log10


@dataclass(frozen=True)
class Section:
    """One part: its tables as Markdown, and the figures that the table of targets asks for."""

    lines: tuple[str, ...]
    figures: Mapping[str, float] = field(default_factory=dict)
    problems: tuple[str, ...] = ()
    """What went wrong without stopping the part."""


def attempt(
    problems: list[str], name: str, measure: Callable[[], tuple[list[str], dict[str, float]]]
) -> tuple[list[str], dict[str, float]]:
    """Return tables and figures of `measure`; where it fails, note that and go on without."""
    try:
        return measure()
    except Exception as error:
        traceback.print_exc()
        problems.append(f"{name}: {type(error).__name__}: {error}")
        return [f"{name}: not measured: {_cell(str(error))}", ""], {}


def gather(measures: Mapping[str, Callable[[], tuple[list[str], dict[str, float]]]]) -> Section:
    """Return one section of several groups of tables, each of which may fail without the others."""
    lines: list[str] = []
    figures: dict[str, float] = {}
    problems: list[str] = []
    for name, measure in measures.items():
        found = attempt(problems, name, measure)
        lines += found[0]
        figures |= found[1]
    return Section(tuple(lines), figures, tuple(problems))


def table(caption: str, header: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    """Return a caption and a table; every column but the first is set to the right."""
    lines = [caption, "", f"| {' | '.join(header)} |"]
    lines.append("|" + "|".join(["---", *["---:"] * (len(header) - 1)]) + "|")
    lines += [f"| {' | '.join(map(_cell, row))} |" for row in rows]
    return [*lines, ""]


def _cell(value: object) -> str:
    """Write a number with three digits, and text as it is; what is in no cell is not measured."""
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 1e3 else f"{value:.0f}"
    return str(value).replace("|", "/").replace("\n", " ")


def chart(title: str, unit: str, rows: Mapping[str, Sequence[tuple[float, float]]]) -> str:
    """Return curves over one logarithmic axis each way as SVG; the legend is at the end of each curve."""
    width, height, left, top, right, bottom = 640, 320, 70, 40, 190, 45
    points = [point for curve in rows.values() for point in curve]
    low_x, high_x = (f(log10(x)) for f, x in ((floor, min(points)[0]), (ceil, max(points)[0])))
    low_y = floor(log10(min(y for _, y in points)))
    high_y = max(ceil(log10(max(y for _, y in points))), low_y + 1)

    def place(x: float, y: float) -> str:
        across = left + (log10(x) - low_x) / max(high_x - low_x, 1) * (width - left - right)
        up = (log10(y) - low_y) / (high_y - low_y) * (height - top - bottom)
        return f"{across:.1f},{height - bottom - up:.1f}"

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">',
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
        f'<text x="{left}" y="20" font-size="14">{title}</text>',
        f'<text x="{left}" y="{top - 6}" fill="#555">{unit}</text>',
    ]
    for power in range(low_x, high_x + 1):
        x, y = place(10.0**power, 10.0**low_y).split(",")
        parts.append(f'<text x="{x}" y="{float(y) + 18}" text-anchor="middle">1e{power}</text>')
    for power in range(low_y, high_y + 1):
        x, y = place(10.0**low_x, 10.0**power).split(",")
        parts.append(
            f'<line x1="{x}" x2="{width - right}" y1="{y}" y2="{y}" stroke="#ddd"/>'
            f'<text x="{left - 8}" y="{float(y) + 4}" text-anchor="end">1e{power}</text>'
        )
    for colour, (name, curve) in zip(("#06c", "#c30", "#283", "#a6a"), rows.items(), strict=False):
        path = " ".join(place(*point) for point in curve)
        x, y = place(*curve[-1]).split(",")
        parts.append(
            f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"/>'
            f'<text x="{float(x) + 8}" y="{float(y) + 4}" fill="{colour}">{name}</text>'
        )
    return "\n".join([*parts, "</svg>", ""])
