"""The phase plane: velocity against position, level by level, with the exact orbit.

Source: vibration text, sections 5.5 and 7 (figures 6, 8 and 10). Velocities are divided by the natural frequency w, so
that the orbit of a linear oscillation is a circle.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.core.record import Record
from vibsim.report import style
from vibsim.report.data import Floats, Member, at, exact_periods, known, pick, times, unit, whole
from vibsim.report.figures.panels import legend_above, rows_of
from vibsim.report.style import Picture
from vibsim.report.text import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from vibsim.experiment import Experiment
    from vibsim.models import Model

ACROSS = 3
"""Panels in a row."""
MOST = 6
"""Most panels, and most schemes in them."""
CUT = 2.5
"""What leaves the exact orbit by more than this factor is cut off."""
PERIODS = 3.0
"""Of a longer motion the first period and the last so many are drawn."""
SAMPLED = 8
"""Fewer samples than this in a period do not draw an orbit."""


def plane(experiment: Experiment, record: Record, shown: list[Member]) -> Picture | None:
    """Draw the phase plane of the schemes shown, one panel per level; None where it would show nothing.

    A few schemes only, and series with samples enough in a period.
    """
    model = experiment.model.definition
    if not shown or len({member.scheme for member in shown}) > MOST:
        return None
    case = shown[0].case
    members = [member for member in shown if member.case == case]
    w = float(np.ravel(known(record, "natural_frequency", ("case",), case=case))[0])
    t = times(record, case)
    period = _period(record, case, w)
    if not math.isfinite(w) or w <= 0.0 or period < SAMPLED * float(t[1] - t[0]):
        return None
    levels = whole(record, "level")
    chosen = style.spaced(len(levels), MOST)
    columns = [(0.62 + 2.75 * i, 2.35) for i in range(ACROSS)]
    figure, axes = rows_of(len(chosen), columns, 2.35, 0.5, 0.45)
    size = _draw_exact(axes, record, model, case, w, t <= 1.02 * period)
    early, late = t <= t[0] + period, t >= t[-1] - PERIODS * period
    is_long = bool(t[-1] > (PERIODS + 1.0) * period)
    largest = 0.0
    for ax, i in zip(axes, chosen, strict=True):
        for k, member in enumerate(members):
            u, v = (of_level(record, name, member, i) for name in (model.position, model.velocity))
            look = {"color": style.look(k)["color"], "linewidth": 1.1, "alpha": 0.9}
            parts = [(early, 0.9), (late, 1.4)] if is_long else [(np.ones(t.size, dtype=bool), 1.2)]
            for keep, width in parts:
                ax.plot(u[keep], v[keep] / w, **look | {"linewidth": width})
            last = np.flatnonzero(np.isfinite(u))[-1:]
            ax.plot(u[last], v[last] / w, color=look["color"], marker=style.look(k)["marker"], markersize=5,
                    linestyle="-", linewidth=1.3, label=style.entry(member.scheme_name))  # fmt: skip
            reach = np.hypot(u, v / w)
            largest = max(largest, float(np.max(reach[np.isfinite(reach)], initial=0.0)))
        ax.set_title(
            f"level {levels[i]}, w dt = {words.number(_omega_dt(record, case, i, w), 'step')}"
        )
    edge = 1.12 * (min(largest, CUT * size) if size > 0.0 else largest)
    if edge == 0.0:
        # a body at rest has no orbit
        return None
    letter, measure = words.symbol(model.position), unit(record, f"{model.position}_finest")
    for n, ax in enumerate(axes):
        ax.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal")
        ax.set_xlabel(style.label(letter, measure))
        if n % ACROSS == 0:
            ax.set_ylabel(style.label(f"{words.symbol(model.velocity)} / w", measure))
    legend_above(figure, axes[0])
    parts_told = (
        f"Of the whole motion the first period (thin) and the last {PERIODS:g} are drawn. "
        if is_long
        else ""
    )
    return Picture(
        name=f"phase_plane_{case}",
        title="Phase plane: velocity against position",
        caption=f"{parts_told}Black, dashed: the exact orbit. The marker is the end of the motion. A spiral outwards "
        "gains energy, one inwards loses it; an orbit that closes beside the exact one conserves an energy of its own.",
        alt="Velocity over the natural frequency against position for each level, with the exact orbit",
        figure=figure,
    )


def _period(record: Record, case: int, w: float) -> float:
    exact = float(exact_periods(record)[case])
    return exact if math.isfinite(exact) else 2.0 * math.pi / w if w > 0.0 else math.nan


def of_level(record: Record, name: str, member: Member, level: int) -> Floats:
    """Return a state on a level: the finest one and the differences between it and that level."""
    values = at(record, f"{name}_finest", member)
    for pair in range(level, len(whole(record, "pair"))):
        values = values + at(record, f"{name}_difference", member, pair=pair)
    return values


def _draw_exact(
    axes: list[Axes], record: Record, model: Model, case: int, w: float, first: Any
) -> float:
    """Draw the exact orbit, and return its size; 0 where it is not known."""
    names = f"{model.position}_exact", f"{model.velocity}_exact"
    if any(name not in record for name in names):
        return 0.0
    u, v = (np.asarray(pick(record, name, case=case), dtype=np.float64)[first] for name in names)
    if model.linear:
        angle = np.linspace(0.0, 2.0 * np.pi, 121)
        radius = float(np.hypot(u[0], v[0] / w))
        u, v = radius * np.cos(angle), radius * w * np.sin(angle)
    for ax in axes:
        ax.plot(u, v / w, **style.REFERENCE | {"zorder": 5}, label="exact")
    return float(np.max(np.hypot(u, v / w)))


def _omega_dt(record: Record, case: int, level: int, w: float) -> float:
    return w * float(np.ravel(pick(record, "dt", case=case, level=level))[0])
