"""The picture of note [hpl 3]: which faults in the numerical method each of the three solutions catches."""

from __future__ import annotations

from vibsim.report.figures import drawing
from vibsim.report.style import COLOURS, GREY, MARKERS, applied, canvas

ROW, MARGIN = 0.2, 0.9
"""Heights of a row, and of what stands above and below all rows [inch]."""


def matrix(faults: list[str], caught: dict[str, list[bool]]) -> str:
    """Draw a mark in the row of each fault and the column of each test that catches it, as SVG."""
    with applied():
        figure = canvas(MARGIN + ROW * len(faults))
        axes = figure.add_axes((0.45, 0.01, 0.53, 1.0 - MARGIN / (MARGIN + ROW * len(faults))))
        for column, (name, marks) in enumerate(caught.items()):
            rows = [row for row, is_caught in enumerate(marks) if is_caught]
            look = {"color": COLOURS[column], "marker": MARKERS[column], "markersize": 6.0}
            axes.plot([column] * len(rows), rows, linestyle="none", **look)
            total = f"{name}\n{len(rows)} of {len(marks)}"
            axes.text(column, -0.9, total, ha="center", va="bottom", fontsize=9.0)
        axes.set_xlim(-0.5, len(caught) - 0.5)
        axes.set_ylim(len(faults) - 0.5, -0.6)
        axes.set_xticks(range(len(caught)), [""] * len(caught))
        axes.set_yticks(range(len(faults)), faults)
        axes.tick_params(colors=GREY, labelcolor="black", length=0.0)
        return drawing.svg(figure, "faults")
