"""Theory beside measurement: growth and phase error of schemes against w dt, and unstable runs.

Source: vibration text, sections 4.1 to 4.6, and exercise 2; theory from the matrix of a scheme's own step; section 4.5
(figure 4): beyond the limit of stability the amplitude grows by a constant factor in each step.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import MEMBER, OF_LEVEL
from vibsim.report import choice, data, frame, style, words
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.figures.panels import stacked
from vibsim.report.series import exact_curve
from vibsim.report.style import Picture
from vibsim.report.tables.theory import predicted
from vibsim.report.types import Axes, Experiment

CURVE_POINTS = 240  # points of a curve
SMALLEST = 1e-13  # smaller growth and phase errors are round-off
KINDS = ("growth", "phase error")
SAME_CURVE = 1e-9  # relative difference below which curves are the same
FEW_DOTS = 40  # dots of one scheme up to which they are large
MOST_RUNS = 6  # most unstable runs that are drawn, from the slowest to the fastest
NOTABLE = 1e-3  # least growth per period, less one, of an unstable run that is drawn
FULLY_DRAWN = 4.0  # limit of the linear scale over the size of the exact solution
LARGEST_DRAWN = 1e250  # larger sizes are not drawn
SEEN = 0.2  # further runs join the linear panel if they stay within it so much of the time
LEAVES_FRAME = 100.0  # curves on the linear scale end at this multiple of the exact solution


def order_and_stability(record: Results) -> Picture | None:
    """Draw ``|growth per period − 1|`` and the phase error per period against w dt.

    None if theory predicts nothing, or for fewer than two values of w dt in levels and members.
    """
    p = record.omega_dt
    if not predicted(record) or np.unique(p[np.isfinite(p) & (p > 0.0)]).size < 2:
        return None
    growth = [
        record.optional(f"{origin}_growth", OF_LEVEL) - 1.0 for origin in ("theory", "measured")
    ]
    phase = [record.phase_error(origin) for origin in ("theory", "measured")]
    axes = stacked([2.9, 2.9])
    lowest, highest = float(np.min(style.finite(p[p > 0.0]))), float(np.nanmax(p))
    grid = np.geomspace(0.9 * lowest, 1.1 * highest, CURVE_POINTS)
    curves = [_theory(record.experiment, s, grid) for s in range(len(record.schemes))]
    limits = record.optional("stability_limit", MEMBER)[:, 0]
    for k, (ax, (from_theory, measured)) in enumerate(zip(axes, (growth, phase), strict=True)):
        # schemes without theory, such as adaptive ones, have no w dt
        shown = np.where(np.isnan(from_theory), np.nan, measured)
        for s, name in enumerate(record.schemes):
            if np.isnan(from_theory[s]).all():
                continue
            look, curve = style.look(s), curves[s]
            if curve is None:
                _dots(ax, p, from_theory[s], look | {"marker": "+"}, "")
            else:
                y, size = curve[k], _visible(curve[k])
                for keep, dashes, width in ((y > 0.0, "-", 1.1), (y < 0.0, (0, (1, 1.3)), 1.5)):
                    line: dict[str, Any] = {"linestyle": dashes, "linewidth": width}
                    ax.plot(grid, np.where(keep, size, np.nan), color=look["color"], **line)
            _dots(ax, p, shown[s], look, style.entry(name))
        _finish(ax, from_theory, shown, limits, grid)
    alike = _alike(record.schemes, curves)
    axes[0].set_ylabel("|growth per period − 1|")
    axes[0].set_title("Growth of the amplitude: filled grows, hollow decays")
    axes[1].set_title("Phase error per period: filled comes early, hollow late")
    axes[1].set(xlabel="w dt", ylabel="|phase error| / period")
    style.beside(axes[0], fontsize=8, handlelength=1.6)
    if not record.is_crowded:
        # in the upper panel below the legend
        rows = len(axes[0].get_legend_handles_labels()[0]) + 2
        for ax, kind, below in zip(axes, KINDS, ("\n" * rows, ""), strict=True):
            same = [f"{name}:\n  same as {first}" for of, name, first in alike if of == kind]
            small: dict[str, Any] = {"va": "top", "fontsize": 7.5, "linespacing": 1.25}
            if same:
                ax.text(1.02, 1.0, below + "\n".join(same), transform=ax.transAxes, **small)
    return Picture(
        name="order_and_stability",
        title="Theory beside measurement: growth and phase error per period",
        caption="Curves: theory, solid where the amplitude grows or the peaks come early, dotted where it decays "
        "or they come late. Dots: measured. The slope of a curve is the order of that error. A scheme without a "
        "curve at the top neither grows nor decays by theory. Triangles at the upper edge are limits of stability."
        + _sentence(alike),
        alt="Growth per period and phase error per period of every scheme against w dt, predicted and measured",
        figure=axes[0].get_figure(root=True),
    )


def _alike(
    names: list[str], curves: list[tuple[Floats, Floats] | None]
) -> list[tuple[str, str, str]]:
    """Return the curves that coincide with an earlier one: kind, scheme, and earlier scheme."""
    same = []
    drawn = [(name, curve) for name, curve in zip(names, curves, strict=True) if curve is not None]
    for k, kind in enumerate(KINDS):
        sizes = [np.log(_visible(curve[k])) for _, curve in drawn]
        firsts = frame.same_as(sizes, SAME_CURVE / frame.LOOKS_ALIKE)
        for (name, _), first in zip(drawn, firsts, strict=True):
            if first is not None:
                same.append((kind, name, drawn[first][0]))
    return same


def _visible(values: Floats) -> Floats:
    """Return absolute values; NaN for round-off."""
    return np.where(np.abs(values) < SMALLEST, np.nan, np.abs(values))


def _sentence(alike: list[tuple[str, str, str]]) -> str:
    """Say for the caption which curves coincide; empty if none do."""
    phrases = []
    for kind in KINDS:
        groups: dict[str, list[str]] = {}
        for alike_kind, name, first in alike:
            if alike_kind == kind:
                groups.setdefault(first, []).append(name)
        phrases += [
            f"{kind} of {', '.join(names)} as of {first}" for first, names in groups.items()
        ]
    return f" The same curve: {'; '.join(phrases)}." if phrases else ""


def _theory(experiment: Experiment, s: int, grid: Floats) -> tuple[Floats, Floats] | None:
    """Return growth per period minus one, and phase error over the period, on a grid of w dt.

    None for an adaptive scheme or one with a swept option, which has no single curve.
    """
    from vibsim import theory

    spec = experiment.schemes[s]
    if spec.adaptive or choice.has_swept_options(experiment, spec):
        return None
    stepper = spec.method.stepper(spec.options)
    with np.errstate(all="ignore"):
        growth = np.expm1(theory.roots(stepper, grid).log_growth * (2.0 * np.pi / grid))
        phase = theory.phase_error_per_period(stepper, grid)
    return np.asarray(growth), np.asarray(phase)


def _dots(ax: Axes, p: Floats, y: Floats, look: dict[str, Any], text: str) -> None:
    """Draw measured numbers of the shape (case, level): filled where positive, hollow where negative."""
    size = _visible(y)
    few = np.isfinite(size).sum() <= FEW_DOTS
    mark: dict[str, Any] = {"color": look["color"], "marker": look["marker"], "linestyle": "none"}
    mark |= {"markersize": 4.5 if few else 2.8, "markeredgewidth": 0.9}
    ax.plot([], [], **mark, label=text)
    for keep, face in ((y > 0.0, look["color"]), (y < 0.0, "white")):
        ax.plot(p[keep], size[keep], **mark, markerfacecolor=face, zorder=3)


def _finish(ax: Axes, from_theory: Floats, measured: Floats, limits: Floats, grid: Floats) -> None:
    """Set both logarithmic ranges, and mark the limits of stability at the upper edge.

    The vertical range holds the nonzero predictions and everything above them; far below is only round-off.
    """
    predicted_size = from_theory[np.isfinite(from_theory) & (np.abs(from_theory) >= SMALLEST)]
    lowest = float(np.min(np.abs(predicted_size), initial=np.inf))
    least = lowest / 10.0 if math.isfinite(lowest) else SMALLEST
    values = np.concatenate([from_theory.ravel(), measured.ravel()])
    size = np.abs(values[np.isfinite(values) & (np.abs(values) >= least)])
    if size.size == 0:
        style.remark(ax, "theory and measurement agree: there is none")
        ax.set(yticks=[])
    else:
        style.log_axis(ax, "y", float(size.min()) / 3.0, min(3.0 * float(size.max()), 1e9))
    style.log_axis(ax, "x", float(grid[0]), float(grid[-1]))
    edge: Any = {"transform": ax.get_xaxis_transform(), "clip_on": False, "linestyle": "none"}
    for s, limit in enumerate(limits.tolist()):
        if grid[0] < limit < grid[-1]:
            ax.plot([limit], [1.0], marker="v", color=style.look(s)["color"], markersize=5, **edge)


def growing(record: Results) -> Picture | None:
    """Draw the runs with w dt at or beyond the limit of stability, and their predicted growth; None without any."""
    runs = _unstable(record)
    if not runs:
        return None
    upper, lower = stacked([2.2, 2.6], style.TIME)
    sizes, reference = [], 0.0
    for k, (member, level) in enumerate(runs):
        ladder, colour = Ladder(record, record.model.position, member), style.look(k)["color"]
        t, values, exact = ladder.t, ladder.on_level(level), ladder.exact
        most = data.largest(exact)
        reference = max(reference, most)
        if k == 0 or np.mean(np.abs(values) <= FULLY_DRAWN * most) >= SEEN:
            within = np.abs(values) <= LEAVES_FRAME * most if most > 0.0 else np.isfinite(values)
            inner = style.thin(t, np.where(within, values, np.nan))
            upper.plot(*inner, color=colour, linewidth=1.2)
        # larger sizes would overflow the margin of the axis
        size = style.no_zeros(values)
        size = np.where(size < LARGEST_DRAWN, size, np.nan)
        sizes.append(size)
        text = _run_label(record, member, level)
        lower.plot(*style.thin(t, size), color=colour, linewidth=0.9, label=text)
        growth = record.at("theory_growth", member, level=level).item()
        w = record.natural_frequency(member.case)
        if math.isfinite(growth) and math.isfinite(w) and most > 0.0:
            exponent = (t - t[0]) * w / (2.0 * np.pi) * math.log10(growth) + math.log10(most)
            keep = exponent < math.log10(LARGEST_DRAWN)
            dashed: dict[str, Any] = {"linestyle": (0, (4, 2)), "linewidth": 1.0}
            lower.plot(t[keep], 10.0 ** exponent[keep], color=colour, **dashed)
        if k == 0 and np.isfinite(exact).any():
            smooth = style.thin(*exact_curve(ladder))
            upper.plot(*smooth, color="black", linestyle=(0, (1, 2)), zorder=5)
    if reference > 0.0:
        upper.set_ylim(-FULLY_DRAWN * reference, FULLY_DRAWN * reference)
    finite = style.finite(*sizes)
    finite = finite if finite.size else np.array([1.0])
    least = 0.2 * (reference or float(np.median(finite)))
    style.log_axis(lower, "y", least, 3.0 * float(finite.max()))
    upper.set_ylabel(style.label(ladder.letter, ladder.unit()))
    lower.set_ylabel(style.label(f"|{ladder.letter}|", ladder.unit()))
    which = "The slowest run" if len(runs) > 1 else "The run"
    beside = f"{which} beside the {record.name_of_exact} solution (dotted)"
    upper.set_title(f"{beside}, up to {FULLY_DRAWN:g} times its size")
    lower.set_title("Size of the solution, and the predicted growth (dashed)")
    lower.set_xlabel(record.time_label)
    # one legend for both panels
    upper.legend(*lower.get_legend_handles_labels(), **style.BESIDE, fontsize=8, handlelength=1.4)
    return Picture(
        name="growing",
        title="Unstable runs: growth predicted and measured",
        caption="Runs whose w dt is at or beyond the limit of stability of their scheme; the legend has the factor by "
        "which the amplitude grows in each natural period, measured and by theory. The lines should become parallel "
        "to the dashed ones of theory. How far above or below depends on the start.",
        alt=f"{ladder.name} of unstable runs against time, linear and logarithmic, with the predicted growth",
        figure=upper.get_figure(root=True),
    )


def _unstable(record: Results) -> list[tuple[Member, int]]:
    """Choose the unstable runs, from the slowest growth to the fastest."""
    growth = record.optional("theory_growth", OF_LEVEL)
    limit, product = record.optional("stability_limit", MEMBER), record.omega_dt
    runs: list[tuple[float, Member, int]] = []
    for member in record.all_members:
        most = float(limit[member.scheme, member.case])
        for i, factor in enumerate(growth[member.scheme, member.case].tolist()):
            is_beyond = 0.0 < most <= product[member.case, i] * (1.0 + 1e-9)
            if is_beyond and factor > 1.0 + NOTABLE:
                runs.append((factor, member, i))
    runs.sort(key=lambda run: run[0])
    return [runs[i][1:] for i in style.spaced(len(runs), MOST_RUNS)]


def _run_label(record: Results, member: Member, level: int) -> str:
    from_theory, measured = (
        words.number(record.at(f"{origin}_growth", member, level=level).item())
        for origin in ("theory", "measured")
    )
    product = words.number(float(record.omega_dt[member.case, level]), "step")
    return style.entry(
        f"{member.scheme_name}, w dt = {product}\n× {measured}, theory {from_theory}"
    )
