"""The largest energy error so far against time, by the scheme's own velocity and by ``[D_2t u]``.

Source: vibration text, section 6.2. On two logarithmic axes a bounded error is flat, a linear drift rises with the
slope 1 and a quadratic one with 2; the error of an unstable scheme turns upwards.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import MEMBER
from vibsim.report import frame, style
from vibsim.report.data import flags, largest, pick, pick_or_nan, time_label, times, unit, whole
from vibsim.report.figures.panels import stacked
from vibsim.report.style import Picture
from vibsim.report.types import Axes

OWN, CENTRED = "energy_deviation_running_max", "energy_deviation_d2t_running_max"
TOGETHER = 6  # most schemes in one panel
DASHED = (0, (4, 1.6))
WIDEST_RANGE = 1e18  # widest range of the error: what lies further below the largest is left out


def running(record: Record, case: int) -> Picture | None:
    """Draw the running maxima of the energy error on the coarsest level.

    None where the record has none, and where no scheme has another velocity than ``[D_2t u]``.
    """
    if not {OWN, CENTRED} <= set(record.variables):
        return None
    t, level = times(record, case)[1:], whole(record, "level")[0]
    if not np.isfinite(np.asarray(record[CENTRED], dtype=np.float64)).any():
        return None
    first = np.abs(pick_or_nan(record, "energy_initial", MEMBER)[:, case])
    usable = bool(np.all(first > 0.0))
    # running maxima of the coarsest level, shape (scheme, t), the first time left out
    over = first[:, None] if usable else 1.0
    found = (
        np.asarray(pick(record, name, case=case, level=0), np.float64) for name in (OWN, CENTRED)
    )
    both = [style.no_zeros(part[:, 1:] / over) for part in found]
    # of a body at rest nothing else tells a size
    sizes = [1.0] if usable else [size for part in both for row in part if (size := largest(row))]
    most = frame.UNBOUNDED * min(sizes, default=1.0)
    names = record.words("scheme")
    groups = [range(i, min(i + TOGETHER, len(names))) for i in range(0, len(names), TOGETHER)]
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
            own = both[0][s] if np.isfinite(both[0][s]).any() else both[1][s]
            leaves |= frame.mark_leaving(ax, t, own, color=style.look(s)["color"])
        ax.plot([], [], color=style.GREY, label="own velocity")
        ax.plot([], [], color=style.GREY, linestyle=DASHED, label="[D₂ₜu]")
        style.beside(ax, fontsize=8, handlelength=2.4)
        text = style.label("max |ΔE| so far", unit(record, "energy_deviation_max_abs"))
        ax.set_ylabel("max |ΔE| / E(0) so far" if usable else text)
    axes[0].set_title("Energy error by velocity")
    axes[-1].set_xlabel(time_label(record))
    return Picture(
        name=f"energy_running_{case}",
        title=f"How does the energy error grow with time? Level {level}",
        caption="The largest energy error so far, on the coarsest level: solid with the scheme's own velocity, dashed "
        "with the centred difference [D₂ₜu], where that is another one. Flat is bounded, slope 1 is a linear drift, "
        "slope 2 a quadratic one." + f" {frame.LEAVING} They grow without bound." * leaves,
        alt="Running maximum of the energy error of every scheme, with two velocities, against time, logarithmic",
        figure=axes[0].get_figure(root=True),
    )


def _drift(record: Record, s: int, case: int) -> str:
    """Return the kind of drift that the analysis found, for the legend; empty where it found none of these.

    Of a run that did not last to the end there is no other kind.
    """
    if record["status"][s, case, 0] != 0:
        return f": {frame.BROKE_DOWN}"
    if "energy_drift_kind" not in record:
        return ""
    kind = str(flags(record, "energy_drift_kind")[s, case, 0]).replace("_", " ")
    return f": {kind}" if kind not in {"", "unknown", "not applicable"} else ""


def _draw(ax: Axes, t: Floats, values: Floats, **look: Any) -> None:
    x, y = style.thin(t, values, 120)
    ax.plot(x, y, linewidth=1.3, markersize=4, markevery=max(1, x.size // 8), **look)


def _limits(series: list[Floats], most: float) -> tuple[float, float]:
    """Return limits that hold the series that stay below `most`, and of others where they begin to grow."""
    usual = [values for values in series if 0.0 < largest(values) <= most]
    grown = [values for values in series if largest(values) > most]
    shown = usual or [values[values <= most] for values in grown]
    values = style.finite(*shown)
    if values.size == 0:
        return (most / frame.UNBOUNDED, most) if grown else (0.1, 1.0)
    high = min(float(values.max()), style.LARGEST)
    if grown:
        high = max(high, 1e3 * most / frame.UNBOUNDED)
    return max(float(values.min()), high / WIDEST_RANGE) / 2.0, 2.0 * high
