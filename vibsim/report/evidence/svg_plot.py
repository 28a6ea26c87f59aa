"""Small pictures drawn as SVG by hand: a frame, a scale, points, lines and bands, and little text.

They stand inside the words of a verdict, many to a page; a plotting library would take 50 ms and 10 kB for each.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LEFT, TOP, BOTTOM = 58, 18, 30
"""Room around the frame for words and numbers [pixel]."""
INK, SOFT, LINE, BAND = "#1b1b1b", "#555555", "#c8c8c8", "#e4e4e4"
GAP = 22.0
"""Between two panels [pixel]."""
SIZE = 11
"""Of letters [pixel]."""


@dataclass
class Panel:
    """A frame with linear scales, into which things are drawn one after the other."""

    x: tuple[float, float]
    y: tuple[float, float]
    width: float = 240.0
    height: float = 96.0
    """Of the frame [pixel]."""
    parts: list[str] = field(default_factory=list)

    @property
    def whole(self) -> tuple[float, float]:
        """Width and height with the room around the frame."""
        return LEFT + self.width + 14, TOP + self.height + BOTTOM

    def across(self, x: float) -> float:
        """Return the place of x [pixel]."""
        low, high = self.x
        return LEFT + (x - low) / ((high - low) or 1.0) * self.width

    def up(self, y: float) -> float:
        """Return the place of y, no farther than the frame."""
        low, high = self.y
        share = min(max((y - low) / ((high - low) or 1.0), 0.0), 1.0)
        return TOP + self.height * (1.0 - share)

    def inside(self, y: float) -> bool:
        """Say whether a value lies within the frame."""
        return self.y[0] <= y <= self.y[1]

    def band(
        self, low: float, high: float, first: float, last: float, colour: str, opacity: float = 1.0
    ) -> None:
        """Fill the values from `low` to `high` between two places."""
        a, b = self.across(first), self.across(last)
        top, bottom = self.up(high), self.up(low)
        thick = max(bottom - top, 1.0)
        self.parts.append(
            f'<rect x="{a:.1f}" y="{top:.1f}" width="{b - a:.1f}" height="{thick:.1f}" fill="{colour}" '
            f'fill-opacity="{opacity:g}"/>'
        )

    def level(self, y: float, dashed: bool = True, colour: str = INK) -> None:
        """Draw a line at a value."""
        if self.inside(y):
            dash = ' stroke-dasharray="4 3"' if dashed else ""
            a, b = self.across(self.x[0]), self.across(self.x[1])
            self.parts.append(
                f'<path d="M{a:.1f} {self.up(y):.1f}H{b:.1f}" stroke="{colour}"{dash} fill="none"/>'
            )

    def curve(
        self, x: Floats, y: Floats, colour: str, width: float = 1.4, dashed: bool = False
    ) -> None:
        """Draw a line through the finite points."""
        pairs = zip(x, y, strict=True)
        found = [f"{self.across(a):.1f},{self.up(b):.1f}" for a, b in pairs if math.isfinite(b)]
        dash = ' stroke-dasharray="4 3"' if dashed else ""
        if found:
            self.parts.append(
                f'<polyline points="{" ".join(found)}" fill="none" stroke="{colour}" stroke-width="{width:g}"{dash}/>'
            )

    def points(self, x: Sequence[float], y: Floats, filled: Sequence[bool], colour: str) -> None:
        """Draw dots, hollow ones that do not count; those beyond the frame become triangles on its edge."""
        for a, b, is_full in zip(x, y, filled, strict=True):
            if not math.isfinite(b):
                continue
            place, height = self.across(a), self.up(b)
            fill = colour if is_full else "white"
            style = f'fill="{fill}" stroke="{colour}" stroke-width="1.3"'
            if self.inside(b):
                self.parts.append(f'<circle cx="{place:.1f}" cy="{height:.1f}" r="3.4" {style}/>')
            else:
                tip = -5 if b > self.y[1] else 5
                self.parts.append(
                    f'<path d="M{place - 4:.1f} {height - tip:.1f}h8l-4 {tip}z" {style}/>'
                )

    def word(
        self,
        x: float,
        y: float,
        text: str,
        anchor: str = "middle",
        colour: str = SOFT,
        halo: bool = False,
    ) -> None:
        """Write a text at a place in the picture [pixel], with a white border where lines may cross it."""
        border = ' stroke="white" stroke-width="3" paint-order="stroke"' if halo else ""
        self.parts.append(
            f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}"{border}>{escape(text)}</text>'
        )

    def frame(
        self,
        title: str,
        x_name: str,
        x_ticks: Iterable[tuple[float, str]],
        y_ticks: Iterable[tuple[float, str]],
    ) -> None:
        """Draw the frame with its title, the name of its x axis, and ticks."""
        left, right = self.across(self.x[0]), self.across(self.x[1])
        base = TOP + self.height
        self.parts.append(
            f'<path d="M{left:.1f} {TOP}V{base:.1f}H{right:.1f}" stroke="{SOFT}" fill="none"/>'
        )
        self.word(left, TOP - 6, title, "start", INK)
        for value, text in x_ticks:
            if self.x[0] <= value <= self.x[1]:
                self.word(self.across(value), base + 13, text)
        self.word((left + right) / 2, base + 26, x_name)
        for value, text in y_ticks:
            if self.inside(value):
                self.parts.append(
                    f'<path d="M{left - 4:.1f} {self.up(value):.1f}h4" stroke="{SOFT}"/>'
                )
                self.word(left - 7, self.up(value) + 4, text, "end")


def document(panels: Sequence[Panel], label: str) -> str:
    """Return the SVG of panels side by side, with a text for those who do not see it."""
    width, height = 0.0, 0.0
    groups = []
    for panel in panels:
        groups.append(f'<g transform="translate({width:g} 0)">{"".join(panel.parts)}</g>')
        width, height = width + panel.whole[0] + GAP, max(height, panel.whole[1])
    width -= GAP
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="{width:g}" '
        f'height="{height:g}" font-size="{SIZE}" role="img" aria-label="{escape(label)}">'
    )
    return "".join([head, *groups, "</svg>"])
