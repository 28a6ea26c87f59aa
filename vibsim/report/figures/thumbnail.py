"""A figure the size of a stamp for the index: the rescaled differences, without axes."""

from __future__ import annotations

import numpy as np

from vibsim.report import style
from vibsim.report.data import Floats
from vibsim.report.figures.panels import Curve

SIZE = (136, 64)
"""Width and height [pixel]."""


def draw(t: Floats, curves: list[Curve]) -> str:
    """Return an SVG document with every sound curve as one line."""
    width, height = SIZE
    whole = [curve for curve in curves if curve.is_whole] or curves
    sound = [curve for curve in whole if curve.sound] or whole
    low, high = style.limits(*(curve.values for curve in sound), margin=0.1)
    lines = []
    for i, curve in enumerate(sound):
        x, y = style.thin(t, curve.values, width // 2)
        keep = np.isfinite(y)
        across = (x[keep] - t[0]) / ((t[-1] - t[0]) or 1.0) * width
        up = height * (1 - (y[keep] - low) / (high - low))
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, up, strict=True))
        stroke = 3.2 - 2.2 * i / max(1, len(sound) - 1)
        lines.append(
            f'<polyline fill="none" stroke="{style.look(i)["color"]}" stroke-width="{stroke:.1f}" points="{points}"/>'
        )
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
    return "\n".join([head, *lines, "</svg>\n"])
