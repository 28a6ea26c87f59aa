"""Work and precision: the error against steps, evaluations of the force and estimated time.

Source: E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, section II.10 (diagrams of
error against work); vibration text, exercise 4.
"""

from __future__ import annotations

import numpy as np

from vibsim.core.record import Record
from vibsim.report import style
from vibsim.report.choice import position
from vibsim.report.data import case_name, known, unit
from vibsim.report.figures.panels import legend_above, rows_of
from vibsim.report.style import Picture
from vibsim.report.tables.work import Line, lines
from vibsim.report.text import words
from vibsim.report.types import Axes, Experiment


def precision(experiment: Experiment, record: Record, case: int) -> Picture | None:
    """Draw the error against steps, evaluations and time; None for fewer than two lines with several points."""
    found = lines(experiment, record, case)
    if sum(line.error.size > 1 for line in found) < 2:
        return None
    figure, axes = rows_of(3, [(0.675 + 2.835 * i, 2.565) for i in range(3)], 3.1, 0.4, 0.55)
    for ax in axes[1:]:
        ax.sharey(axes[0])
    floor = float(known(record, "work_reference_error", ("case",))[case])
    for k, ax in enumerate(axes):
        for i, line in enumerate(found):
            look = style.look(i) | {"markersize": 4.5, "linewidth": 1.0}
            look |= {"markerfacecolor": "white"} if line.is_adaptive else {}
            ax.plot(line.work[k], style.no_zeros(line.error), label=style.entry(line.name), **look)
        if floor > 0.0:
            ax.axhline(floor, color=style.GREY, linestyle=":", label="error of the reference")
    _ranges(axes, found)
    letter = words.symbol(position(experiment))
    axes[0].set_ylabel(style.label(f"largest error of {letter}", unit(record, "work_error")))
    for ax, text in zip(axes, ("steps", "force evaluations", "estimated time [s]"), strict=True):
        ax.set_xlabel(text)
    for ax in axes[1:]:
        ax.tick_params(labelleft=False)
    legend_above(figure, axes[0])
    name, is_adaptive = (
        words.swept(case_name(record, case)),
        any(line.is_adaptive for line in found),
    )
    return Picture(
        name=f"work_precision_{case}",
        title=f"Work and precision{f': {name}' if name else ''}",
        caption=style.sentences(
            "Lower left is better: a small error for little work. The slope of a line is minus the order, until "
            "round-off.",
            "Hollow: adaptive methods over their tolerances." if is_adaptive else "",
            "Below the dotted line the reference is no better than the solution."
            if floor > 0.0
            else "",
            "Of an implicit scheme the evaluations of one iteration per step are counted. The time is that of the cost "
            "model: one compiled member alone, and SciPy's own pace for adaptive methods.",
        ),
        alt="Largest error against steps, force evaluations and estimated time, all axes logarithmic",
        figure=figure,
    )


def _ranges(axes: list[Axes], found: list[Line]) -> None:
    errors = style.finite(*(line.error[line.error > 0.0] for line in found))
    if errors.size:
        # an unstable level has an error without bound, which would hide all others
        high = min(float(errors.max()), 1e3 * float(np.quantile(errors, 0.75)))
        style.log_axis(axes[0], "y", float(errors.min()) / 3.0, 3.0 * high)
    for k, ax in enumerate(axes):
        style.fit_log_axis(ax, "x", *(line.work[k] for line in found), room=1.5, most=5)
