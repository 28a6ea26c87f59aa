"""Growth and phase error per period against w dt: theory as curves, measurement as dots.

Source: vibration text, sections 4.1 to 4.6, and exercise 2; theory from the matrix of a scheme's own step.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.core.record import Record
from vibsim.report import frame, style
from vibsim.report.data import Floats, known
from vibsim.report.figures.panels import figure_of, panels
from vibsim.report.style import Picture
from vibsim.report.tables.theory import MEMBER, OF_LEVEL, omega_dt, predicted
from vibsim.schemes import SCHEMES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from vibsim.experiment import Experiment

POINTS = 240
"""Points of a curve."""
SMALLEST = 1e-13
"""Growth and phase error below this are round-off of what they are taken from."""
KINDS = ("growth", "phase error")
ALIKE = 1e-9
"""Curves that differ by less than this part of themselves are the same."""
FEW = 40
"""Dots of one scheme up to which they are large."""


def order_and_stability(experiment: Experiment, record: Record) -> Picture | None:
    """Draw ``|growth per period − 1|`` and the phase error per period against w dt; None where theory has nothing.

    There must be two different values of w dt at least: of a sweep, or of several levels.
    """
    p = omega_dt(record)
    if not predicted(record) or np.unique(p[np.isfinite(p) & (p > 0.0)]).size < 2:
        return None
    growth = [known(record, f"{who}_growth", OF_LEVEL) - 1.0 for who in ("theory", "measured")]
    turns = p / (2.0 * np.pi) / _dt(record)
    phase = [
        known(record, f"{who}_phase_error", OF_LEVEL) * turns for who in ("theory", "measured")
    ]
    # what has no theory, such as an adaptive scheme, has no place over w dt
    growth, phase = (
        [told, np.where(np.isnan(told), np.nan, seen)] for told, seen in (growth, phase)
    )
    axes = panels([2.9, 2.9])
    grid = np.geomspace(0.9 * _least(p), 1.1 * float(np.nanmax(p)), POINTS)
    curves = [_theory(experiment, s, grid) for s in range(len(record["scheme"]))]
    limits = known(record, "stability_limit", MEMBER)[:, 0]
    for k, (ax, (told, found)) in enumerate(zip(axes, (growth, phase), strict=True)):
        for s, name in enumerate(record.words("scheme")):
            if np.isnan(told[s]).all():
                continue
            look = style.look(s)
            curve = curves[s]
            if curve is None:
                _dots(ax, p, told[s], look | {"marker": "+"}, "")
            else:
                _signed(ax, grid, curve[k], look["color"])
            _dots(ax, p, found[s], look, style.entry(name))
        _finish(ax, told, found, limits, grid)
    alike = _alike(record.words("scheme"), curves)
    axes[0].set_ylabel("|growth per period − 1|")
    axes[0].set_title("Growth of the amplitude: filled grows, hollow decays")
    axes[1].set_ylabel("|phase error| / period")
    axes[1].set_title("Phase error per period: filled comes early, hollow late")
    axes[1].set_xlabel("w dt")
    style.beside(axes[0], fontsize=8, handlelength=1.6)
    if alike and not style.crowded(record):
        for ax, kind in zip(axes, KINDS, strict=True):
            _tell(ax, axes[0], [words for words in alike if words[0] == kind], KINDS.index(kind))
    return Picture(
        name="order_and_stability",
        title="Theory beside measurement: growth and phase error per period",
        caption="Curves: what the matrix of one step predicts, solid where the amplitude grows or the peaks come "
        "early, dotted where it decays or they come late. Dots: what was measured. The slope of a curve is the order "
        "of that error. A scheme without a curve at the top neither grows nor decays by theory; its dots are "
        "what rounding or the interpolation of peaks leaves. Triangles at the upper edge are limits of stability."
        + _sentence(alike),
        alt="Growth per period and phase error per period of every scheme against w dt, predicted and measured",
        figure=figure_of(axes[0]),
    )


def _alike(
    names: list[str], curves: list[tuple[Floats, Floats] | None]
) -> list[tuple[str, str, str]]:
    """Return which curves lie on an earlier one: what they are of, the scheme, and the earlier scheme."""
    found = []
    for k, kind in enumerate(KINDS):
        drawn = [(s, curve[k]) for s, curve in enumerate(curves) if curve is not None]
        drawn = [(s, np.log(np.where(np.abs(y) < SMALLEST, np.nan, np.abs(y)))) for s, y in drawn]
        firsts = frame.same_as([y for _, y in drawn], ALIKE / frame.ALIKE)
        for (s, _), first in zip(drawn, firsts, strict=True):
            if first is not None:
                found.append((kind, names[s], names[drawn[first][0]]))
    return found


def _tell(ax: Axes, first: Axes, alike: list[tuple[str, str, str]], k: int) -> None:
    """Say beside a panel which curves of it are the same; in the upper panel below the legend."""
    if not alike:
        return
    text = "\n".join(f"{name}:\n  same as {other}" for _, name, other in alike)
    if k == 0:
        rows = len(first.get_legend_handles_labels()[0])
        text = "\n" * (rows + 2) + text
    ax.text(1.02, 1.0, text, transform=ax.transAxes, va="top", fontsize=7.5, linespacing=1.25)


def _sentence(alike: list[tuple[str, str, str]]) -> str:
    """Say for the caption which curves are the same; empty where none are."""
    told = []
    for kind in KINDS:
        groups: dict[str, list[str]] = {}
        for found, name, other in alike:
            if found == kind:
                groups.setdefault(other, []).append(name)
        told += [f"{kind} of {', '.join(names)} as of {first}" for first, names in groups.items()]
    return f" The same curve: {'; '.join(told)}." if told else ""


def _dt(record: Record) -> Floats:
    """Return dt, shape (case, level) or (1, level)."""
    variable = record.variable("dt")
    dt = np.asarray(variable.values, dtype=np.float64)
    return dt.T if variable.dims == ("level", "case") else dt[None, :]


def _least(p: Floats) -> float:
    return float(np.min(p[np.isfinite(p) & (p > 0.0)]))


def _theory(experiment: Experiment, s: int, grid: Floats) -> tuple[Floats, Floats] | None:
    """Return growth per period less one and phase error over the period on a grid of w dt.

    None for an adaptive scheme, and where an option of the scheme is swept: then there is no one curve.
    """
    from vibsim import theory

    spec = experiment.schemes[s]
    axes = experiment.sweep.axes if experiment.sweep else ()
    varied = any(key.startswith(f"schemes.{spec.name}.") for axis in axes for key in axis.keys)
    scheme = SCHEMES[spec.kind]
    if varied or scheme.adaptive:
        return None
    stepper = scheme.stepper(experiment.schemes[s].options)
    with np.errstate(all="ignore"):
        growth = np.expm1(theory.roots(stepper, grid).log_growth * (2.0 * np.pi / grid))
        phase = theory.phase_error_per_period(stepper, grid)
    return np.asarray(growth), np.asarray(phase)


def _signed(ax: Axes, x: Floats, y: Floats, colour: Any) -> None:
    """Draw the size of a curve: solid where it is positive, dotted where it is negative."""
    size = np.where(np.abs(y) < SMALLEST, np.nan, np.abs(y))
    for keep, dashes, width in ((y > 0.0, "-", 1.1), (y < 0.0, (0, (1, 1.3)), 1.5)):
        ax.plot(x, np.where(keep, size, np.nan), color=colour, linestyle=dashes, linewidth=width)


def _dots(ax: Axes, p: Floats, y: Floats, look: dict[str, Any], text: str) -> None:
    """Draw measured numbers of the shape (case, level): filled where positive, hollow where negative."""
    size = np.where(np.abs(y) < SMALLEST, np.nan, np.abs(y))
    few = np.isfinite(size).sum() <= FEW
    mark: dict[str, Any] = {"color": look["color"], "marker": look["marker"], "linestyle": "none"}
    mark |= {"markersize": 4.5 if few else 2.8, "markeredgewidth": 0.9}
    ax.plot([], [], **mark, label=text)
    for keep, face in ((y > 0.0, look["color"]), (y < 0.0, "white")):
        ax.plot(p[keep], size[keep], **mark, markerfacecolor=face, zorder=3)


def _finish(ax: Axes, told: Floats, found: Floats, limits: Floats, grid: Floats) -> None:
    """Choose both logarithmic ranges, and mark the limits of stability at the upper edge.

    The range is that of theory, as far as it predicts anything but zero, and of what lies above: far below there is
    round-off only.
    """
    predicted_size = told[np.isfinite(told) & (np.abs(told) >= SMALLEST)]
    lowest = float(np.min(np.abs(predicted_size), initial=np.inf))
    least = lowest / 10.0 if math.isfinite(lowest) else SMALLEST
    values = np.concatenate([told.ravel(), found.ravel()])
    size = np.abs(values[np.isfinite(values) & (np.abs(values) >= least)])
    if size.size == 0:
        style.remark(ax, "theory and measurement agree: there is none")
        ax.set(yticks=[])
    else:
        style.log_axis(ax, "y", float(size.min()) / 3.0, min(3.0 * float(size.max()), 1e9))
    style.log_axis(ax, "x", float(grid[0]), float(grid[-1]))
    for s, limit in enumerate(limits.tolist()):
        if grid[0] < limit < grid[-1]:
            edge: dict[str, Any] = {
                "transform": ax.get_xaxis_transform(),
                "clip_on": False,
                "linestyle": "none",
            }
            ax.plot([limit], [1.0], marker="v", color=style.look(s)["color"], markersize=5, **edge)
