"""Work and precision: the error against steps, force evaluations and estimated time, as figure and as table.

Source: E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, section II.10 (diagrams of
error against work); vibration text, exercise 4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.experiment.cost import ONE_SECONDS
from vibsim.report import style, words
from vibsim.report.data import Member, Results
from vibsim.report.figures.panels import legend_above, rows_of
from vibsim.report.style import Picture
from vibsim.report.tables.table import Cell, Column, Table
from vibsim.report.types import Axes


def precision(record: Results, case: int) -> Picture | None:
    """Draw the error against steps, evaluations and time; None for fewer than two lines with several points."""
    drawn = lines(record, case)
    if sum(line.error.size > 1 for line in drawn) < 2:
        return None
    figure, axes = rows_of(3, [(0.675 + 2.835 * i, 2.565) for i in range(3)], 3.1, 0.4, 0.55)
    for ax in axes[1:]:
        ax.sharey(axes[0])
    floor = float(record.optional("work_reference_error", ("case",))[case])
    for k, ax in enumerate(axes):
        for i, line in enumerate(drawn):
            look = style.look(i) | {"markersize": 4.5, "linewidth": 1.0}
            look |= {"markerfacecolor": "white"} if line.is_adaptive else {}
            ax.plot(line.work[k], style.no_zeros(line.error), label=style.entry(line.name), **look)
        if floor > 0.0:
            ax.axhline(floor, color=style.GREY, linestyle=":", label="error of the reference")
    _ranges(axes, drawn)
    text = f"largest error of {words.symbol(record.model.position)}"
    axes[0].set_ylabel(style.label(text, record.unit("work_error")))
    for ax, text in zip(axes, ("steps", "force evaluations", "estimated time [s]"), strict=True):
        ax.set_xlabel(text)
    for ax in axes[1:]:
        ax.tick_params(labelleft=False)
    legend_above(figure, axes[0])
    name = words.swept(record.case_name(case))
    return Picture(
        name=f"work_precision_{case}",
        title=f"Work and precision{f': {name}' if name else ''}",
        caption=style.sentences(
            "Lower left is better: a small error for little work. The slope of a line is minus the order, until "
            "round-off.",
            "Hollow: adaptive methods over their tolerances."
            * any(line.is_adaptive for line in drawn),
            "Below the dotted line the reference is no better than the solution." * (floor > 0.0),
            "Of an implicit scheme the evaluations of one iteration per step are counted. The time is that of the cost "
            "model: one compiled member alone, and SciPy's own pace for adaptive methods.",
        ),
        alt="Largest error against steps, force evaluations and estimated time, all axes logarithmic",
        figure=figure,
    )


def _ranges(axes: list[Axes], lines: list[Line]) -> None:
    errors = style.finite(*(line.error[line.error > 0.0] for line in lines))
    if errors.size:
        # the unbounded error of an unstable level would hide all others
        high = min(float(errors.max()), 1e3 * float(np.quantile(errors, 0.75)))
        style.log_axis(axes[0], "y", float(errors.min()) / 3.0, 3.0 * high)
    for k, ax in enumerate(axes):
        style.fit_log_axis(ax, "x", *(line.work[k] for line in lines), room=1.5, most=5)


@dataclass(frozen=True)
class Line:
    """The points of one scheme over its levels, or of one adaptive method over its tolerances, coarse to fine."""

    name: str
    labels: tuple[str, ...]  # level or tolerance of every point
    work: tuple[Floats, Floats, Floats]  # steps, force evaluations, estimated time [s]
    error: Floats
    is_adaptive: bool = False


def lines(record: Results, case: int) -> list[Line]:
    """Return the lines of a member; empty if the analysis stored no work."""
    if "work_error" not in record:
        return []
    drawn, families = [], dict[str, list[int]]()
    for s, spec in enumerate(record.experiment.schemes):
        if spec.adaptive:
            families.setdefault(spec.kind, []).append(s)
        else:
            drawn.append(_over_levels(record, s, case))
    drawn += [_over_tolerances(record, kind, s, case) for kind, s in families.items()]
    return [line for line in drawn if line.error.size]


def _over_levels(record: Results, s: int, case: int) -> Line:
    member = Member(s, case, record.experiment.schemes[s].name)
    steps, forces, error = _numbers(record, member)
    keep = np.isfinite(error) & np.isfinite(steps)
    labels = tuple(f"level {level}" for level in np.array(record.levels)[keep])
    steps, forces, error = steps[keep], forces[keep], error[keep]
    return Line(member.scheme_name, labels, (steps, forces, forces * ONE_SECONDS), error)


def _over_tolerances(record: Results, kind: str, schemes: list[int], case: int) -> Line:
    """Return the points of the schemes of one adaptive kind, from the loosest tolerance to the tightest."""
    from vibsim.schemes.adaptive import seconds

    periods = record.natural_frequency(case) * float(record.ends[case]) / math.tau
    rows = []
    for s in schemes:
        tolerance = float(record.experiment.schemes[s].options["tolerance"])
        steps, forces, error = (part[-1] for part in _numbers(record, Member(s, case, "")))
        rows.append((-tolerance, steps, forces, seconds(kind, tolerance, periods), error))
    table = np.array(sorted(row for row in rows if np.isfinite(row).all())).reshape(-1, 5)
    labels = tuple(f"tolerance {-float(value):g}" for value in table[:, 0])
    return Line(kind, labels, (table[:, 1], table[:, 2], table[:, 3]), table[:, 4], True)


def _numbers(record: Results, member: Member) -> tuple[Floats, Floats, Floats]:
    names = "work_steps", "work_force_evaluations", "work_error"
    steps, forces, error = (record.at(name, member) for name in names)
    return steps, forces, error


def table(record: Results) -> Table | None:
    """Return error and work of the first member for every scheme and level, or tolerance; None without such data."""
    drawn = lines(record, 0)
    if len(drawn) < 2:
        return None
    columns = (
        Column("scheme"), Column("level or tolerance"), Column("steps", form="integer"),
        Column("force evaluations", form="integer"), Column("estimated time", "s", "small"),
        Column("largest error", record.unit("work_error"), "small"),
    )  # fmt: skip
    rows: list[tuple[Cell, ...]] = [
        (line.name, label, *(float(part[i]) for part in line.work), float(line.error[i]))
        for line in drawn
        for i, label in enumerate(line.labels)
    ]
    name = record.case_name(0)
    caption = (
        f"Work and precision of {words.symbol(record.model.position)}{f', {name}' if name else ''}"
        "; force evaluations of an implicit scheme are those of one iteration per step"
    )
    return Table("work_precision", caption, columns, tuple(rows))
