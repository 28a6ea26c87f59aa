"""The running maximum of the energy error against time, with the scheme's own velocity and with ``[D_2t u]``.

Source: vibration text, section 6.2. On two logarithmic axes a bounded error is flat, a linear drift has slope 1, a
quadratic one slope 2; the error of an unstable scheme turns upwards.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import MEMBER
from vibsim.report import frame, style
from vibsim.report.data import Results, largest
from vibsim.report.figures.panels import stacked
from vibsim.report.style import Picture
from vibsim.report.types import Axes

OWN, CENTRED = "energy_deviation_running_max", "energy_deviation_d2t_running_max"
MOST = 6  # schemes in one panel
DASHED = (0, (4, 1.6))
WIDEST_RANGE = 1e18  # of the error axis: smaller errors, relative to the largest, are left out


def running(record: Results, case: int) -> Picture | None:
    """Draw the running maxima of the energy error on the coarsest level.

    None if the record has none, or if every scheme's velocity is ``[D_2t u]``.
    """
    if not {OWN, CENTRED} <= set(record.variables):
        return None
    t, level = record.times(case)[1:], record.levels[0]
    if not np.isfinite(np.asarray(record[CENTRED], dtype=np.float64)).any():
        return None
    first = np.abs(record.optional("energy_initial", MEMBER)[:, case])
    is_relative = bool(np.all(first > 0.0))
    # running maxima of the coarsest level, shape (scheme, t), without the first time
    scale = first[:, None] if is_relative else 1.0
    maxima = (record.pick(name, case=case, level=0) for name in (OWN, CENTRED))
    both = [style.no_zeros(part[:, 1:].astype(np.float64) / scale) for part in maxima]
    # without an initial energy only the errors themselves give a size
    sizes = [size for part in both for row in part if (size := largest(row))]
    most = frame.UNBOUNDED * (1.0 if is_relative else min(sizes, default=1.0))
    names = record.schemes
    groups = [range(i, min(i + MOST, len(names))) for i in range(0, len(names), MOST)]
    axes = stacked([2.5] * len(groups), style.TIME)
    leaves = False
    for ax, group in zip(axes, groups, strict=True):
        for s in group:
            look = style.look(s)
            text = style.entry(names[s] + _drift(record, s, case))
            solid = {"marker": look["marker"], "label": text}
            _draw(ax, t, both[0][s], color=look["color"], **solid)
            if np.isfinite(both[1][s]).any():
                _draw(ax, t, both[1][s], color=look["color"], marker="", linestyle=DASHED)
        style.log_axis(ax, "x", float(t[0]), float(t[-1]))
        style.log_axis(ax, "y", *_limits([part[s] for part in both for s in group], most))
        for s in group:
            values = both[0][s] if np.isfinite(both[0][s]).any() else both[1][s]
            leaves |= frame.mark_leaving(ax, t, values, color=style.look(s)["color"])
        ax.plot([], [], color=style.GREY, label="own velocity")
        ax.plot([], [], color=style.GREY, linestyle=DASHED, label="[D₂ₜu]")
        style.beside(ax, fontsize=8, handlelength=2.4)
        text = style.label("max |ΔE| so far", record.unit("energy_deviation_max_abs"))
        ax.set_ylabel("max |ΔE| / E(0) so far" if is_relative else text)
    axes[0].set_title("Energy error by velocity")
    axes[-1].set_xlabel(record.time_label)
    return Picture(
        name=f"energy_running_{case}",
        title=f"How does the energy error grow with time? Level {level}",
        caption="The largest energy error so far, on the coarsest level: solid with the scheme's own velocity, dashed "
        "with the centred difference [D₂ₜu], where that is another one. Flat is bounded, slope 1 is a linear drift, "
        "slope 2 a quadratic one." + f" {frame.LEAVING} They grow without bound." * leaves,
        alt="Running maximum of the energy error of every scheme, with two velocities, against time, logarithmic",
        figure=axes[0].get_figure(root=True),
    )


def _drift(record: Results, s: int, case: int) -> str:
    """Return the kind of drift for the legend; empty if the analysis named none. A run may also have broken down."""
    if record["status"][s, case, 0] != 0:
        return f": {frame.BROKE_DOWN}"
    if "energy_drift_kind" not in record:
        return ""
    kind = str(record.flags("energy_drift_kind")[s, case, 0]).replace("_", " ")
    return f": {kind}" if kind not in {"", "unknown", "not applicable"} else ""


def _draw(ax: Axes, t: Floats, values: Floats, **look: Any) -> None:
    x, y = style.thin(t, values, 120)
    ax.plot(x, y, linewidth=1.3, markersize=4, markevery=max(1, x.size // 8), **look)


def _limits(series: list[Floats], most: float) -> tuple[float, float]:
    """Return limits around the series that stay below `most` and the part of the others that begins to grow."""
    bounded = [values for values in series if 0.0 < largest(values) <= most]
    grown = [values for values in series if largest(values) > most]
    shown = bounded or [values[values <= most] for values in grown]
    values = style.finite(*shown)
    if values.size == 0:
        return (most / frame.UNBOUNDED, most) if grown else (0.1, 1.0)
    high = min(float(values.max()), style.LARGEST)
    if grown:
        high = max(high, 1e3 * most / frame.UNBOUNDED)
    return max(float(values.min()), high / WIDEST_RANGE) / 2.0, 2.0 * high
