"""A figure the size of a stamp for the index: the rescaled differences, without axes."""

from __future__ import annotations

from vibsim.report import style
from vibsim.report.data import Floats
from vibsim.report.figures import drawing
from vibsim.report.figures.panels import Curve

SIZE = (136, 64)
"""Width and height [pixel]."""


def draw(t: Floats, curves: list[Curve]) -> str:
    """Return an SVG document with every sound curve as one line."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(SIZE[0] / 96.0, SIZE[1] / 96.0))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    whole = [curve for curve in curves if curve.is_whole] or curves
    sound = [curve for curve in whole if curve.sound] or whole
    for i, curve in enumerate(sound):
        width = 2.4 - 1.6 * i / max(1, len(sound) - 1)
        x, y = style.thin(t, curve.values, SIZE[0] // 2)
        ax.plot(x, y, color=style.look(i)["color"], linewidth=width)
    ax.set_xlim(float(t[0]), float(t[-1]) if t[-1] > t[0] else float(t[0]) + 1.0)
    ax.set_ylim(*style.limits(*(curve.values for curve in sound), margin=0.1))
    ax.set_axis_off()
    return drawing.svg(figure, "thumbnail")
