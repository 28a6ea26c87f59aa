"""What a picture of a verdict holds: its dots, lines, bands and words, in numbers of its axes."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.text import Text

from vibsim.report import style

BLUE, ORANGE = style.COLOURS[:2]
Places = list[tuple[float, float]]


def texts(picture: Any) -> list[str]:
    """Return every word of a picture, labels of ticks included, which are made where somebody asks for them."""
    for ax in picture.figure.axes:
        ax.get_xticklabels(), ax.get_yticklabels()
    return [text.get_text() for text in picture.figure.findobj(Text)]


def _lines(picture: Any, axes: int | None) -> list[Any]:
    chosen = picture.figure.axes if axes is None else [picture.figure.axes[axes]]
    return [line for ax in chosen for line in ax.lines]


def marks(
    picture: Any, face: str | None = None, axes: int | None = None, kinds: str = "o^v"
) -> Places:
    """Return dots, and triangles at an edge, from left to right: all, or those of one face colour."""
    found = [
        tuple(map(float, place))
        for line in _lines(picture, axes)
        if line.get_marker() in set(kinds) and face in (None, line.get_markerfacecolor())
        for place in np.column_stack(line.get_data())
    ]
    return sorted(found)


def dots(picture: Any, face: str | None = None, axes: int | None = None) -> Places:
    """Return the places of dots, from left to right."""
    return marks(picture, face, axes, "o")


def curves(picture: Any, colour: str | None = None, axes: int | None = None) -> list[Any]:
    """Return solid lines."""
    return [
        line
        for line in _lines(picture, axes)
        if line.get_linestyle() == "-"
        and colour in (None, line.get_color())
        and len(line.get_xdata())
    ]


def bars(picture: Any) -> list[tuple[float, float, float]]:
    """Return the left end, the height and the right end of the wide bars that are drawn."""
    found = []
    for line in curves(picture, ORANGE):
        (left, right), (low, high) = line.get_data()
        assert low == high or np.isnan([low, high]).all()
        found.append((float(left), float(low), float(right)))
    return [bar for bar in found if np.isfinite(bar[1])]


def borders(picture: Any) -> list[float]:
    """Return the heights of the dashed horizontal lines, panel by panel."""
    return [
        float(line.get_ydata()[0])
        for line in _lines(picture, None)
        if line.get_linestyle() == "--" and len(set(line.get_ydata())) == 1
    ]
